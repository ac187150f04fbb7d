// Figures of an evaluation, drawn by plot_dataset.py from its CSV files.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <string>

namespace globalmatch::benchmarks {

/// A word of a command for the shell.
inline std::string shell_word(const std::string& text) {
  std::string word = "'";
  for (const char c : text) word += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return word + "'";
}

/// Draws into `folder`/figures with the Python interpreter; where that or matplotlib is missing, says on
/// standard error what to install and what to run then.
inline void draw_figures(const std::string& python, const std::filesystem::path& folder) {
  const std::string script = GLOBALMATCH_PLOT_DATASET;
  if (python.empty()) {
    std::cerr << "no figures: Python 3 was not found. Install it with matplotlib (Debian: "
                 "python3-matplotlib), then run: python3 "
              << script << ' ' << folder.string() << '\n';
    return;
  }
  const std::string command =
      shell_word(python) + ' ' + shell_word(script) + ' ' + shell_word(folder.string());
  if (std::system(command.c_str()) != 0)
    std::cerr << "no figures, or not all. Install matplotlib if it is missing (Debian: python3-matplotlib), "
                 "then run: "
              << command << '\n';
}

}  // namespace globalmatch::benchmarks
