#!/usr/bin/env bash
# The workflows of examples/workflows/ give the bytes of one process: simulated scans, by Snakemake with two jobs, by
# GNU parallel, and as job arrays, for which a script stands in for sbatch.
# usage: tests/workflows/run.sh [FOLDER OF PROGRAMS]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
programs=$(realpath "${1:-build/release/examples}")
export REGISTER_SURVEY=$programs/register_survey
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT

"$programs/simulate_plot" "$folder/scans" --stations 5 --angular-step 0.25 --seed 3 >/dev/null
"$REGISTER_SURVEY" "$folder/scans" --out-dir "$folder/one" >/dev/null

same_as_one() { # of the results, the maps, and nothing half written
  diff -r --exclude=hashes --exclude=matches --exclude=done "$folder/one" "$1"
  echo "$2: the bytes of one process"
}

snakemake --snakefile examples/workflows/Snakefile --cores 2 --quiet all --directory "$folder" \
  --config scans="$folder/scans" out="$folder/snakemake" parts=3 program="$REGISTER_SURVEY" >/dev/null
same_as_one "$folder/snakemake" Snakemake

examples/workflows/parallel.sh "$folder/scans" "$folder/parallel" 3 >/dev/null
same_as_one "$folder/parallel" "GNU parallel"

# Runs what is submitted at once, each number of an array by itself, the last one first.
mkdir "$folder/bin"
cat >"$folder/bin/sbatch" <<'S'
#!/usr/bin/env bash
set -euo pipefail
numbers=0
for argument; do
  case $argument in
    --array=1-*) numbers=$(seq "${argument#--array=1-}" -1 1) ;;
    --wrap=*) wrapped=${argument#--wrap=} ;;
    --dependency=afterok:7 | --parsable | --cpus-per-task=1 | --job-name=survey_*) ;;
    *) echo "sbatch: $argument?" >&2 && exit 1 ;;
  esac
done
for number in $numbers; do SLURM_ARRAY_TASK_ID=$number sh -c "$wrapped" >/dev/null; done
echo 7
S
chmod +x "$folder/bin/sbatch"
PATH=$folder/bin:$PATH examples/workflows/slurm.sh "$folder/scans" "$folder/slurm" 3 >/dev/null
same_as_one "$folder/slurm" "Job arrays"
