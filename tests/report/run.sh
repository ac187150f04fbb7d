#!/usr/bin/env bash
# Makes four reports of simulated scans (good, ambiguous, failed, a survey) and looks at them in Chromium: errors,
# accessibility, the 3-D view, the page without JavaScript. Screenshots are left in build/report.
# usage: tests/report/run.sh [BUILD]      the build tree, build/release; it is set to GLOBALMATCH_REPORT_3D
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
build=${1:-build/release}
out=$PWD/build/report

for command in npm chromium; do
  command -v "$command" >/dev/null || { echo "$command is missing" >&2 && exit 2; }
done
cmake -S . -B "$build" -DGLOBALMATCH_REPORT_3D=ON >/dev/null
cmake --build "$build" --target simulate_plot register_scans register_survey >/dev/null
programs=$PWD/$build/examples

mkdir -p "$out/browser"
cp tests/report/package.json tests/report/check_reports.mjs "$out/browser"
npm install --silent --no-audit --no-fund --no-package-lock --prefix "$out/browser"

# status EXPECTED COMMAND...
status() {
  local expected=$1 found=0
  shift
  "$@" >>log.txt 2>&1 || found=$?
  [ "$found" -eq "$expected" ] || { echo "status $found, not $expected: $*" >&2 && exit 1; }
}
cd "$out"
: >log.txt
status 0 "$programs/simulate_plot" forest --stations 4 --angular-step 0.15 --seed 5
status 0 "$programs/simulate_plot" elsewhere --stations 1 --angular-step 0.15 --seed 77
status 0 "$programs/simulate_plot" rows --layout rows --missing 0 --row-jitter 0 --lean 0 --width 60 --depth 60 \
  --station-distance 24 --angular-step 0.25 --seed 3
mkdir -p survey_scans
cp forest/scan_[1-4].ply survey_scans
cp elsewhere/scan_1.ply survey_scans/elsewhere.ply

status 0 "$programs/register_scans" forest/scan_2.ply forest/scan_1.ply --out T.txt --report good.html --json good.json
status 1 "$programs/register_scans" rows/scan_2.ply rows/scan_1.ply --out T.txt --report ambiguous.html \
  --json ambiguous.json
status 1 "$programs/register_scans" elsewhere/scan_1.ply forest/scan_1.ply --out T.txt --report failed.html \
  --json failed.json
status 1 "$programs/register_survey" survey_scans --out-dir survey --report survey.html --json survey.json
CHROMIUM=$(command -v chromium) node browser/check_reports.mjs "$out"
