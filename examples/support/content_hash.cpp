#include "support/content_hash.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iomanip>
#include <istream>
#include <optional>
#include <sstream>
#include <system_error>
#include <vector>

#include "support/atomic_file.hpp"
#include "support/file_error.hpp"

namespace globalmatch::support {

namespace fs = std::filesystem;

namespace {

/// splitmix64 (Steele, Lea and Flood 2014, OOPSLA), of which each bit depends on all.
std::uint64_t mixed(std::uint64_t v) {
  v = (v ^ (v >> 30)) * 0xbf58476d1ce4e5b9u;
  v = (v ^ (v >> 27)) * 0x94d049bb133111ebu;
  return v ^ (v >> 31);
}

std::string hexadecimal(std::uint64_t hash) {
  std::ostringstream text;
  text << std::hex << std::setw(16) << std::setfill('0') << hash;
  return text.str();
}

std::string hash_of(std::istream& in) {
  constexpr std::uint64_t step = 0x9e3779b97f4a7c15u;
  std::vector<char> block(std::size_t(1) << 20);
  std::uint64_t hash = step, size = 0;
  while (in.read(block.data(), std::streamsize(block.size())), in.gcount() > 0) {
    const auto count = std::size_t(in.gcount());
    size += count;
    std::fill(block.begin() + std::ptrdiff_t(count), block.begin() + std::ptrdiff_t((count + 7) / 8 * 8),
              '\0');
    for (std::size_t i = 0; i < count; i += 8) {
      std::uint64_t word = 0;
      std::memcpy(&word, block.data() + i, 8);
      hash = mixed(hash + step + word);
    }
  }
  return hexadecimal(mixed(hash + size));
}

std::string hash_of_file(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw file_error(file, "cannot be opened", "Does it exist, and may it be read?");
  const std::string hash = hash_of(in);
  if (in.bad()) throw file_error(file, "cannot be read", "Is the disk or the network at fault?");
  return hash;
}

/// What tells whether a file is as it was: its name, size and time. Nothing where it was written just now: it
/// may be written again without another time.
std::optional<std::string> describe_state(const fs::path& file) {
  constexpr auto min_age = std::chrono::seconds(5);
  std::error_code absent, other;
  const auto size = fs::file_size(file, absent);
  const auto written = fs::last_write_time(file, other);
  if (absent || other || fs::file_time_type::clock::now() - written < min_age) return std::nullopt;
  return fs::weakly_canonical(file).string() + "\n" + std::to_string(size) + "\n" +
         std::to_string(static_cast<std::int64_t>(written.time_since_epoch().count())) + "\n";
}

}  // namespace

std::string text_hash(const std::string& text) {
  std::istringstream in(text);
  return hash_of(in);
}

std::string content_hash(const fs::path& file) {
  std::error_code absent;
  if (!fs::is_directory(file, absent)) return hash_of_file(file);
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(file, absent))
    if (entry.is_regular_file(absent)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::string all;
  for (const fs::path& part : files) all += part.filename().string() + "\n" + hash_of_file(part) + "\n";
  return text_hash(all);
}

hash_notes::hash_notes(const fs::path& folder) : folder_(folder) {
  make_folder(folder);
}

std::string hash_notes::hash_of(const fs::path& file) const {
  const auto state = folder_.empty() ? std::nullopt : describe_state(file);
  if (!state) return content_hash(file);
  const fs::path path = folder_ / text_hash(fs::weakly_canonical(file).string());
  constexpr std::size_t digits = 16;
  std::ostringstream noted;
  noted << std::ifstream(path, std::ios::binary).rdbuf();
  const std::string note = noted.str();
  if (note.size() == state->size() + digits && note.starts_with(*state)) return note.substr(state->size());
  const std::string hash = content_hash(file);
  if (describe_state(file) != state) return hash;  // it was written meanwhile
  atomic_file out(path);
  out.stream() << *state << hash;
  out.commit();
  return hash;
}

}  // namespace globalmatch::support
