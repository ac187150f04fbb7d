#include "support/process_identity.hpp"

#if defined(_WIN32)
#include <process.h>

#include <cstdlib>
#else
#include <signal.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#endif

namespace globalmatch::support {

#if defined(_WIN32)

process_identity process_identity::own() {
  const char* name = std::getenv("COMPUTERNAME");
  return {name ? name : "", _getpid()};
}

bool has_ended(const process_identity&) {
  return false;  // which is not asked here; others find out by time
}

#else

process_identity process_identity::own() {
  std::array<char, 256> name{};
  if (gethostname(name.data(), name.size() - 1) != 0) name.front() = '\0';
  return {name.data(), long(getpid())};
}

bool has_ended(const process_identity& other) {
  return other.host == process_identity::own().host && other.process > 0 &&
         kill(pid_t(other.process), 0) != 0 && errno == ESRCH;
}

#endif

}  // namespace globalmatch::support
