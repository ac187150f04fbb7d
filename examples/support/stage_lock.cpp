#include "support/stage_lock.hpp"

#include <cerrno>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <iostream>
#include <memory>
#include <optional>
#include <random>
#include <sstream>
#include <system_error>

#if defined(_WIN32)
#include <fcntl.h>
#include <io.h>
#include <sys/stat.h>
#endif

#include "support/file_error.hpp"
#include "support/process_identity.hpp"

namespace globalmatch::support {

namespace fs = std::filesystem;

namespace {

/// Host, process, start, and a number that tells two locks of one process apart: a line each.
std::string describe_owner() {
  const process_identity own = process_identity::own();
  const std::time_t now = std::time(nullptr);
  char start[32] = "";
  std::strftime(start, sizeof(start), "%Y-%m-%dT%H:%M:%SZ", std::gmtime(&now));
  return own.host + "\n" + std::to_string(own.process) + "\n" + start + "\n" +
         std::to_string(std::random_device()()) + "\n";
}

/// A file that was not there, open for writing; null where it was, or where it cannot be made. The mode "x" of
/// `std::fopen` is one that not every library on Windows knows.
std::FILE* open_new(const fs::path& file) {
#if defined(_WIN32)
  const int descriptor =
      _wopen(file.c_str(), _O_CREAT | _O_EXCL | _O_WRONLY | _O_BINARY, _S_IREAD | _S_IWRITE);
  return descriptor < 0 ? nullptr : _fdopen(descriptor, "wb");
#else
  return std::fopen(file.c_str(), "wbx");
#endif
}

/// Nothing where there is no file.
std::optional<std::string> content_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return std::nullopt;
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

struct described_owner {
  process_identity who;
  std::string start;

  explicit described_owner(const std::string& content) {
    std::istringstream in(content);
    std::string process;
    std::getline(in, who.host);
    if (!(in >> who.process >> start)) *this = {};
  }
  described_owner() = default;
};

}  // namespace

stage_lock::stage_lock(const fs::path& file, const timing& times)
    : file_(file), times_(times), owner_(describe_owner()) {
  while (!create()) wait_for_other();
  heart_ = std::thread([this] { beat(); });
}

stage_lock::~stage_lock() {
  {
    const std::lock_guard guard(mutex_);
    is_done_ = true;
  }
  ended_.notify_all();
  heart_.join();
  std::error_code ignored;
  if (is_own()) fs::remove(file_, ignored);
}

bool stage_lock::create() const {
  const auto close = [](std::FILE* f) { std::fclose(f); };
  const std::unique_ptr<std::FILE, decltype(close)> created(open_new(file_), close);
  if (created) return std::fputs(owner_.c_str(), created.get()) >= 0;
  if (errno == EEXIST) return false;
  throw file_error(file_, "cannot be written", "Check the permissions of its directory");
}

void stage_lock::wait_for_other() const {
  using clock = std::chrono::steady_clock;
  auto seen = content_of(file_);
  auto changed = clock::now();
  for (bool said = false; seen; said = true) {
    const described_owner owner(*seen);
    if (has_ended(owner.who) || clock::now() - changed >= times_.stale) {
      std::error_code ignored;
      fs::remove(file_, ignored);
      return;
    }
    if (!said)
      std::cerr << file_.string() << ": waits for process " << owner.who.process << " on " << owner.who.host
                << ", at work since " << owner.start << '\n';
    std::this_thread::sleep_for(times_.poll);
    auto now = content_of(file_);
    if (now != seen) changed = clock::now();
    seen = std::move(now);
  }
}

bool stage_lock::is_own() const {
  const auto content = content_of(file_);
  return content && content->starts_with(owner_);
}

void stage_lock::beat() {
  std::unique_lock guard(mutex_);
  for (std::size_t count = 1;; ++count) {
    if (ended_.wait_for(guard, times_.heartbeat, [this] { return is_done_; })) return;
    if (!is_own()) return;  // somebody took it for stale
    std::ofstream(file_, std::ios::binary) << owner_ << count << '\n';
  }
}

}  // namespace globalmatch::support
