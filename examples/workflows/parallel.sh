#!/usr/bin/env bash
# register_survey in parts with GNU parallel: here, or on other hosts with --sshlogin in PARALLEL, which share the
# folders. A part that died is run again; what is done is not.
# usage: parallel.sh SCANS DIR PARTS [OPTION...]     options are those of register_survey
#        REGISTER_SURVEY is the program, register_survey if not set
set -euo pipefail
if [ $# -lt 3 ]; then sed -n '2,5s/^# //p' "$0" >&2 && exit 2; fi
scans=$1 out=$2 parts=$3
shift 3
for stage in map match refine; do
  seq "$parts" | parallel --quote --retries 2 --halt soon,fail=1 \
    "${REGISTER_SURVEY:-register_survey}" "$scans" --out-dir "$out" --only "$stage" --part "{}/$parts" --threads 1 "$@"
done
"${REGISTER_SURVEY:-register_survey}" "$scans" --out-dir "$out" --only solve "$@"
