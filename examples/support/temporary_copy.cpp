#include "support/temporary_copy.hpp"

#include <cstddef>
#include <memory>
#include <random>
#include <string>
#include <system_error>

#include "support/file_error.hpp"

#ifdef _WIN32
#include <fcntl.h>
#include <io.h>
#endif

namespace globalmatch::support {

namespace fs = std::filesystem;

namespace {

struct file_closer {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using open_file = std::unique_ptr<std::FILE, file_closer>;

// Windows changes line ends in streams of text, which standard input is at first.
void make_binary([[maybe_unused]] std::FILE* stream) {
#ifdef _WIN32
  _setmode(_fileno(stream), _O_BINARY);
#endif
}

// A new file that nobody else can read.
open_file create(const fs::path& path) {
  open_file file(std::fopen(path.string().c_str(), "wbx"));
  std::error_code ignored;
  if (file) fs::permissions(path, fs::perms::owner_read | fs::perms::owner_write, ignored);
  return file;
}

// Copies to the end. Whether all could be written.
bool copy_all(std::FILE* from, std::FILE* to) {
  constexpr std::size_t block_size = std::size_t(1) << 20;
  const auto block = std::make_unique_for_overwrite<char[]>(block_size);
  while (const std::size_t count = std::fread(block.get(), 1, block_size, from))
    if (std::fwrite(block.get(), 1, count, to) != count) return false;
  return std::fflush(to) == 0;
}

}  // namespace

temporary_copy::temporary_copy(std::FILE* from, std::string_view name) {
  std::error_code error;
  const fs::path folder = fs::temp_directory_path(error);
  const auto fail = [&, label = fs::path(name)](const std::string& problem) {
    throw file_error(label, problem, "Free space there, or name another folder in TMPDIR");
  };
  const fs::path path = folder / ("globalmatch_" + std::to_string(std::random_device()()) + ".part");
  const open_file to = error ? open_file() : create(path);
  if (!to) fail("needs a copy on disk, and the folder for temporary files cannot be written");
  path_ = path;
  make_binary(from);
  const bool is_written = copy_all(from, to.get());
  const bool is_read = !std::ferror(from);
  if (is_written && is_read) return;
  remove();
  if (is_read) fail("could not be copied to " + folder.string());
  throw file_error(fs::path(name), "cannot be read to its end", "Check the program that it comes from");
}

void temporary_copy::remove() noexcept {
  std::error_code ignored;
  if (!path_.empty() && fs::remove(path_, ignored)) path_.clear();
}

}  // namespace globalmatch::support
