#!/usr/bin/env bash
# Installs the Python package into build/python/venv, runs its tests, and checks its stub. Its results are
# compared with those of the programs in build/release/examples. Installs what is missing.
# usage: examples/python/test.sh [ARGUMENT OF PYTEST...]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
source cmake/setup.sh

export GLOBALMATCH_PROGRAMS=$PWD/build/release/examples
programs=(map_stems match_stems register_scans register_survey)
for program in "${programs[@]}"; do
  if [ -x "$GLOBALMATCH_PROGRAMS/$program" ]; then continue; fi
  echo "$GLOBALMATCH_PROGRAMS has no $program, which the tests compare with. Build it first:" >&2
  echo "cmake -S . -B build/release -DCMAKE_BUILD_TYPE=Release" >&2
  echo "cmake --build build/release --target ${programs[*]}" >&2
  exit 2
done

install_missing python3-dev python3-pip python3-venv python3-setuptools python3-wheel python3-pybind11 \
  python3-numpy python3-pandas python3-pytest mypy
/usr/bin/python3 -m venv --system-site-packages build/python/venv
python=build/python/venv/bin/python
"$python" -m pip install --quiet --no-index --no-deps --force-reinstall --no-build-isolation examples/python

"$python" -m pytest -q -p no:cacheprovider examples/python/tests "$@"

# The stub: what mypy makes of a program that uses it, and of one with an error in each line that is marked.
mypy=("$python" -m mypy --cache-dir build/python/mypy)
"${mypy[@]}" --strict examples/python/tests/typed_use.py
wrong=examples/python/tests/wrong_use.py
diff <(grep -n '# wrong$' $wrong | cut -d: -f1) \
  <("${mypy[@]}" $wrong | grep -oP '^[^:]*wrong_use.py:\K\d+(?=: error)')
