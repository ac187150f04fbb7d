#include "support/point_source.hpp"

#include "support/class_counts.hpp"

namespace globalmatch::support {

std::string note_on_more_points(std::uint64_t announced, std::string_view more) {
  return "the header announces " + std::to_string(announced) + " points, and the file holds " +
         std::string(more) + " behind them, which were not read: is it damaged? Export the scan again";
}

std::optional<class_counts> point_source::count_classes(const execution&) const {
  return std::nullopt;
}

}  // namespace globalmatch::support
