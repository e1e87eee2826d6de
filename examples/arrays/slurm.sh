#!/bin/sh
#SBATCH --job-name=designs
#SBATCH --array=1-10
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=8
#SBATCH --requeue
# Ten jobs share the designs of a folder. Each takes every tenth design, and a job that SLURM starts
# again goes on where it stopped.
#
#     sbatch slurm.sh            in the folder with case.toml and designs/
#     sbatch --array=1-40 slurm.sh
#
# The number of jobs is that of the array. Do not start single jobs of the array again with another
# --array: the shares follow the array that is submitted.
set -eu
RAYON_NUM_THREADS=${SLURM_CPUS_PER_TASK:-1}
export RAYON_NUM_THREADS
exec idmesh batch case.toml --designs designs --out moved --json "reports.$SLURM_ARRAY_TASK_ID.jsonl" \
    --resume --shard auto
