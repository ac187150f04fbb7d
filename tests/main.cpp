#define CATCH_CONFIG_RUNNER
#include "catch.hpp"

int main(int argc, char** argv) {
  Catch::Session session;
  // A name that matches no test is a failure. CTest splits names at an unpaired bracket or a semicolon, and
  // what it then asks for would otherwise pass.
#if __has_include(<catch2/catch_all.hpp>)
  session.configData().warnings = Catch::WarnAbout::UnmatchedTestSpec;
#else
  session.configData().warnings = Catch::WarnAbout::NoTests;
#endif
  return session.run(argc, argv);
}
