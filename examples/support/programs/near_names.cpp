#include "support/programs/near_names.hpp"

#include <algorithm>
#include <numeric>

#include "support/text_fields.hpp"

namespace globalmatch::support {

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);  // distances of the start of `a` from all starts of `b`
  std::iota(row.begin(), row.end(), std::size_t(0));
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t k = 0; k < b.size(); ++k) {
      const std::size_t replaced = diagonal + (a[i] == b[k] ? 0 : 1);
      diagonal = row[k + 1];
      row[k + 1] = std::min({replaced, diagonal + 1, row[k] + 1});
    }
  }
  return row.back();
}

std::string suggest_name(const std::string& wanted, const std::vector<std::string>& names) {
  constexpr std::size_t max_listed = 5;
  const std::string lower = lower_case(wanted);
  const std::string* nearest = nullptr;
  std::size_t best = std::max<std::size_t>(1, wanted.size() / 3) + 1;
  for (const std::string& name : names) {
    const std::string other = lower_case(name);
    const bool is_start = other.starts_with(lower) || lower.starts_with(other);
    const std::size_t distance =
        is_start ? std::min<std::size_t>(1, edit_distance(lower, other)) : edit_distance(lower, other);
    if (distance < best) best = distance, nearest = &name;
  }
  if (nearest) return "is it " + *nearest + "?";
  if (names.empty()) return "there are none";
  std::string text = "there are ";
  for (std::size_t i = 0; i < std::min(max_listed, names.size()); ++i)
    text += (i == 0 ? "" : ", ") + names[i];
  if (names.size() > max_listed) text += " and " + std::to_string(names.size() - max_listed) + " others";
  return text;
}

}  // namespace globalmatch::support
