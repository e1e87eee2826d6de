#!/bin/sh
#PBS -N designs
#PBS -J 1-10
#PBS -l select=1:ncpus=8
# Ten jobs share the designs of a folder. PBS tells a job its number and not how many there are: JOBS
# is the last number of -J, which begins with 1.
#
#     qsub pbs.sh                in the folder with case.toml and designs/
set -eu
JOBS=10
cd "${PBS_O_WORKDIR:-.}"
RAYON_NUM_THREADS=${NCPUS:-1}
export RAYON_NUM_THREADS
exec idmesh batch case.toml --designs designs --out moved --json "reports.$PBS_ARRAY_INDEX.jsonl" \
    --resume --shard "$PBS_ARRAY_INDEX/$JOBS"
