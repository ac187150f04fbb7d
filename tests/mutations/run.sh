#!/usr/bin/env bash
# Mutates headers one by one and runs the tests that must notice: see run.py.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
source cmake/setup.sh
configure_release >/dev/null
cmake --build build/release --target globalmatch_support >/dev/null
exec python3 tests/mutations/run.py "$@"
