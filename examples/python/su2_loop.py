"""A loop around SU2, with SU2's file names: the mesh is moved in memory, and SU2_CFD reads it from its folder.

    python su2_loop.py MESH.su2 FOLDER

`body` follows the design, `symmetry` slides in its plane, and all others stay. A discrete adjoint writes Sensitivity_x, _y
and _z at every vertex. Where there is one, `gradient` takes it to the design; here a function of the coordinates stands for
it. Local optimisation is off: it has no derivative.
"""

import sys
from pathlib import Path

import numpy as np

import idmesh


def flow(folder: Path, result: idmesh.Result) -> tuple[float, np.ndarray]:
    """The objective and its derivative by the vertices. With SU2:

    subprocess.run(["SU2_CFD", "flow.cfg"], cwd=folder, check=True)
    subprocess.run(["SU2_CFD_AD", "adjoint.cfg"], cwd=folder, check=True)
    """
    x = result.vertices
    return 0.5 * float(np.sum((x - 0.4) ** 2)), x - 0.4


def run(mesh: Path, folder: Path, steps: int = 5) -> list[float]:
    families = idmesh.Mesh.read(mesh).families
    roles = {"body": "prescribed", "symmetry": "plane"}
    mover = idmesh.Mover(mesh, {family: roles.get(family, "fixed") for family in families}, quality="off", backend="cpu")
    x = mover.vertices[mover.family_vertices("body")] - mover.vertices[mover.family_vertices("body")].mean(axis=0)
    # One variable a direction: the body shifts, and it turns about the y axis.
    basis = np.stack([np.eye(3)[0] + 0 * x, np.eye(3)[2] + 0 * x, np.c_[x[:, 2], 0 * x[:, 1], -x[:, 0]]])
    variables = np.zeros(3)
    history = []
    for step in range(steps):
        design = folder / "DESIGNS" / f"DSN_{step + 1:03d}"
        design.mkdir(parents=True, exist_ok=True)
        result = mover.update(displacements={"body": np.tensordot(variables, basis, 1)})
        result.write(design / "mesh_deformed.su2")
        value, sensitivity = flow(design, result)
        gradient = np.tensordot(basis, result.reverse(sensitivity).displacements["body"], 2)
        (design / "of_grad.dat").write_text("VARIABLES=\"VARIABLE\",\"GRADIENT\"\n" + "".join(
            f"{number},{slope:.16e}\n" for number, slope in enumerate(gradient)
        ))
        history.append(value)
        variables -= 0.02 * gradient / np.linalg.norm(gradient)
    return history


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    for value in run(Path(sys.argv[1]), Path(sys.argv[2])):
        print(f"{value:.17g}")
