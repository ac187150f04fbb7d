#!/usr/bin/env bash
# Simulates two scans of a forest plot, registers them, and compares the result with the truth. Installs what
# is missing first.
# usage: examples/run.sh [--brief]      --brief: coarser scans, for a quick look
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source cmake/setup.sh

plot=(--stations 2 --seed 1)
case "${1:-}" in
  "") ;;
  --brief) plot+=(--angular-step 0.2) ;;
  *)
    echo "usage: examples/run.sh [--brief]" >&2
    exit 2
    ;;
esac

install_missing
configure_release
targets=$(cmake --build build/release --target help)
if ! grep -q simulate_plot <<<"$targets"; then
  echo "The demo simulates its scans with Embree 3 or 4, which CMake did not find: please install it." >&2
  exit 2
fi
cmake --build build/release --target \
  simulate_plot scan_info map_stems match_stems register_scans register_survey evaluate_registration
programs=$PWD/build/release/examples

mkdir -p build/demo
cd build/demo
echo "Simulating two scans ..."
"$programs/simulate_plot" . "${plot[@]}"
echo "Registering scan_2 with scan_1 ..."
"$programs/register_scans" scan_2.ply scan_1.ply \
  --out T.txt --write merged.ply --report report.html --json registration.json
echo "Errors against the truth:"
"$programs/evaluate_registration" T.txt --source-pose pose_2.txt --target-pose pose_1.txt --scan scan_2.ply

cat <<TXT
In $PWD:
  T.txt              the transform from scan_2 to scan_1
  merged.ply         both scans in the frame of scan_1, one colour each
  report.html        whether to trust it, and both stem maps before and after: open it in a browser
  registration.json  counts and times
TXT
