"""Moves an aircraft's CFD mesh when its wing profiles change, without remeshing.

    import idmesh

    mover = idmesh.Mover.from_case("case.toml")
    result = mover.update(profiles={"wing": {1: points}})
    result.write("moved.su2")

A Mover is set up once per mesh and moves the mesh to design after design. `idmesh.compat` has IDWarp's class,
`idmesh.mphys` components for OpenMDAO.
"""

from ._design import Design, Gradient
from ._errors import DeviceError, IdmeshError, InputError, InvalidMesh, NotConverged, NotDifferentiable
from ._idmesh import Mesh, Mover, Result, __version__, adapters, read_profiles

__all__ = [
    "Design",
    "DeviceError",
    "Gradient",
    "IdmeshError",
    "InputError",
    "InvalidMesh",
    "Mesh",
    "Mover",
    "NotConverged",
    "NotDifferentiable",
    "Result",
    "__version__",
    "adapters",
    "read_profiles",
]
