"""`USMesh` over several processes."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest


def mpiexec() -> str | None:
    beside = Path(sys.executable).with_name("mpiexec")
    return str(beside) if beside.exists() else shutil.which("mpiexec")


@pytest.mark.parametrize("processes", [1, 3])
def test_processes_share_a_mesh(box_path: Path, processes: int) -> None:
    pytest.importorskip("mpi4py", reason="optional: pip install mpi4py mpich")
    program = mpiexec()
    if program is None:
        pytest.skip("optional: no mpiexec, pip install mpich")
    script = Path(__file__).with_name("mpi_client.py")
    done = subprocess.run(
        [program, "-n", str(processes), sys.executable, str(script), str(box_path)],
        capture_output=True, text=True, timeout=300, env=os.environ | {"RAYON_NUM_THREADS": "1"},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("passed") == processes
