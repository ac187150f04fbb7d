#!/usr/bin/env bash
# Compares digests of results with those that are known for this compiler and instruction set, so that a
# change that is meant to change no result is shown to change none.
# usage: tests/golden/run.sh [--update] [matching|registration|header_only]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
source cmake/setup.sh

update=false which=()
for argument in "$@"; do
  case "$argument" in
    --update) update=true ;;
    matching | registration | header_only) which+=("$argument") ;;
    *) echo "usage: tests/golden/run.sh [--update] [matching|registration|header_only]" >&2 && exit 2 ;;
  esac
done
if [ ${#which[@]} -eq 0 ]; then which=(matching registration); fi
programs=()
for name in "${which[@]}"; do
  case "$name" in
    matching) programs+=(matching_digest_compiled) ;;
    header_only) programs+=(matching_digest_globalmatch) ;; # matching without the compiled mode
    registration) programs+=(registration_digest) ;;
  esac
done

# The mathematical functions of glibc, too, choose their code by the instruction set.
fma=$(grep -qw fma /proc/cpuinfo 2>/dev/null && echo fma || echo sse2)
key=$(c++ --version | head -1 | grep -oE 'clang|[0-9]+\.[0-9]+\.[0-9]+' | head -1)-$(uname -m)-$fma
known=.ci/golden/$key
clouds=../shared/data/clouds

configure_release >/dev/null
status=0
for program in "${programs[@]}"; do
  name=${program%%_*}
  cmake --build build/release --target "$program" >/dev/null
  digests=$(mktemp)
  trap 'rm -f "$digests"' EXIT
  if [ "$name" = registration ] && [ ! -d "$clouds" ]; then
    echo "$name: skipped, there is no $clouds"
    continue
  fi
  build/release/tests/"$program" "$clouds" >"$digests"
  if $update; then
    mkdir -p "$known" && cp "$digests" "$known/$name.txt"
  elif [ ! -f "$known/$name.txt" ]; then
    echo "$name: skipped, no digests are known for $key; $0 --update writes them"
  elif diff "$known/$name.txt" "$digests"; then
    echo "$program: $(wc -l <"$digests") digests, all as they are known"
  else
    status=1
  fi
done
exit $status
