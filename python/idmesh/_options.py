"""The options of `idmesh.compat.USMesh`."""

from __future__ import annotations

import difflib
import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from ._errors import InputError

# Options of the method of IDWarp: taken, without effect.
IGNORED = (
    "aExp bExp LdefFact alpha errTol evalMode symmTol useRotations zeroCornerRotations cornerAngle restartFile bucketSize"
).split()
# Options of idmesh.Mover.
OWN = ["backend", "tolerance", "quality", "springs", "max_steps"]
_KNOWN = ["gridFile", "fileType", "specifiedSurfaces", "symmetrySurfaces", "symmetryPlanes", *OWN, *IGNORED]
# The extensions of a type of file; a folder has none.
_TYPES = {
    "CGNS": [".cgns"],
    "OpenFOAM": [""],
    "SU2": [".su2"],
    "Gmsh": [".msh"],
    "VTU": [".vtu"],
    "VTK": [".vtk"],
    "AFLR3": [".ugrid"],
    "Medit": [".mesh", ".meshb"],
}


def checked(options: Mapping[str, Any] | None) -> dict[str, Any]:
    """The options with their defaults. Letters may be large or small, as for IDWarp."""
    if not options:
        raise InputError('no options were given, expected at least {"gridFile": FILE}')
    names = {name.lower(): name for name in _KNOWN}
    found: dict[str, Any] = dict.fromkeys(_KNOWN)
    found["tolerance"] = 1e-10
    for name, value in options.items():
        if str(name).lower() not in names:
            near = difflib.get_close_matches(str(name).lower(), names, n=1, cutoff=0.5)
            advice = f"; did you mean `{names[near[0]]}`?" if near else f", expected one of {', '.join(_KNOWN)}"
            raise InputError(f"unknown option `{name}`{advice}")
        found[names[str(name).lower()]] = value
    if found["gridFile"] is None:
        raise InputError("the option `gridFile` is missing, expected the file of the mesh")
    # The folder may change between the first and the second reading.
    found["gridFile"] = os.path.abspath(os.fspath(found["gridFile"]))
    if found["fileType"] is not None:
        _check_type(found["gridFile"], str(found["fileType"]))
    for name in ("specifiedSurfaces", "symmetrySurfaces"):
        if isinstance(found[name], str):
            found[name] = [found[name]]
    for plane in found["symmetryPlanes"] or []:
        shape = [np.shape(part) for part in plane]
        if shape != [(3,), (3,)] or not np.linalg.norm(plane[1]) > 0:
            raise InputError(f"`symmetryPlanes` holds {plane}, expected [[x, y, z], [nx, ny, nz]] for each plane")
    return found


def _check_type(path: str, given: str) -> None:
    types = {name.lower(): name for name in _TYPES}
    if given.lower() == "plot3d":
        raise InputError("`fileType` is PLOT3D, whose blocks idmesh does not read")
    if given.lower() not in types:
        raise InputError(f"`fileType` is {given}, expected one of {', '.join(_TYPES)}")
    name = types[given.lower()]
    plain = path.lower().removesuffix(".gz")
    fits = os.path.isdir(path) if name == "OpenFOAM" else any(plain.endswith(end) for end in _TYPES[name])
    if not fits:
        wanted = "the folder of a case" if name == "OpenFOAM" else " or ".join(f"NAME{end}" for end in _TYPES[name])
        raise InputError(f"`fileType` is {name}, but `gridFile` is {path}, expected {wanted}")
