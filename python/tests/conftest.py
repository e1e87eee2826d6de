"""What tests share."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from box import Box, Floats, turned

import idmesh

ROOT = Path(__file__).resolve().parents[2]
ROLES = {"body": "prescribed", "symmetry": "plane", "farfield": "fixed"}


@pytest.fixture(scope="session")
def root() -> Path:
    return ROOT


@pytest.fixture(scope="session")
def case(root: Path) -> Path:
    return root / "examples" / "wing-body" / "case.toml"


@pytest.fixture(scope="session")
def example(case: Path) -> idmesh.Mover:
    return idmesh.Mover.from_case(case, backend="cpu")


@pytest.fixture(scope="session")
def program(root: Path) -> str:
    """The command line, which `tests/run` has built."""
    path = os.environ.get("IDMESH_BINARY", str(root / "target" / "debug" / "idmesh"))
    assert Path(path).is_file(), f"{path} is missing: tests/run builds it, or set IDMESH_BINARY"
    return path


@pytest.fixture(scope="session")
def box() -> Box:
    return Box()


@pytest.fixture(scope="session")
def box_path(box: Box, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return box.write(tmp_path_factory.mktemp("box") / "box.su2")


@pytest.fixture(scope="session")
def mover(box_path: Path) -> idmesh.Mover:
    return idmesh.Mover(box_path, ROLES, backend="cpu", tolerance=1e-12)


@pytest.fixture(scope="session")
def springs(box_path: Path) -> idmesh.Mover:
    """A mover without local optimisation, which has no derivative."""
    return idmesh.Mover(box_path, ROLES, backend="cpu", tolerance=1e-12, quality="off")


@pytest.fixture(scope="session")
def turn(mover: idmesh.Mover) -> Callable[..., dict[str, Floats]]:
    """The displacements that turn the body."""
    at = mover.vertices[mover.family_vertices("body")]
    return lambda angle, bulge=0.0: {"body": turned(at, angle, bulge) - at}
