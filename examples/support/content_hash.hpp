// Hashes of what files hold, by which scans are known again; noted, so that large files are read once.
#pragma once

#include <filesystem>
#include <string>

namespace globalmatch::support {

/// Of all bytes of a file, or of the names and bytes of all files in a folder: 64 bits as 16 hexadecimal
/// digits. Throws `file_error`.
std::string content_hash(const std::filesystem::path& file);

/// The same of a text.
std::string text_hash(const std::string& text);

/// Notes in a folder, which processes may share: a file for each file that was hashed, with its size and the
/// time at which it was written. Where both are as they were the hash is taken from there.
class hash_notes {
 public:
  hash_notes() = default;  ///< nothing is noted
  /// Makes the folder. Throws `file_error`.
  explicit hash_notes(const std::filesystem::path& folder);

  /// `content_hash`. Throws `file_error`, also where a note cannot be written.
  std::string hash_of(const std::filesystem::path& file) const;

 private:
  std::filesystem::path folder_;
};

}  // namespace globalmatch::support
