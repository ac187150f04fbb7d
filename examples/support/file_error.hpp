// What is wrong with a file, where, and what would help.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

namespace globalmatch::support {

/// A file that cannot be read or written. The message says where, what is wrong, and what would help.
/// Programs print it and exit with status 2.
struct file_error : std::runtime_error {
  file_error(const std::filesystem::path& path, std::string_view problem, std::string_view remedy)
      : std::runtime_error(path.string() + ": " + std::string(problem) + ". " + std::string(remedy)) {}
};

}  // namespace globalmatch::support
