#!/usr/bin/env bash
#SBATCH --job-name=idmesh
#SBATCH --array=0-2
#SBATCH --cpus-per-task=2
# A job array: each task moves the mesh to its share of the designs. sbatch slurm_array.sh FOLDER
set -euo pipefail
export RAYON_NUM_THREADS="${SLURM_CPUS_PER_TASK:-2}"
exec python "${IDMESH_EXAMPLES:-$PWD}/designs.py" "$@"
