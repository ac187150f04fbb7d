#!/usr/bin/env bash
# register_survey in parts as Slurm job arrays: submits them, each stage after the one before, and prints the number
# of the last job. Nodes share the folders. A part that died is submitted again alone, by its number in the array.
# usage: slurm.sh SCANS DIR PARTS [OPTION...]     options are those of register_survey
#        REGISTER_SURVEY is the program; SBATCH_* variables hold what else the cluster asks for
set -euo pipefail
if [ $# -lt 3 ]; then sed -n '2,5s/^# //p' "$0" >&2 && exit 2; fi
scans=$1 out=$2 parts=$3
shift 3
survey=$(printf '%q ' "${REGISTER_SURVEY:-register_survey}" "$scans" --out-dir "$out" "$@")
after=()
for stage in map match refine; do
  job=$(sbatch --parsable --array="1-$parts" --cpus-per-task=1 "${after[@]}" --job-name="survey_$stage" \
    --wrap="$survey --only $stage --part \$SLURM_ARRAY_TASK_ID/$parts --threads 1")
  after=(--dependency="afterok:$job")
done
sbatch --parsable "${after[@]}" --job-name=survey_solve --wrap="$survey --only solve"
