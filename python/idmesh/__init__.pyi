from ._design import Design as Design
from ._design import Gradient as Gradient
from ._errors import DeviceError as DeviceError
from ._errors import IdmeshError as IdmeshError
from ._errors import InputError as InputError
from ._errors import InvalidMesh as InvalidMesh
from ._errors import NotConverged as NotConverged
from ._errors import NotDifferentiable as NotDifferentiable
from ._idmesh import Mesh as Mesh
from ._idmesh import Mover as Mover
from ._idmesh import Result as Result
from ._idmesh import __version__ as __version__
from ._idmesh import adapters as adapters
from ._idmesh import read_profiles as read_profiles

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
