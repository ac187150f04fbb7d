#!/usr/bin/env bash
# Installs what is missing, builds the tests and the programs that they call, and runs the tests.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source cmake/setup.sh

install_missing
configure_release
cmake --build build/release --target tests_and_programs
ctest --test-dir build/release --output-on-failure --no-tests=error --parallel "$CMAKE_BUILD_PARALLEL_LEVEL"
