// What a test of wrong arguments asks for: what the exception says.
#pragma once

#include <stdexcept>
#include <string>

namespace globalmatch::support {

/// The message of the `std::invalid_argument` that the call throws; empty when it throws none.
template <class Call>
std::string message_of(const Call& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return {};
}

}  // namespace globalmatch::support
