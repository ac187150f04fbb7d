// Values as a row of bytes and back. A type says once which of its fields are written, and in which order, by
// a function `serialize(archive, value)` that serves both directions.
#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/little_endian.hpp"

namespace globalmatch::detail {

/// T or const T: what `serialize` takes when it reads, and when it writes.
template <class V, class T>
concept either_const = std::same_as<std::remove_const_t<V>, T>;

/// Appends values to a row of bytes.
class output_archive {
 public:
  template <class... Values>
  void operator()(const Values&... values) {
    (put(values), ...);
  }
  void count(std::size_t value) { put(std::uint64_t(value)); }  ///< with the same bytes on every platform
  template <class Enum>
  void choice(Enum value, Enum /*last*/) {
    put(static_cast<std::uint8_t>(value));
  }

  const std::string& bytes() const& { return bytes_; }
  std::string bytes() && { return std::move(bytes_); }

 private:
  template <plain_number T>
  void put(T value) {
    std::array<char, sizeof(T)> raw;
    store_little_endian(value, raw.data());
    bytes_.append(raw.data(), raw.size());
  }
  void put(bool value) { put(std::uint8_t(value ? 1 : 0)); }
  void put(const std::string& text) {
    count(text.size());
    bytes_.append(text);
  }
  template <class T>
  void put(const std::vector<T>& values) {
    count(values.size());
    for (const T& value : values) put(value);
  }
  template <class T>
  requires(!std::is_arithmetic_v<T>) void put(const T& value) { serialize(*this, value); }

  std::string bytes_;
};

/// Takes values from a row of bytes, which must outlive it. Throws `std::runtime_error` when there are fewer
/// bytes than the values say, and for what no writer writes. Memory follows the bytes, not the counts.
class input_archive {
 public:
  /// `name`: of the bytes, for messages.
  input_archive(std::string_view bytes, std::string_view name) : bytes_(bytes), name_(name) {}

  template <class... Values>
  void operator()(Values&... values) {
    (get(values), ...);
  }
  void count(std::size_t& value) {
    std::uint64_t wide = 0;
    get(wide);
    if (wide > std::numeric_limits<std::size_t>::max()) fail("holds a count beyond this platform");
    value = static_cast<std::size_t>(wide);
  }
  template <class Enum>
  void choice(Enum& value, Enum last) {
    std::uint8_t number = 0;
    get(number);
    if (number > static_cast<std::uint8_t>(last)) fail("holds a choice that there is not");
    value = static_cast<Enum>(number);
  }

  /// To be called after the last value: throws when there are bytes left.
  void finish() const {
    if (!bytes_.empty()) fail("holds more than its values");
  }
  [[noreturn]] void fail(std::string_view problem) const {
    throw std::runtime_error(name_ + " " + std::string(problem));
  }

 private:
  std::string_view take(std::size_t size) {
    if (size > bytes_.size()) fail("holds less than its counts say");
    const std::string_view taken = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
    return taken;
  }
  template <plain_number T>
  void get(T& value) {
    value = load_little_endian<T>(take(sizeof(T)).data());
  }
  void get(bool& value) {
    std::uint8_t number = 0;
    get(number);
    if (number > 1) fail("holds a truth value that is neither 0 nor 1");
    value = number != 0;
  }
  void get(std::string& text) {
    std::size_t size = 0;
    count(size);
    text = take(size);
  }
  template <class T>
  void get(std::vector<T>& values) {
    std::size_t size = 0;
    count(size);
    values.clear();
    values.reserve(std::min(size, bytes_.size() / sizeof(T)));
    for (; size > 0; --size) get(values.emplace_back());
  }
  template <class T>
  requires(!std::is_arithmetic_v<T>) void get(T& value) { serialize(*this, value); }

  std::string_view bytes_;
  std::string name_;
};

}  // namespace globalmatch::detail
