// Internal to the readers of tables: comments that name the columns of the rows below.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace globalmatch::support {

/// The header with units joined to the names before them: `x [m] y [m]` has two names, not four.
std::string with_joined_units(std::string_view header);

/// What follows words that announce names, as in `columns: x y z` or `FIELDS x y z`; else the whole comment.
std::string_view announced_names(std::string_view comment);

/// Whether a comment is a sentence that says no more than the order x, y, z of the rows' first cells: one
/// with words such as `and`, above rows of three cells or with x first. `x`, `y` and `z` are places in
/// `words`.
bool is_harmless_sentence(const std::vector<std::string_view>& words, std::size_t x, std::size_t y,
                          std::size_t z, std::size_t cells);

/// Whether words between blanks are prose: at least one is known neither as the name of a column nor as a
/// unit, and not two of them are x, y, z or their like. `Plot North East` names a place.
bool is_prose(const std::vector<std::string_view>& words);

/// Whether a comment of as many words as the rows have cells names columns of polar coordinates, or only some
/// of x, y and z: at least two of its words do.
bool names_other_coordinates(const std::vector<std::string_view>& words);

}  // namespace globalmatch::support
