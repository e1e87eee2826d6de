"""Designs of the wing-body example: the new wing's sections, made thicker or thinner.

    python designs.py [FOLDER]      moves the mesh to six designs and writes the meshes into the folder
"""

import os
import sys
from pathlib import Path

import numpy as np

import idmesh

CASE = Path(__file__).parents[1] / "wing-body" / "case.toml"
AMOUNTS = [0.90, 0.95, 1.00, 1.05, 1.10, 1.15]


def mover() -> idmesh.Mover:
    return idmesh.Mover.from_case(CASE, backend="cpu")


def profiles(mover: idmesh.Mover, amount: float) -> dict[str, dict[int, np.ndarray]]:
    """The case's new sections, stretched by `amount` across their chords."""
    found = {}
    for wing, sections in mover.design.profiles.items():
        middles = {number: points.mean(axis=0) for number, points in sections.items()}
        found[wing] = {
            number: middles[number] + (points - middles[number]) * [1.0, 1.0, amount]
            for number, points in sections.items()
        }
    return found


def move(mover: idmesh.Mover, amount: float) -> tuple[float, float]:
    """The amount and the worst beta of the moved mesh: small enough to send back."""
    return amount, float(mover.update(profiles=profiles(mover, amount)).beta.min())


def share() -> list[float]:
    """The designs of this task of a SLURM array; all of them outside of one."""
    task = int(os.environ.get("SLURM_ARRAY_TASK_ID", 0)) - int(os.environ.get("SLURM_ARRAY_TASK_MIN", 0))
    return AMOUNTS[task :: int(os.environ.get("SLURM_ARRAY_TASK_COUNT", 1))]


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "moved")
    folder.mkdir(parents=True, exist_ok=True)
    own = mover()
    for amount in share():
        result = own.update(profiles=profiles(own, amount))
        result.write(folder / f"moved-{amount:.2f}.su2")
        print(f"{amount:.2f} {result.beta.min():.17g}")
