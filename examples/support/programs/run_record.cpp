#include "support/programs/run_record.hpp"

#include <cstdint>
#include <system_error>

#include "support/build_record.hpp"
#include "support/content_hash.hpp"
#include "support/file_error.hpp"
#include "support/numbered_scans.hpp"

namespace globalmatch::support {

using json = nlohmann::ordered_json;

namespace {

json text_or_null(const std::string& text) {
  return text.empty() ? json(nullptr) : json(text);
}

/// One value or several, as text.
json value_of(const CLI::Option& option) {
  if (option.count() == 0) return text_or_null(option.get_default_str());
  return option.results().size() == 1 ? json(option.results().front()) : json(option.results());
}

namespace fs = std::filesystem;

std::uintmax_t bytes_of(const fs::path& path) {
  std::error_code ignored;
  if (!fs::is_directory(path, ignored)) return fs::file_size(path, ignored);
  std::uintmax_t bytes = 0;
  for (const auto& entry : fs::directory_iterator(path, ignored))
    if (entry.is_regular_file(ignored)) bytes += entry.file_size(ignored);
  return bytes;
}

}  // namespace

json describe_files(const std::vector<fs::path>& files) {
  json described = json::array();
  for (const fs::path& file : files) {
    json bytes, hash;
    std::error_code absent;
    const fs::path path = parse_scan_name(file).path;
    if (fs::is_regular_file(path, absent) || fs::is_directory(path, absent)) try {
        hash = content_hash(path);
        bytes = bytes_of(path);
      } catch (const file_error&) {  // it was there when it was read
      }
    described.push_back({{"path", file.string()}, {"bytes", bytes}, {"hash", hash}});
  }
  return described;
}

json describe_run(const CLI::App& app, const std::vector<std::string>& command, stage_clock& clock) {
  const build_record build = this_build();
  json options = json::object();
  for (const CLI::Option* option : app.get_options())
    if (const std::string name = option->get_single_name(); name != "help" && name != "version")
      options[name] = value_of(*option);
  return {{"seconds", clock.seconds()},
          {"stages", clock.stages()},
          {"globalmatch",
           {{"version", build.version},
            {"commit", text_or_null(build.commit)},
            {"compiler", text_or_null(build.compiler)},
            {"processor", instruction_set()}}},
          {"command", command},
          {"options", options}};
}

}  // namespace globalmatch::support
