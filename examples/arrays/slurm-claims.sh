#!/bin/sh
#SBATCH --job-name=designs
#SBATCH --array=1-10
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=8
#SBATCH --requeue
# As many jobs as the array has share the designs of a folder one by one, through a folder of claims.
# No job waits while another one has slow designs, jobs may be added later, and what a lost node had
# in hand is done by the others.
#
#     sbatch slurm-claims.sh     in the folder with case.toml and designs/
set -eu
RAYON_NUM_THREADS=${SLURM_CPUS_PER_TASK:-1}
export RAYON_NUM_THREADS
exec idmesh batch case.toml --designs designs --out moved --json "reports.$SLURM_ARRAY_TASK_ID.jsonl" \
    --resume --claim claims
