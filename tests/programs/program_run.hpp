// Runs the example programs, as their users do.
#pragma once

#include <cstdlib>
#include <string>

#include "support/temporary_directory.hpp"

namespace globalmatch::support {

struct run {
  int status;
  std::string complaint;  ///< what it said on standard error
};

/// In the directory, where standard output goes to stdout.log; `folder` holds the program.
inline run call_in(const std::string& folder, const temporary_directory& directory,
                   const std::string& program, const std::string& arguments) {
  const std::string log = (directory / "stderr.log").string();
  const std::string command = "cd \"" + directory.path().string() + "\" && \"" + folder + "/" + program +
                              "\" " + arguments + " > stdout.log 2> \"" + log + "\"";
  const int raw = std::system(command.c_str());
#ifdef WEXITSTATUS
  const int status = WIFEXITED(raw) ? WEXITSTATUS(raw) : -1;
#else
  const int status = raw;
#endif
  return {status, bytes_of(log)};
}

/// One of the example programs.
inline run call(const temporary_directory& directory, const std::string& program,
                const std::string& arguments) {
  return call_in(GLOBALMATCH_PROGRAMS, directory, program, arguments);
}

}  // namespace globalmatch::support
