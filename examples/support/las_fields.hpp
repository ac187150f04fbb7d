// Internal to the LAS reader and writer: where the attributes are in a point record.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "support/point_attributes.hpp"
#include "support/record_fields.hpp"

namespace globalmatch::support {

/// The attributes of a point format but wave packets; none for a format that does not exist. Their names are
/// the common ones (`common_name`).
std::vector<record_field> las_fields(unsigned format);

/// The attributes in the extra bytes of a record by the names of the file, as the content of a record of
/// `Extra Bytes` describes them. Those of several bytes or numbers, and bytes that are not described, become
/// one attribute for each byte or number: `name[0]` and so on. Attributes that go beyond the extra bytes are
/// left out.
std::vector<record_field> extra_fields(std::string_view description, std::size_t begin,
                                       std::size_t record_size);

/// What `extra_fields` reads. Names are cut to 32 bytes.
std::string describe_extra_fields(const std::vector<record_field>& fields);

/// [bytes] of what describes one attribute.
inline constexpr std::size_t extra_description_size = 192;

}  // namespace globalmatch::support
