#include "support/large_array.hpp"

#include <new>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace globalmatch::support {

namespace {

constexpr std::size_t large_page = std::size_t(2) << 20;

}  // namespace

void* allocate_large(std::size_t size) {
  const std::size_t whole_pages = (size + large_page - 1) / large_page * large_page;
  if (whole_pages < size) throw std::bad_alloc();
  void* memory = ::operator new(whole_pages, std::align_val_t(large_page));
#if defined(__linux__)
  if (size >= large_page) madvise(memory, whole_pages, MADV_HUGEPAGE);  // which systems may refuse
#endif
  return memory;
}

void free_large(void* memory) {
  ::operator delete(memory, std::align_val_t(large_page));
}

}  // namespace globalmatch::support
