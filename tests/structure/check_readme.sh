#!/usr/bin/env bash
# The first snippet of README.md is examples/01_quick_start.cpp, and each of its C++ snippets compiles with the
# line that the README gives, which leaves the first one at the path that is given here.
# usage: tests/structure/check_readme.sh PROGRAM
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
awk -v folder="$folder" '/^```/ { inside = $0 == "```cpp"; count += inside; next }
                         inside { print > (folder "/" count ".cpp") }' README.md
diff examples/01_quick_start.cpp "$folder/1.cpp"

line='g++ -std=c++20 -O2 -pthread -I include -I /usr/include/eigen3'
grep -qF "$line" README.md || { echo "README.md does not say: $line" >&2 && exit 1; }
read -ra compile <<<"$line"
"${compile[@]}" "$folder/1.cpp" -o "$1"
for snippet in "$folder"/*.cpp; do
  [ "$snippet" = "$folder/1.cpp" ] || "${compile[@]}" -fsyntax-only "$snippet"
done
