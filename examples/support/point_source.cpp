#include "support/point_source.hpp"

#include "support/class_counts.hpp"

namespace globalmatch::support {

std::optional<class_counts> point_source::count_classes(const execution&) const {
  return std::nullopt;
}

}  // namespace globalmatch::support
