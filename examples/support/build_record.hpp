// Which build of the programs this is: results of others may differ in their last bits.
#pragma once

#include <filesystem>
#include <string>

namespace globalmatch::support {

struct build_record {
  std::string version;   ///< of globalmatch
  std::string commit;    ///< that was configured; empty where there is no repository
  std::string compiler;  ///< with version

  /// All three, for files and messages.
  std::string name() const;
};

build_record this_build();

/// What the compiler was allowed to use: results of other instruction sets differ in their last bits.
std::string instruction_set();

/// Throws `file_error`, which names both, for a file that another build or instruction set has made.
void require_this_build(const std::filesystem::path& file, const std::string& build,
                        const std::string& processor);

}  // namespace globalmatch::support
