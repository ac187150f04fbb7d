// One process at a time for a stage of work in a folder that several processes and machines share. It saves
// work that is done twice; results never rest on it, as each file is written whole, and with the same bits by
// whoever writes it.
#pragma once

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>

namespace globalmatch::support {

/// A file that names host, process and start, and is written again now and then. Who finds it waits until it
/// is gone, or its process has ended, or nothing was written for some time; clocks of hosts are not compared.
class stage_lock {
 public:
  struct timing {
    std::chrono::milliseconds heartbeat = std::chrono::seconds(10), stale = std::chrono::seconds(60),
                              poll = std::chrono::milliseconds(200);
  };

  /// Waits, and says so on standard error. Throws `file_error` where the folder cannot be written.
  explicit stage_lock(const std::filesystem::path& file) : stage_lock(file, timing{}) {}
  stage_lock(const std::filesystem::path& file, const timing& times);
  ~stage_lock();
  stage_lock(const stage_lock&) = delete;
  stage_lock& operator=(const stage_lock&) = delete;

 private:
  bool create() const;
  void wait_for_other() const;
  bool is_own() const;
  void beat();

  std::filesystem::path file_;
  timing times_;
  std::string owner_;
  std::mutex mutex_;
  std::condition_variable ended_;
  bool is_done_ = false;
  std::thread heart_;
};

}  // namespace globalmatch::support
