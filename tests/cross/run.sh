#!/usr/bin/env bash
# Builds the core tests for another machine with a compiler of Debian's, and runs them: aarch64 under qemu
# (packages g++-aarch64-linux-gnu, qemu-user), Windows under wine (g++-mingw-w64-x86-64-posix, wine64).
# usage: tests/cross/run.sh aarch64|mingw [ARGUMENT...]      arguments of the test program, e.g. the name of a test
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
source cmake/setup.sh

machine=${1:-} && shift
case "$machine" in
  aarch64)
    compiler=aarch64-linux-gnu-g++
    flags=(-pthread)
    emulator=(qemu-aarch64 -L /usr/aarch64-linux-gnu)
    ;;
  mingw)
    compiler=x86_64-w64-mingw32-g++-posix
    flags=(-static "-Wa,-mbig-obj")
    emulator=(env WINEDEBUG=-all WINEPREFIX="$PWD/build/mingw/wine" "$(command -v wine64 || echo /usr/lib/wine/wine64)")
    ;;
  *) sed -n '2,4s/^# //p' "${BASH_SOURCE[0]}" >&2 && exit 2 ;;
esac

# The libraries have headers alone, which serve every machine; beside them in /usr/include lie this one's.
folder=build/$machine
rm -rf "$folder"
mkdir -p "$folder/include"
for header in eigen3/Eigen nanoflann.hpp catch2 CLI nlohmann; do
  ln -sfn "/usr/include/$header" "$folder/include/$(basename "$header")"
done

# What needs the simulator, calls the programs or reads E57 (for which pugixml has code to link) is left out;
# reading and writing other files is tested, too. Most sources are compiled several at a time, as CMake does.
alone=(src/*.cpp tests/main.cpp tests/test_points.cpp examples/support/build_record.cpp
  examples/support/laz_chunk_decoder.cpp)
printf '%s\n' tests/test_*.cpp tests/support/test_*.cpp examples/support/*.cpp \
  examples/support/{programs,report}/*.cpp |
  grep -v -e /test_e57 -e /test_posed_copies | grep -vxF "$(printf '%s\n' "${alone[@]}")" |
  awk -v folder="$folder" '{ print "#include \"" ENVIRON["PWD"] "/" $0 "\"" > (folder "/several_" int(NR / 12) ".cpp") }'
touch "$folder/no_view.js"
cmake -D source="$folder/embedded_files.cpp" -D report_style=examples/report/style.css \
  -D report_script="$folder/no_view.js" -P examples/report/embed.cmake
sources=("${alone[@]}" "$folder/embedded_files.cpp" "$folder"/several_*.cpp)
compile=("$compiler" -std=c++20 -O1 "${flags[@]}" -DGLOBALMATCH_COMPILED -DGLOBALMATCH_WITHOUT_PUGIXML
  -I include -I tests -I examples -I benchmarks -isystem "$folder/include"
  -DGLOBALMATCH_VERSION="\"$(sed -n 's/^ *VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt | head -1)\""
  -DGLOBALMATCH_SHARED_DATA="\"$PWD/../shared/data\"" -DGLOBALMATCH_TEST_DATA="\"$PWD/tests/support/data\"")
# shellcheck disable=SC2016
printf '%s\0' "${sources[@]}" | xargs -0 -n 1 -P "$CMAKE_BUILD_PARALLEL_LEVEL" \
  bash -c '"${@:2:$#-2}" -c "${@: -1}" -o "$1/$(tr / _ <<<"${@: -1}").o"' - "$folder" "${compile[@]}"
"$compiler" "${flags[@]}" "$folder"/*.o -o "$folder/tests.exe"
"${emulator[@]}" "$folder/tests.exe" "${@:-~[slow]}"
