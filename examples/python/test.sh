#!/usr/bin/env bash
# Installs the Python package into build/python/venv, runs its tests, and checks its stub. Programs in
# build/release/examples are compared with where they have been built. Installs what is missing.
# usage: examples/python/test.sh [ARGUMENT OF PYTEST...]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
source cmake/setup.sh

install_missing python3-dev python3-pip python3-venv python3-setuptools python3-wheel python3-pybind11 \
  python3-numpy python3-pandas python3-pytest mypy
/usr/bin/python3 -m venv --system-site-packages build/python/venv
python=build/python/venv/bin/python
"$python" -m pip install --quiet --no-index --no-deps --force-reinstall --no-build-isolation examples/python

export GLOBALMATCH_PROGRAMS=$PWD/build/release/examples
"$python" -m pytest -q -p no:cacheprovider examples/python/tests "$@"

# The stub: what mypy makes of a program that uses it, and of one with an error in each line that is marked.
mypy=("$python" -m mypy --cache-dir build/python/mypy)
"${mypy[@]}" --strict examples/python/tests/typed_use.py
wrong=examples/python/tests/wrong_use.py
diff <(grep -n '# wrong$' $wrong | cut -d: -f1) \
  <("${mypy[@]}" $wrong | grep -oP '^[^:]*wrong_use.py:\K\d+(?=: error)')
