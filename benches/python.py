"""The Python package: its size, import, memory and a loop of designs.

    python benches/python.py [DESIGNS] [WHEEL]

The loop is that of benches/designs.rs (1000 designs of the example if not said, on the CPU), so both can be run in turns.
`RAYON_NUM_THREADS` limits its threads. Memory is told by Linux alone.
"""

import gc
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

import idmesh

CASE = Path(__file__).parents[1] / "examples" / "wing-body" / "case.toml"


def resident() -> float:
    """Memory of this process that is in use, in bytes."""
    with open("/proc/self/status") as status:
        return 1024.0 * float(next(line for line in status if line.startswith("VmRSS")).split()[1])


def varied(design: idmesh.Design, at: int) -> dict[str, dict[int, np.ndarray]]:
    """A little thicker and higher each time, as in benches/designs.rs."""
    turn = 0.05 * at
    found: dict[str, dict[int, np.ndarray]] = {}
    for wing, profiles in design.profiles.items():
        found[wing] = {}
        for number, points in profiles.items():
            moved = points.copy()
            moved[:, 2] += 2e-3 * points[:, 1] * np.sin(turn) + 1e-3 * points[:, 0] * np.cos(0.7 * turn)
            found[wing][number] = moved
    return found


def main() -> None:
    designs = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    if len(sys.argv) > 2:
        print(f"wheel: {Path(sys.argv[2]).stat().st_size / 1e6:.2f} MB")
    script = "import numpy, time; t = time.perf_counter(); import idmesh; print(time.perf_counter() - t)"
    imports = [float(subprocess.check_output([sys.executable, "-c", script])) for _ in range(5)]
    print(f"import after numpy: {statistics.median(imports):.3f} s")

    mover = idmesh.Mover.from_case(CASE, backend="cpu")
    design = mover.design
    mover.update(profiles=varied(design, 0))
    gc.collect()
    before, n = resident(), len(mover.vertices)
    kept = [mover.update(profiles=varied(design, at)) for at in range(20)]
    gc.collect()
    # Beside the vertices a result keeps the displacement, beta of every tet before and after, and what products need.
    print(f"a result: {(resident() - before) / len(kept) / n:.0f} bytes a vertex, {24:.0f} of them the vertices")
    del kept

    print("designs  update ms  memory MB")
    lines = max(1, designs // 5)
    seconds = []
    for at in range(1, designs + 1):
        given = varied(design, at)
        begin = time.perf_counter()
        result = mover.update(profiles=given)
        seconds.append(time.perf_counter() - begin)
        del result
        if at % lines == 0:
            print(f"{at:7d}  {1e3 * statistics.median(seconds):9.1f}  {resident() / 1e6:9.1f}", flush=True)
            seconds = []
    print(f"threads: {os.environ.get('RAYON_NUM_THREADS', os.cpu_count())}")


if __name__ == "__main__":
    main()
