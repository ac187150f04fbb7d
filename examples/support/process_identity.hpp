// Who writes a file in a folder that several processes and machines share.
#pragma once

#include <string>

namespace globalmatch::support {

struct process_identity {
  std::string host;
  long process = 0;

  static process_identity own();
  friend bool operator==(const process_identity&, const process_identity&) = default;
};

/// Whether a process is known to have ended: one of this host that is not there any more.
bool has_ended(const process_identity& other);

}  // namespace globalmatch::support
