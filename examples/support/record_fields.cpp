#include "support/record_fields.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>

namespace globalmatch::support {

namespace {

template <class T>
void store(char* bytes, T value) {
  std::memcpy(bytes, &value, sizeof(T));
  if constexpr (std::endian::native != std::endian::little) std::reverse(bytes, bytes + sizeof(T));
}

template <class T>
void put(char* record, const record_field& field, T number) {
  if (field.bits == 0) return store(record + field.offset, number);
  const unsigned mask = ((1u << field.bits) - 1) << field.first_bit;
  const auto byte = static_cast<unsigned char>(record[field.offset]);
  const unsigned shifted = static_cast<unsigned>(number) << field.first_bit;
  record[field.offset] = static_cast<char>((byte & ~mask) | (shifted & mask));
}

template <class T>
void put_unchanged(std::span<const char> numbers, std::span<const std::size_t> kept,
                   const record_field& field, std::size_t record_size, char* records) {
  for (const std::size_t i : kept) {
    put(records, field, load<T>(numbers.data() + i * sizeof(T), std::endian::native));
    records += record_size;
  }
}

template <class To, class From>
void convert(std::span<const char> numbers, const attribute& from, std::span<const std::size_t> kept,
             const record_field& field, std::size_t record_size, char* records) {
  const double factor = from.scale / field.what.scale;
  const double shift = (from.offset - field.what.offset) / field.what.scale;
  const double max_of_bits = (1u << field.bits) - 1.0;
  for (const std::size_t i : kept) {
    const auto number =
        static_cast<double>(load<From>(numbers.data() + i * sizeof(From), std::endian::native));
    const double value = number * factor + shift;
    put(records, field, nearest<To>(field.bits > 0 ? std::min(value, max_of_bits) : value));
    records += record_size;
  }
}

}  // namespace

void gather(const record_array& records, const record_field& field, std::vector<char>& numbers) {
  visit_type(field.what.type, [&]<class T>(T) {
    numbers.resize(records.count * sizeof(T));
    const char* at = records.bytes + field.offset;
    for (std::size_t i = 0; i < records.count; ++i, at += records.record_size) {
      T number = load<T>(at, records.order);
      if constexpr (sizeof(T) == 1)
        if (field.bits > 0)
          number =
              static_cast<T>(static_cast<unsigned char>(*at) >> field.first_bit & ((1u << field.bits) - 1));
      std::memcpy(numbers.data() + i * sizeof(T), &number, sizeof(T));
    }
  });
}

void gather(const record_array& records, std::span<const record_field> fields,
            std::span<attribute_column> columns) {
  for (attribute_column& column : columns) gather(records, fields[column.attribute], column.numbers);
}

std::vector<attribute> attributes_of(std::span<const record_field> fields) {
  std::vector<attribute> attributes;
  for (const record_field& field : fields) attributes.push_back(field.what);
  return attributes;
}

void put_numbers(std::span<const char> numbers, const attribute& from, std::span<const std::size_t> kept,
                 const record_field& field, std::size_t record_size, char* records) {
  const attribute& to = field.what;
  const bool is_same = from.type == to.type && from.scale == to.scale && from.offset == to.offset;
  visit_type(to.type, [&]<class To>(To) {
    if (is_same) return put_unchanged<To>(numbers, kept, field, record_size, records);
    visit_type(from.type, [&]<class From>(From) {
      convert<To, From>(numbers, from, kept, field, record_size, records);
    });
  });
}

}  // namespace globalmatch::support
