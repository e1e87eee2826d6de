"""A loop on an OpenFOAM case, as DAFoam drives it: the points of the mesh are written anew, and nothing else.

    python dafoam_loop.py CASE PATCH FOLDER     CASE has constant/polyMesh, and PATCH follows the design

Each design is a copy of the case with the moved points, on which a solver can start.
"""

import shutil
import sys
from pathlib import Path

import numpy as np

from idmesh.compat import USMesh
from idmesh import Mesh


def run(case: Path, patch: str, folder: Path, angles: list[float]) -> list[Path]:
    file = Mesh.read(case)
    points = file.vertices[file.family_vertices(patch)]
    mesh = USMesh({"gridFile": str(case), "fileType": "OpenFOAM", "specifiedSurfaces": [patch]})
    # DAFoam numbers its coordinates as the file does.
    mesh.setExternalMeshIndices(np.arange(file.vertices.size))
    mesh.setSurfaceDefinition(points)
    made = []
    for number, angle in enumerate(angles):
        cos, sin = np.cos(angle), np.sin(angle)
        centre = points.mean(axis=0)
        turned = centre + (points - centre) @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
        mesh.setSurfaceCoordinates(turned)
        mesh.warpMesh()
        design = folder / f"design{number}"
        shutil.copytree(case, design)
        mesh.writeGrid(design / "constant" / "polyMesh")
        made.append(design)
    return made


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    for design in run(Path(sys.argv[1]), sys.argv[2], Path(sys.argv[3]), [0.01, 0.02]):
        print(design)
