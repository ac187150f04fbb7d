#include "support/build_record.hpp"

#include "support/file_error.hpp"

namespace globalmatch::support {

std::string build_record::name() const {
  return version + (commit.empty() ? "" : ", commit " + commit) + ", " + compiler;
}

build_record this_build() {
  build_record build;
  build.version = GLOBALMATCH_VERSION;
#if defined(GLOBALMATCH_COMMIT)
  build.commit = GLOBALMATCH_COMMIT;
#endif
#if defined(__clang__)
  build.compiler = "Clang " __clang_version__;
#elif defined(__GNUC__)
  build.compiler = "GCC " __VERSION__;
#elif defined(_MSC_VER)
  build.compiler = "MSVC " + std::to_string(_MSC_FULL_VER);
#endif
  return build;
}

std::string instruction_set() {
  std::string name = sizeof(void*) == 8 ? "64 bits" : "32 bits";
#if defined(__AVX512F__)
  name += ", AVX-512";
#elif defined(__AVX2__)
  name += ", AVX2";
#elif defined(__AVX__)
  name += ", AVX";
#endif
#if defined(__FMA__)
  name += ", FMA";
#endif
#if defined(__aarch64__)
  name += ", aarch64";
#endif
  return name;
}

void require_this_build(const std::filesystem::path& file, const std::string& build,
                        const std::string& processor) {
  const std::string other = build + " (" + processor + ")",
                    own = this_build().name() + " (" + instruction_set() + ")";
  if (other != own)
    throw file_error(file, "was made by " + other + ", and this is " + own + ": results may differ",
                     "Use one build on processors of one instruction set, or remove the file");
}

}  // namespace globalmatch::support
