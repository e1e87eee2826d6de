#!/usr/bin/env python3
"""A spring system solved by idmesh, by PyAMG's smoothed aggregation and by SciPy's sparse LU, on one core in one run.

    pip install pyamg scipy
    python3 benches/peers.py [--bench EXECUTABLE] [MESH]

MESH has a family `wing`, which pitches by 10 degrees; it is `tests/data/pitch-wing.msh.gz` if not given. The system, three
right-hand sides, comes from `cargo bench --bench relaxation`, which also times idmesh; EXECUTABLE is that benchmark built
before. Medians; idmesh and the others take turns. The error is the largest of a vertex in its shortest edges.
"""

import argparse
import os
import pathlib
import re
import statistics
import subprocess
import tempfile
import time

THREADS = {name: "1" for name in ("RAYON_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
os.environ.update(THREADS)

import numpy as np
import pyamg
import scipy
import scipy.sparse as sparse
import scipy.sparse.linalg as linalg

TOLERANCE = 1e-4
ROUNDS = 3
REPEATS = 9


def system(folder):
    def read(name, kind):
        return np.fromfile(folder / name, kind)

    start, columns, stiffness = read("row_start", "<u4"), read("columns", "<u4"), read("stiffness", "<f8")
    n = len(start) - 1
    springs = sparse.csr_matrix((stiffness, columns.astype(np.int32), start.astype(np.int32)), shape=(n, n))
    diagonal = np.asarray(springs.sum(axis=1)).ravel() + read("anchor", "<f8")
    vectors = [read(name, "<f8").reshape(n, 3) for name in ("load", "solution")]
    return (sparse.diags(diagonal) - springs).tocsr(), *vectors, read("inverse_length", "<f8")


def timed(work, repeats):
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        result = work()
        times.append(time.perf_counter() - start)
    return statistics.median(times), result


def idmesh(command, mesh, folder):
    """Seconds of set-up and solution by cycles, and the residual that is left."""
    run = subprocess.run([*command, str(mesh), "--system", str(folder)], check=True, capture_output=True, text=True)
    line = next(line for line in run.stdout.splitlines() if " multigrid " in line)
    set_up, _, solve, _, residual, _ = re.split(r"\s+", line.strip())[-6:]
    return float(set_up) / 1e3, float(solve) / 1e3, float(residual)


def main():
    root = pathlib.Path(__file__).resolve().parent.parent
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bench", type=pathlib.Path, help="the benchmark `relaxation`, built before")
    parser.add_argument("mesh", nargs="?", type=pathlib.Path, default=root / "tests/data/pitch-wing.msh.gz")
    arguments = parser.parse_args()
    cargo = ["cargo", "bench", "--quiet", "--locked", "--manifest-path", str(root / "Cargo.toml"), "--bench", "relaxation", "--"]
    command = [str(arguments.bench.resolve())] if arguments.bench else cargo
    mesh = arguments.mesh.resolve()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})

    chebyshev = ("chebyshev", {"degree": 2, "iterations": 1})
    jacobi = ("jacobi", {"omega": 4 / 3, "iterations": 1, "withrho": True})
    variants = {
        "PyAMG, its defaults": {},
        "PyAMG, Jacobi": {"presmoother": jacobi, "postsmoother": jacobi},
        "PyAMG, Chebyshev": {"presmoother": chebyshev, "postsmoother": chebyshev},
    }
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for _ in range(ROUNDS):
            set_up, solve, residual = idmesh(command, mesh, folder)
            found.setdefault("idmesh, cycles to 1e-4 of an edge", []).append((set_up, solve, residual, TOLERANCE))
            matrix, load, solution, inverse_length = system(folder)

            def figures(set_up, solve, x):
                residual = np.linalg.norm(load - matrix @ x) / np.linalg.norm(load)
                error = (np.linalg.norm(x - solution, axis=1) * inverse_length).max()
                return set_up, solve, residual, error

            for name, options in variants.items():
                set_up, levels = timed(lambda: pyamg.smoothed_aggregation_solver(matrix, **options), 3)

                def solve():
                    columns = (levels.solve(load[:, axis], tol=TOLERANCE, accel="cg") for axis in range(3))
                    return np.stack(list(columns), axis=1)

                found.setdefault(name, []).append(figures(set_up, *timed(solve, REPEATS)))
            columns = matrix.tocsc()
            options = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
            set_up, factors = timed(lambda: linalg.splu(columns, **options), 1)
            found.setdefault("SciPy, sparse LU", []).append(figures(set_up, *timed(lambda: factors.solve(load), REPEATS)))

    print(f"{mesh.name}: {matrix.shape[0]} unknowns, three right-hand sides, one core, medians of {ROUNDS} rounds")
    print(f"pyamg {pyamg.__version__}, scipy {scipy.__version__}, numpy {np.__version__}\n")
    print(f"{'':36}{'set-up ms':>10}{'solve ms':>10}{'residual':>10}{'error':>10}{'over idmesh':>13}")
    own = statistics.median(rows[1] for rows in next(iter(found.values())))
    for name, rows in found.items():
        set_up, solve, residual, error = (statistics.median(column) for column in zip(*rows))
        error = f"<{error:.0e}" if name.startswith("idmesh") else f"{error:.1e}"
        print(f"{name:36}{1e3 * set_up:10.1f}{1e3 * solve:10.1f}{residual:10.1e}{error:>10}{solve / own:13.2f}")


if __name__ == "__main__":
    main()
