// Internal to the readers: memory for all points of a scan.
#pragma once

#include <cstddef>
#include <type_traits>

namespace globalmatch::support {

/// Memory of `size` bytes that is not initialised, in large pages where the system has them: to get each page
/// takes the system about as long as to decode its points. Free it with `free_large`.
void* allocate_large(std::size_t size);
void free_large(void* memory);

/// Values that are not initialised.
template <class T>
class large_array {
  static_assert(std::is_trivial_v<T>);

 public:
  explicit large_array(std::size_t size) : values_(static_cast<T*>(allocate_large(size * sizeof(T)))) {}
  ~large_array() { free_large(values_); }
  large_array(const large_array&) = delete;
  large_array& operator=(const large_array&) = delete;

  T* data() { return values_; }
  const T* data() const { return values_; }

 private:
  T* values_;
};

}  // namespace globalmatch::support
