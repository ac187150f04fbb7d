// Internal to readers and writers: attributes in records of bytes, taken out and put in.
#pragma once

#include <bit>
#include <cstddef>
#include <span>
#include <vector>

#include "support/point_attributes.hpp"

namespace globalmatch::support {

/// Where an attribute is in a record.
struct record_field {
  attribute what;
  std::size_t offset = 0;  ///< [bytes] in the record
  unsigned first_bit = 0;  ///< of fields that are some bits of a byte; those are of type uint8
  unsigned bits = 0;       ///< 0: whole numbers of the type
};

/// Records of one size, one behind the other.
struct record_array {
  const char* bytes;
  std::size_t record_size;
  std::size_t count;
  std::endian order = std::endian::little;
};

/// The numbers of a field of all records.
void gather(const record_array& records, const record_field& field, std::vector<char>& numbers);

/// The columns of the fields that they ask for by index.
void gather(const record_array& records, std::span<const record_field> fields,
            std::span<attribute_column> columns);

/// What is in the fields.
std::vector<attribute> attributes_of(std::span<const record_field> fields);

/// Puts numbers into a field of little endian records: number `kept[i]` of the column of `from` into record
/// `i`. They keep their bits where `from` is stored as the field is. Otherwise the values are rounded to what
/// the field can store, clamped to its range, and zero where they are not-a-number.
void put_numbers(std::span<const char> numbers, const attribute& from, std::span<const std::size_t> kept,
                 const record_field& field, std::size_t record_size, char* records);

}  // namespace globalmatch::support
