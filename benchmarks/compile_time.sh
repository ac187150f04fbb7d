#!/usr/bin/env bash
# What it costs to include the library: CPU seconds and memory to compile each public header, each example,
# and a file that calls the verbs, cold, as a ratio to the yardstick: <Eigen/Dense> and one product of two
# Eigen::Isometry3d. Yardstick and file are compiled in turn; the best of the runs counts.
# usage: benchmarks/compile_time.sh [--check] [--runs N] [NAME...]
#   --check   only what docs/architecture.md sets a limit for; exit status 1 where it is exceeded
#   NAME      only these: a header (points), an example (01_quick_start) or a call (register_scans, in the
#             compiled mode; register_scans_header_only)
# CXX and CXXFLAGS choose the compiler (g++ -O2) and further flags.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

runs=3 check=false names=()
while [ $# -gt 0 ]; do
  case "$1" in
    --check) check=true ;;
    --runs) runs=$2 && shift ;;
    -*) sed -n '2,10s/^# //p' "$0" >&2 && exit 2 ;;
    *) names+=("$1") ;;
  esac
  shift
done

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
read -ra compiler <<<"${CXX:-g++} -std=c++20 -O2 ${CXXFLAGS:-} -Iinclude -Iexamples -isystem ${EIGEN_INCLUDE:-/usr/include/eigen3}"

cat >"$folder/yardstick.cpp" <<'SOURCE'
#include <Eigen/Dense>
Eigen::Isometry3d product(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) { return a * b; }
SOURCE
cat >"$folder/register_scans.cpp" <<'SOURCE'
#include <globalmatch/registration.hpp>
#include <vector>
struct point { float x, y, z; };
auto call(const std::vector<point>& a, const std::vector<point>& b) { return globalmatch::register_scans(a, b); }
SOURCE
cat >"$folder/match_stems.cpp" <<'SOURCE'
#include <globalmatch/stem_matching.hpp>
#include <vector>
struct point { double x, y, z; };
auto call(const std::vector<point>& a, const std::vector<point>& b) { return globalmatch::match_stems(a, b); }
SOURCE

# Prints user + system seconds of one compilation, without the compiler's own words.
compile() {
  bash -c 'TIMEFORMAT="%U %S"; time "$@" 2>/dev/null' - "${compiler[@]}" -c "$1" -o "$folder/out.o" 2>&1 |
    awk '{print $1 + $2}'
}
# Prints the peak kilobytes of one; stops where the file does not compile.
memory() {
  python3 - "${compiler[@]}" -c "$1" -o "$folder/out.o" <<'PYTHON'
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
PYTHON
}

# Limits of docs/architecture.md: ratio to the yardstick, and gigabytes.
limit_of() {
  case "$1" in
    register_scans_header_only) echo 16.5 0.95 ;;
    match_stems_header_only) echo 8.5 0.6 ;;
    register_scans) echo 6 0.7 ;; # compiled mode
    match_stems) echo 3 0.45 ;;   # likewise
    points | execution) echo 0.5 0.45 ;;
  esac
}

sources=()
for verb in register_scans match_stems; do
  mv "$folder/$verb.cpp" "$folder/${verb}_header_only.cpp"
  { echo '#define GLOBALMATCH_COMPILED' && cat "$folder/${verb}_header_only.cpp"; } >"$folder/$verb.cpp"
  sources+=("${verb}_header_only $folder/${verb}_header_only.cpp" "$verb $folder/$verb.cpp")
done
for header in include/globalmatch/*.hpp; do
  name=$(basename "$header" .hpp)
  echo "#include <globalmatch/$name.hpp>" >"$folder/header_$name.cpp"
  sources+=("$name $folder/header_$name.cpp")
done
for example in examples/0*.cpp; do sources+=("$(basename "$example" .cpp) $example"); done

status=0
printf '%-20s %8s %8s %10s %6s\n' what seconds ratio megabytes limit
for entry in "${sources[@]}"; do
  name=${entry%% *} source=${entry##* }
  limit=$(limit_of "$name")
  if $check && [ -z "$limit" ]; then continue; fi
  if [ ${#names[@]} -gt 0 ] && ! printf '%s\n' "${names[@]}" | grep -qx "$name"; then continue; fi
  kilobytes=$(memory "$source")
  yard=() own=()
  for ((run = 0; run < runs; ++run)); do
    yard+=("$(compile "$folder/yardstick.cpp")")
    own+=("$(compile "$source")")
  done
  best() { printf '%s\n' "$@" | sort -g | head -1; }
  row=$(awk -v name="$name" -v own="$(best "${own[@]}")" -v yard="$(best "${yard[@]}")" -v kb="$kilobytes" -v limit="$limit" '
    BEGIN { split(limit, l, " "); ratio = own / yard
      printf "%-20s %8.2f %8.2f %10.0f %6s%s\n", name, own, ratio, kb / 1024, l[1],
        (limit != "" && (ratio > l[1] || kb / 1048576 > l[2]) ? "  exceeded" : "") }')
  echo "$row"
  if [[ $row == *exceeded ]]; then status=1; fi
done
if $check; then exit $status; fi
