#include "support/file_bytes.hpp"

#include <system_error>
#include <utility>

#include "support/file_error.hpp"

#if defined(__unix__) || defined(__APPLE__)
#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#else
#include <fstream>
#include <mutex>
#endif

namespace globalmatch::support {

namespace {

void require_regular(const std::filesystem::path& path) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  if (!fs::exists(path, ignored))
    throw file_error(path, "does not exist", "Check the spelling and the current directory");
  if (fs::is_directory(path, ignored))
    throw file_error(path, "is a folder", "Name a file in it; a folder of tiles of one scan needs --tiles");
  if (!fs::is_regular_file(path, ignored))
    throw file_error(path, "is not a regular file", "Name a file on disk");
}

}  // namespace

#if defined(__unix__) || defined(__APPLE__)

struct file_bytes::handle {
  explicit handle(const std::filesystem::path& path) : number(open(path.c_str(), O_RDONLY | O_CLOEXEC)) {}
  ~handle() {
    if (is_open()) close(number);
  }
  handle(const handle&) = delete;
  handle& operator=(const handle&) = delete;

  bool is_open() const { return number >= 0; }

  /// Whether all of `bytes` was there.
  bool read(std::uint64_t offset, std::span<char> bytes) const {
    while (!bytes.empty()) {
      const ssize_t count = pread(number, bytes.data(), bytes.size(), static_cast<off_t>(offset));
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) return false;
      offset += static_cast<std::uint64_t>(count);
      bytes = bytes.subspan(static_cast<std::size_t>(count));
    }
    return true;
  }

  int number;
};

#else

struct file_bytes::handle {
  explicit handle(const std::filesystem::path& path) : stream(path, std::ios::binary) {}

  bool is_open() const { return stream.is_open(); }

  bool read(std::uint64_t offset, std::span<char> bytes) const {
    const std::lock_guard lock(mutex);
    stream.clear();
    stream.seekg(static_cast<std::streamoff>(offset));
    stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    return static_cast<std::size_t>(stream.gcount()) == bytes.size();
  }

  mutable std::ifstream stream;
  mutable std::mutex mutex;
};

#endif

file_bytes::file_bytes(std::filesystem::path path) : path_(std::move(path)) {
  require_regular(path_);
  handle_ = std::make_unique<handle>(path_);
  if (!handle_->is_open()) fail("cannot be opened for reading", "Check the permissions of the file");
  size_ = std::filesystem::file_size(path_);
}

file_bytes::~file_bytes() = default;
file_bytes::file_bytes(file_bytes&&) noexcept = default;
file_bytes& file_bytes::operator=(file_bytes&&) noexcept = default;

void file_bytes::read(std::uint64_t offset, std::span<char> bytes) const {
  if (offset > size_ || bytes.size() > size_ - offset || !handle_->read(offset, bytes)) fail_truncated();
}

void file_bytes::fail(std::string_view problem, std::string_view remedy) const {
  throw file_error(path_, problem, remedy);
}

void file_bytes::fail_truncated() const {
  fail("ends before all the data that its header announces",
       "It is probably truncated: copy or export it again");
}

}  // namespace globalmatch::support
