"""Finds hidden sections of the wing-body from its volume mesh alone, with gradients by `Result.reverse`.

Somebody has moved the mesh with sections that this program does not know. It changes the old sections by Hicks-Henne
bumps until its own mesh is the same. The number to lower is J = sum |x - target|^2 / 2 over all vertices. A flow solver
would put the drag in its place, and its adjoint would give dJ/dx.

    python optimise.py [CASE.toml]
"""

import sys
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

import idmesh

CASE = Path(__file__).parent / ".." / "wing-body" / "case.toml"
PEAKS = [0.15, 0.35, 0.6, 0.85]  # of the bumps, in chords from the leading edge


def bumps(points):
    """Bumps of one section (n bumps, k): for each peak one on the upper and one on the lower side."""
    leading, trailing = points[np.argmin(points[:, 0])], points[np.argmax(points[:, 0])]
    along = np.clip((points[:, 0] - leading[0]) / (trailing[0] - leading[0]), 0.0, 1.0)
    above = points[:, 2] > leading[2] + along * (trailing[2] - leading[2])
    unit = 0.01 * (trailing[0] - leading[0])
    shapes = [np.sin(np.pi * along ** (np.log(0.5) / np.log(peak))) ** 3 for peak in PEAKS]
    return np.array([unit * shape * side for shape in shapes for side in (above, ~above)])


class Loop:
    """What an optimiser asks: J and its gradient by the heights of the bumps, in hundredths of a chord."""

    def __init__(self, case):
        # Local optimisation has no derivative. The old sections' own points, moved, are matched point by point.
        self.mover = idmesh.Mover.from_case(case, backend="cpu", tolerance=1e-10, quality="off")
        self.old = self.mover.old_profiles
        self.bumps = {wing: {n: bumps(points) for n, points in of.items()} for wing, of in self.old.items()}
        self.size = sum(len(of) for wing in self.bumps.values() for of in wing.values())
        self.target = None
        self.updates = 0

    def heights(self, variables):
        """The variables of each section, in order."""
        at = 0
        for wing, of_wing in self.bumps.items():
            for number, of in of_wing.items():
                yield wing, number, of, variables[at : at + len(of)]
                at += len(of)

    def move(self, variables):
        profiles = {wing: dict(of) for wing, of in self.old.items()}
        for wing, number, of, heights in self.heights(variables):
            profiles[wing][number] = profiles[wing][number] + np.outer(heights @ of, [0.0, 0.0, 1.0])
        self.updates += 1
        return self.mover.update(profiles)

    def value_and_gradient(self, variables):
        result = self.move(variables)
        seed = result.vertices - self.target
        gradient = result.reverse(seed).profiles
        parts = [of @ gradient[wing][number][:, 2] for wing, number, of, _ in self.heights(variables)]
        return 0.5 * np.sum(seed**2), np.concatenate(parts)


def main():
    loop = Loop(sys.argv[1] if len(sys.argv) > 1 else CASE)
    hidden = np.sin(1.0 + np.arange(loop.size) ** 1.5)
    loop.target = loop.move(hidden).vertices

    # In the undeformed mesh every vertex of the fuselage is on a kink, so differences are taken elsewhere.
    there = 0.5 * hidden
    _, gradient = loop.value_and_gradient(there)
    print("the gradient against central differences:")
    for step in (1e-1, 1e-2, 1e-3, 1e-4):
        worst = 0.0
        for k in range(0, loop.size, 5):
            along = step * np.eye(loop.size)[k]
            plus, minus = (loop.value_and_gradient(there + sign * along)[0] for sign in (1, -1))
            worst = max(worst, abs((plus - minus) / (2 * step) - gradient[k]))
        print(f"  step {step:.0e}: apart by {worst / np.abs(gradient).max():.1e} of the largest component")

    start = np.zeros(loop.size)
    first, _ = loop.value_and_gradient(start)
    print("J over the first J:")
    history = [1.0]

    def note(intermediate_result):
        history.append(intermediate_result.fun)
        print(f"  {len(history) - 1:3d} {history[-1]:.3e}")
        if history[-1] < 1e-6:
            raise StopIteration

    loop.updates = 0
    # The bounds keep a line search away from sections that cross themselves.
    found = minimize(
        lambda variables: [of / first for of in loop.value_and_gradient(variables)],
        start,
        jac=True,
        method="L-BFGS-B",
        bounds=[(-3.0, 3.0)] * loop.size,
        callback=note,
        options={"ftol": 0.0, "gtol": 0.0, "maxcor": 20},
    )
    apart = np.abs(found.x - hidden).max() / np.abs(hidden).max()
    print(f"{loop.size} variables, {loop.updates} updates and products, heights off by {apart:.1e} of the largest")
    if not history[-1] < 1e-6:
        raise SystemExit("J did not fall to a millionth")


if __name__ == "__main__":
    main()
