#include "support/file_bytes.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "support/file_error.hpp"
#include "support/temporary_file.hpp"

#if defined(__unix__) || defined(__APPLE__)
#include <fcntl.h>
#include <unistd.h>
#else
#include <fstream>
#include <mutex>
#endif

namespace globalmatch::support {

namespace {

void require_regular(const std::filesystem::path& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  const bool is_pattern = path.string().find_first_of("*?") != std::string::npos;
  if (status.type() == fs::file_type::not_found)
    throw file_error(path, "does not exist",
                     is_pattern ? "Patterns are not taken here: name one file, or with --tiles a folder"
                                : "Check the spelling and the current directory");
  if (error) throw file_error(path, "cannot be opened (" + error.message() + ")", "Check its permissions");
  if (fs::is_directory(status))
    throw file_error(path, "is a folder", "Name a file in it; a folder of tiles of one scan needs --tiles");
  if (!fs::is_regular_file(status)) throw file_error(path, "is not a regular file", "Name a file on disk");
}

}  // namespace

#if defined(__unix__) || defined(__APPLE__)

struct file_bytes::handle {
  explicit handle(const std::filesystem::path& path) : number(::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {}
  ~handle() {
    if (is_open()) ::close(number);
  }
  handle(const handle&) = delete;
  handle& operator=(const handle&) = delete;

  bool is_open() const { return number >= 0; }

  /// Whether all of `bytes` was there; `errno` is 0 where the file ends before.
  bool read(std::uint64_t offset, std::span<char> bytes) const {
    while (!bytes.empty()) {
      const ssize_t count = pread(number, bytes.data(), bytes.size(), static_cast<off_t>(offset));
      if (count < 0 && errno == EINTR) continue;
      if (count == 0) errno = 0;
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
  if (path_ == "-")
    *this = of_standard_input();
  else
    open();
}

// Standard input comes once, and each of its scans is opened. It is copied to disk, not to memory: that is
// right for any size, and a small file stays in the memory of the system anyway.
const file_bytes& file_bytes::of_standard_input() {
  constexpr std::string_view name = "standard input";
  static temporary_file copy(name);
  static const file_bytes all = [&] {
    file_bytes file(copy.path());
    copy.remove();  // before it is filled, so that nothing is left where the program is interrupted
    file.path_ = name;
    file.size_ = copy.copy_from(stdin);
    return file;
  }();
  return all;
}

void file_bytes::open() {
  require_regular(path_);
  handle_ = std::make_shared<const handle>(path_);
  if (!handle_->is_open()) {
    const bool too_many = errno == EMFILE || errno == ENFILE;
    fail("cannot be opened for reading (" + std::generic_category().message(errno) + ")",
         too_many ? "Raise the number of files that may be open (ulimit -n)"
                  : "Check the permissions of the file");
  }
  std::error_code error;
  size_ = std::filesystem::file_size(path_, error);
  if (error) fail("cannot be read (" + error.message() + ")", "Try again, or copy it to another disk");
}

void file_bytes::read(std::uint64_t offset, std::span<char> bytes) const {
  if (offset > size_ || bytes.size() > size_ - offset) fail_truncated();
  errno = 0;
  if (handle_->read(offset, bytes)) return;
  if (errno == 0) fail_truncated();
  fail("cannot be read (" + std::generic_category().message(errno) + ")",
       "Try again, or copy it to another disk");
}

void file_bytes::fail(std::string_view problem, std::string_view remedy) const {
  throw file_error(path_, problem, remedy);
}

void file_bytes::fail_truncated() const {
  fail("ends before all the data that its header announces",
       "It is probably truncated: copy or export it again");
}

void copy_bytes(const file_bytes& file, std::uint64_t begin, std::uint64_t end, std::ostream& out) {
  constexpr std::uint64_t block = 1 << 20;
  std::vector<char> bytes;
  for (; begin < end && out; begin += bytes.size()) {
    bytes.resize(static_cast<std::size_t>(std::min(block, end - begin)));
    file.read(begin, bytes);
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }
}

}  // namespace globalmatch::support
