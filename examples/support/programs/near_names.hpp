// Names that somebody may have meant: for messages about names that there are not.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace globalmatch::support {

/// Letters to insert, remove or replace to make one text of the other (Levenshtein 1966).
std::size_t edit_distance(std::string_view a, std::string_view b);

/// "is it NAME?" where one is near, in any case, or begins with the other; else the first ones that there
/// are. For the end of a message.
std::string suggest_name(const std::string& wanted, const std::vector<std::string>& names);

}  // namespace globalmatch::support
