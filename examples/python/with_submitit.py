"""Designs as jobs of submitit: jobs of SLURM, or local processes without SLURM.

    python with_submitit.py [FOLDER]     the folder for submitit's files
"""

import os
import shutil
import sys
from pathlib import Path

import submitit

from designs import AMOUNTS, move, mover

if __name__ == "__main__":
    folder = sys.argv[1] if len(sys.argv) > 1 else "submitit"
    kind = submitit.SlurmExecutor if shutil.which("srun") else submitit.LocalExecutor
    # A job finds `designs` where this file is.
    os.environ["PYTHONPATH"] = os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])
    executor = kind(folder)
    own = mover()
    for amount, beta in [job.result() for job in [executor.submit(move, own, amount) for amount in AMOUNTS]]:
        print(f"{amount:.2f} {beta:.17g}")
