#include "support/programs/run_record.hpp"

#include "support/build_record.hpp"

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

}  // namespace

json describe_run(const CLI::App& app, const std::vector<std::string>& command, stage_clock& clock) {
  const build_record build = this_build();
  json options = json::object();
  for (const CLI::Option* option : app.get_options())
    if (const std::string name = option->get_single_name(); name != "help") options[name] = value_of(*option);
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
