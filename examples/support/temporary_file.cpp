#include "support/temporary_file.hpp"

#include <cstddef>
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

constexpr std::string_view other_folder = "Free space there, or name another folder in TMPDIR";

// Windows changes line ends in streams of text, which standard input is at first.
void make_binary([[maybe_unused]] std::FILE* stream) {
#ifdef _WIN32
  _setmode(_fileno(stream), _O_BINARY);
#endif
}

}  // namespace

temporary_file::temporary_file(std::string_view name) : name_(name) {
  std::error_code error;
  const fs::path folder = fs::temp_directory_path(error);
  const fs::path path = folder / ("globalmatch_" + std::to_string(std::random_device()()) + ".part");
  if (!error) file_.reset(std::fopen(path.string().c_str(), "wbx"));
  if (!file_)
    throw file_error(name_, "needs a copy on disk, and the folder for temporary files cannot be written",
                     other_folder);
  path_ = path;
  fs::permissions(path_, fs::perms::owner_read | fs::perms::owner_write, error);
}

std::uint64_t temporary_file::copy_from(std::FILE* stream) {
  constexpr std::size_t block_size = std::size_t(1) << 20;
  const auto block = std::make_unique_for_overwrite<char[]>(block_size);
  make_binary(stream);
  std::uint64_t copied = 0;
  bool is_written = true;
  while (const std::size_t count = std::fread(block.get(), 1, block_size, stream)) {
    is_written = std::fwrite(block.get(), 1, count, file_.get()) == count;
    if (!is_written) break;
    copied += count;
  }
  if (std::ferror(stream))
    throw file_error(name_, "cannot be read to its end", "Check the program that it comes from");
  if (!is_written || std::fflush(file_.get()) != 0)
    throw file_error(name_, "could not be copied to the folder for temporary files", other_folder);
  return copied;
}

void temporary_file::remove() noexcept {
  std::error_code ignored;
  if (!path_.empty() && fs::remove(path_, ignored)) path_.clear();
}

}  // namespace globalmatch::support
