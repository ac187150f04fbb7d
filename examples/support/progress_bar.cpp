#include "support/progress_bar.hpp"

#include <algorithm>
#include <iostream>
#include <string>

#ifdef _WIN32
#include <io.h>
#else
#include <unistd.h>
#endif

namespace globalmatch::support {

namespace {

bool is_terminal() {
#ifdef _WIN32
  return _isatty(_fileno(stderr)) != 0;
#else
  return isatty(STDERR_FILENO) == 1;
#endif
}

constexpr std::size_t width = 30, line_length = 72;
constexpr std::chrono::milliseconds between(100);

}  // namespace

progress_bar::progress_bar() : out_(is_terminal() ? &std::cerr : nullptr) {}

progress_bar::progress_bar(std::ostream& out) : out_(&out) {}

void progress_bar::show(const progress& p) {
  const auto now = clock::now();
  if (!out_ || (is_drawn_ && now - drawn_ < between)) return;
  const double share = std::clamp(p.fraction, 0.0, 1.0);
  const auto done = std::size_t(share * double(width));
  std::string line = '[' + std::string(done, '=') + std::string(width - done, ' ') + "] " +
                     std::to_string(int(100 * share)) + " % " + std::string(p.stage);
  line.resize(line_length, ' ');
  *out_ << '\r' << line << std::flush;
  drawn_ = now;
  is_drawn_ = true;
}

void progress_bar::clear() {
  if (!is_drawn_) return;
  *out_ << '\r' << std::string(line_length, ' ') << '\r' << std::flush;
  is_drawn_ = false;
}

}  // namespace globalmatch::support
