#include "support/atomic_file.hpp"

#include <chrono>
#include <cstdlib>
#include <limits>
#include <locale>
#include <random>
#include <string>
#include <system_error>

#include "support/file_error.hpp"
#include "support/process_identity.hpp"

namespace globalmatch::support {

namespace fs = std::filesystem;

namespace {

// Renaming onto a link would replace the link instead of the file it stands for.
fs::path behind_links(const fs::path& path) {
  std::error_code ignored;
  return fs::is_symlink(path, ignored) ? fs::weakly_canonical(path) : path;
}

constexpr const char* temporary_extension = ".part";

/// What the names of temporary files of this host have between that of the file and the process.
std::string host_mark() {
  return std::string(".").append(process_identity::own().host).append("-");
}

fs::path temporary_sibling(const fs::path& path) {
  std::random_device random;
  fs::path sibling = path;
  sibling += host_mark() + std::to_string(process_identity::own().process) + "-" + std::to_string(random()) +
             temporary_extension;
  return sibling;
}

/// Whether nobody goes on writing a temporary file.
bool is_abandoned(const fs::path& file) {
  const std::string name = file.filename().string(), mark = host_mark();
  if (const std::size_t at = name.rfind(mark); at != std::string::npos) {
    const long process = std::strtol(name.c_str() + at + mark.size(), nullptr, 10);
    return has_ended({process_identity::own().host, process});
  }
  std::error_code absent;
  const auto written = fs::last_write_time(file, absent);
  return !absent && fs::file_time_type::clock::now() - written > std::chrono::hours(24);
}

bool is_device(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(path, ignored) && fs::is_other(path, ignored);
}

}  // namespace

atomic_file::atomic_file(const fs::path& path) : path_(is_device(path) ? path : behind_links(path)) {
  if (fs::is_directory(path_)) throw file_error(path, "is a directory", "Name a file to write");
  const fs::path directory = path_.has_parent_path() ? path_.parent_path() : fs::path(".");
  if (!fs::is_directory(directory))
    throw file_error(path, "its directory " + directory.string() + " does not exist",
                     "Create it first: mkdir -p " + directory.string());

  written_ = is_device(path_) ? path_ : temporary_sibling(path_);
  stream_.open(written_, std::ios::binary);
  if (!stream_)
    throw file_error(path, "cannot be written in " + directory.string(),
                     "Check the permissions of that directory, or write to another one");
  stream_.imbue(std::locale::classic());
  stream_.precision(std::numeric_limits<double>::max_digits10);
}

atomic_file::~atomic_file() {
  if (written_.empty() || written_ == path_) return;
  stream_.close();
  std::error_code ignored;
  fs::remove(written_, ignored);
}

void atomic_file::require_good() const {
  if (!stream_)
    throw file_error(path_, "could not be written to its end", "Check the free space of the disk");
}

void atomic_file::commit() {
  stream_.close();
  require_good();
  std::error_code error;
  if (written_ != path_) fs::rename(written_, path_, error);
  if (error)
    throw file_error(path_, "could not be replaced: " + error.message(),
                     "Check the permissions of the file and its directory");
  written_.clear();
}

void require_writable(std::initializer_list<fs::path> paths) {
  for (const fs::path& path : paths)
    if (!path.empty()) atomic_file trial(path);
}

void remove_abandoned(const fs::path& folder) {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored))
    if (entry.path().extension() == temporary_extension && is_abandoned(entry.path()))
      fs::remove(entry.path(), ignored);
}

void make_folder(const fs::path& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error)
    throw file_error(path, "the folder cannot be made: " + error.message(), "Name one that can be written");
}

}  // namespace globalmatch::support
