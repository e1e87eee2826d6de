"""IDWarp's class, driven as flow solvers drive it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from box import Box, Floats, turned, volumes

import idmesh
from idmesh.compat import USMesh

PLANE = {"symmetryPlanes": [[[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]]]}


class Solver:
    """A flow solver's own numbering: its order of the coordinates, some of them twice, and a surface of one patch for
    each side of the body, with points of its own."""

    def __init__(self, box: Box, doubled: bool) -> None:
        self.box = box
        rng = np.random.default_rng(3)
        n = len(box.points)
        self.nodes = np.concatenate([rng.permutation(n), rng.choice(n, 40)]) if doubled else np.arange(n)
        self.indices = (3 * self.nodes[:, None] + np.arange(3)).ravel().astype(np.intc if doubled else np.int64)
        faces = box.families["body"]
        a, b, c = (box.points[faces[:, corner]] for corner in range(3))
        normal = np.cross(b - a, c - a)
        axis = np.argmax(np.abs(normal), axis=1)
        side = 2 * axis + (normal[np.arange(len(faces)), axis] > 0)
        self.surface = np.zeros(0, int)
        conn = []
        for patch in range(6):
            own, corners = np.unique(faces[side == patch], return_inverse=True)
            conn.append(corners.reshape(-1, 3) + len(self.surface))
            self.surface = np.append(self.surface, own)
        self.conn = np.concatenate(conn)

    @property
    def points(self) -> Floats:
        return self.box.points[self.surface]

    def connect(self, mesh: USMesh) -> USMesh:
        mesh.setExternalMeshIndices(self.indices)
        sizes = np.full(len(self.conn), 3, np.intc)
        mesh.setSurfaceDefinition(self.points, self.conn.ravel(), sizes, np.zeros(len(self.conn), np.intc))
        return mesh


@pytest.fixture(scope="module", params=[True, False], ids=["doubled", "plain"])
def solver(box: Box, request: pytest.FixtureRequest) -> Solver:
    return Solver(box, request.param)


@pytest.fixture(scope="module")
def mesh(solver: Solver, box_path: Path) -> USMesh:
    options = {"gridFile": str(box_path), "fileType": "SU2", "backend": "cpu", "useRotations": True, **PLANE}
    return solver.connect(USMesh(options=options))


def test_the_grid_before_any_warp_is_the_files(mesh: USMesh, solver: Solver) -> None:
    grid = mesh.getSolverGrid()
    assert grid.dtype == np.float64 and np.array_equal(grid.reshape(-1, 3), solver.box.points[solver.nodes])
    assert np.array_equal(mesh.getSurfaceCoordinates(), solver.points)


def test_the_mesh_follows_its_surface(mesh: USMesh, solver: Solver) -> None:
    x = turned(solver.points, 0.2, 0.1)
    mesh.setSurfaceCoordinates(x)
    before = mesh.getSolverGrid()
    mesh.warpMesh()
    grid = mesh.getSolverGrid().reshape(-1, 3)
    assert not np.array_equal(grid.ravel(), before)
    assert np.array_equal(mesh.getSurfaceCoordinates(), x)
    moved = np.empty_like(solver.box.points)
    moved[solver.nodes] = grid
    assert np.array_equal(moved[solver.nodes], grid), "doubled coordinates differ"
    assert np.abs(moved[solver.surface] - x).max() < 1e-15
    far, plane = (np.unique(solver.box.families[name]) for name in ("farfield", "symmetry"))
    assert np.array_equal(moved[far], solver.box.points[far])
    assert np.array_equal(moved[plane, 1], solver.box.points[plane, 1])
    assert np.any(moved[plane] != solver.box.points[plane]), "the plane does not slide"
    assert volumes(moved, solver.box.tets).min() > 0
    # What was handed out is the caller's.
    mesh.getSolverGrid()[:] = 0.0
    mesh.getSurfaceCoordinates()[:] = 0.0
    assert np.array_equal(mesh.getSolverGrid().reshape(-1, 3), grid)
    assert np.array_equal(mesh.getSurfaceCoordinates(), x)


def test_products_are_transposes_and_limits_of_differences(mesh: USMesh, solver: Solver) -> None:
    rng = np.random.default_rng(1)
    x = turned(solver.points, 0.1, 0.05)
    seed = rng.standard_normal(len(solver.indices))
    # Each copy of a doubled point in its own direction, and all alike.
    apart = rng.standard_normal(x.shape)
    alike = rng.standard_normal(solver.box.points.shape)[solver.surface]
    mesh.setSurfaceCoordinates(x)
    # The product is at the surface that was set, and moves no grid.
    before = mesh.getSolverGrid()
    mesh.warpDeriv(seed)
    assert np.array_equal(mesh.getSolverGrid(), before)
    dxs = mesh.getdXs()
    for direction in (apart, alike):
        change = mesh.warpDerivFwd(direction)
        assert np.array_equal(mesh.warpDerivFwd(direction.ravel()), change)
        norms = np.linalg.norm(seed) * np.linalg.norm(change)
        assert abs(seed @ change - np.sum(dxs * direction)) < 1e-12 * norms
    assert not np.array_equal(mesh.getSolverGrid(), before), "the forward product warps first"
    ends = []
    for sign in (1, -1):
        mesh.setSurfaceCoordinates(x + sign * 1e-5 * alike)
        mesh.warpMesh()
        ends.append(mesh.getSolverGrid())
    difference = (ends[0] - ends[1]) / 2e-5
    assert np.linalg.norm(difference - change) < 1e-6 * np.linalg.norm(change)


def test_verify_compares_with_differences(mesh: USMesh, solver: Solver, capsys: pytest.CaptureFixture[str]) -> None:
    mesh.setSurfaceCoordinates(solver.points)
    mesh.warpMesh()
    rows = mesh.verifyWarpDeriv(dofStart=0, dofEnd=4, h=1e-5)
    assert [dof for dof, *_ in rows] == [0, 1, 2, 3]
    assert all(abs(product - difference) < 1e-4 * (1 + abs(product)) for _, product, difference in rows)
    assert any(product for _, product, _ in rows) and len(capsys.readouterr().out.splitlines()) == 4


def test_what_fails_leaves_the_surface(mesh: USMesh, solver: Solver) -> None:
    x = turned(solver.points, 0.1)
    mesh.setSurfaceCoordinates(x)
    mesh.warpMesh()
    grid = mesh.getSolverGrid()
    with pytest.raises(idmesh.InvalidMesh):
        mesh.verifyWarpDeriv(dofStart=0, dofEnd=1, h=5.0)
    assert np.array_equal(mesh.getSurfaceCoordinates(), x) and np.array_equal(mesh.getSolverGrid(), grid)
    with pytest.raises(idmesh.InputError, match="is at no vertex"):
        mesh.setSurfaceDefinition(np.vstack([solver.points, [[50.0, 0.0, 0.0]]]))
    mesh.warpMesh()
    assert np.array_equal(mesh.getSurfaceCoordinates(), x) and np.array_equal(mesh.getSolverGrid(), grid)
    with pytest.raises(idmesh.InputError, match="expected numbers from 0 to"):
        mesh.verifyWarpDeriv(dofStart=10**6, dofEnd=10**6 + 1)


def test_a_grid_that_changes_between_its_readings_is_refused(
    box: Box, box_path: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    solver = Solver(box, False)
    path = tmp_path / "box.su2"
    path.write_bytes(box_path.read_bytes())
    monkeypatch.chdir(tmp_path)
    mesh = USMesh({"gridFile": "box.su2", "backend": "cpu", **PLANE})
    monkeypatch.chdir("/")
    # The folder of the first reading counts.
    solver.connect(mesh)
    mesh.setSurfaceCoordinates(turned(solver.points, 0.2))
    mesh.writeGrid(tmp_path / "moved.su2")
    other = USMesh({"gridFile": path, "backend": "cpu", **PLANE})
    (tmp_path / "moved.su2").replace(path)
    with pytest.raises(idmesh.InputError, match="has changed"):
        solver.connect(other)


def test_masked_entries_are_refused(mesh: USMesh, solver: Solver) -> None:
    x = np.ma.masked_array(solver.points)
    x[3:] = np.ma.masked
    seed = np.ma.masked_array(np.ones(len(solver.indices)), mask=True)
    indices = np.ma.masked_array(np.arange(6), mask=np.arange(6) > 0)
    calls: list[Callable[[], Any]] = [
        lambda: mesh.setSurfaceCoordinates(x),
        lambda: mesh.setSurfaceCoordinates(list(x)),
        lambda: mesh.warpDeriv(seed),
        lambda: mesh.setExternalMeshIndices(indices),
    ]
    for call in calls:
        with pytest.raises(idmesh.InputError, match="masked entries"):
            call()


def test_a_warp_that_fails_leaves_no_grid(mesh: USMesh, solver: Solver) -> None:
    mesh.setSurfaceCoordinates(solver.points + [0.0, 0.6, 0.0])
    with pytest.raises(idmesh.InvalidMesh):
        mesh.warpMesh()
    with pytest.raises(idmesh.IdmeshError, match="last `warpMesh` failed"):
        mesh.getSolverGrid()
    mesh.setSurfaceCoordinates(solver.points)
    mesh.warpMesh()
    assert np.abs(mesh.getSolverGrid().reshape(-1, 3) - solver.box.points[solver.nodes]).max() < 1e-12


def test_new_definitions_leave_nothing_of_the_old(box: Box, box_path: Path) -> None:
    solver = Solver(box, False)
    mesh = solver.connect(USMesh({"gridFile": box_path, "backend": "cpu", **PLANE}))
    mesh.setSurfaceCoordinates(turned(solver.points, 0.2))
    mesh.warpMesh()
    moved = mesh.getSolverGrid()
    # Other numbers of the same mesh are those of the moved mesh.
    mesh.setExternalMeshIndices(solver.indices[::-1])
    assert np.array_equal(mesh.getSolverGrid(), moved[::-1])
    mesh.warpDeriv(moved)
    # The same surface in another order of its points, at rest.
    order = np.random.default_rng(1).permutation(len(solver.points))
    mesh.setSurfaceDefinition(solver.points[order])
    assert np.array_equal(mesh.getSolverGrid(), box.points.ravel()[solver.indices[::-1]])
    with pytest.raises(idmesh.IdmeshError, match="comes before `getdXs`"):
        mesh.getdXs()
    mesh.setSurfaceCoordinates(turned(solver.points, 0.2)[order])
    mesh.warpMesh()
    assert np.array_equal(mesh.getSolverGrid(), moved[::-1])


def test_the_grid_is_written(mesh: USMesh, solver: Solver, tmp_path: Path) -> None:
    x = turned(solver.points, 0.15)
    mesh.setSurfaceCoordinates(x)
    mesh.warpMesh()
    mesh.writeGrid(tmp_path / "moved.su2")
    written = idmesh.Mesh.read(tmp_path / "moved.su2").vertices
    assert np.array_equal(written.ravel()[solver.indices], mesh.getSolverGrid())
    assert np.array_equal(written.ravel(), mesh.getWarpGrid()) and np.array_equal(mesh.getCommonGrid(), written.ravel())
    with pytest.raises(idmesh.InputError):
        mesh.writeGrid()


def test_wrong_arrays_are_refused_and_forgotten(mesh: USMesh, solver: Solver) -> None:
    x = mesh.getSurfaceCoordinates()
    for wrong in (x[:-1], np.full_like(x, np.nan), x + 0j):
        with pytest.raises(idmesh.InputError):
            mesh.setSurfaceCoordinates(wrong)
    for seed in (np.zeros(3), np.full(len(solver.indices), np.inf)):
        with pytest.raises(idmesh.InputError):
            mesh.warpDeriv(seed)
    with pytest.raises(idmesh.InputError):
        mesh.warpDerivFwd(x[:-1])
    assert np.array_equal(mesh.getSurfaceCoordinates(), x)


@pytest.mark.parametrize(
    "options, told",
    [
        (None, "no options"),
        ({"fileType": "SU2"}, "`gridFile` is missing"),
        ({"gridFil": "x"}, "did you mean `gridFile`"),
        ({"fileType": "CGNS"}, "expected NAME.cgns"),
        ({"fileType": "OpenFOAM"}, "expected the folder of a case"),
        ({"fileType": "PLOT3D"}, "PLOT3D"),
        ({"fileType": "STL"}, "expected one of"),
        ({"symmetryPlanes": [[0.0, 1.0, 0.0]]}, "for each plane"),
        ({"specifiedSurfaces": ["farfield"]}, "no surface point is at its vertex"),
        ({"specifiedSurfaces": "bdy"}, "did you mean `body`"),
        ({"symmetrySurfaces": ["symetry"]}, "did you mean `symmetry`"),
        ({"backend": "abacus"}, "`backend`"),
    ],
)
def test_wrong_options_are_refused(box: Box, box_path: Path, options: Any, told: str) -> None:
    if options is not None and "gridFil" not in options and "is missing" not in told:
        options = {"gridFile": box_path, **options}
    with pytest.raises(idmesh.InputError) as caught:
        Solver(box, False).connect(USMesh(options=options))
    assert told in str(caught.value)


def test_options_may_be_written_small(box: Box, box_path: Path) -> None:
    mesh = Solver(box, False).connect(USMesh({"gridfile": box_path, "SYMMETRYSURFACES": ["symmetry"], "aExp": 3.0}))
    assert mesh.getSolverGrid().size == box.points.size


@pytest.mark.parametrize(
    "spoil, told",
    [
        (lambda points: points + [0.01, 0.0, 0.0], "all its vertices among the surface points"),
        (lambda points: np.append(points, [[0.5, 0.5, 0.51]], axis=0), "surface point 96"),
        (lambda points: points[:-40], "all its vertices"),
    ],
)
def test_points_that_are_no_surface_are_refused(
    box: Box, box_path: Path, spoil: Callable[[Floats], Floats], told: str
) -> None:
    solver = Solver(box, False)
    mesh = USMesh({"gridFile": box_path})
    mesh.setExternalMeshIndices(solver.indices)
    with pytest.raises(idmesh.InputError, match=told):
        mesh.setSurfaceDefinition(spoil(solver.points))
    with pytest.raises(idmesh.InputError, match="coordinate numbers from 0"):
        mesh.setExternalMeshIndices(solver.indices + 3)
    with pytest.raises(idmesh.InputError, match="integers"):
        mesh.setExternalMeshIndices(solver.indices.astype(float))
    with pytest.raises(idmesh.InputError, match="the sum of their sizes"):
        mesh.setSurfaceDefinition(solver.points, solver.conn.ravel(), [4] * len(solver.conn))


def test_symmetry_conditions_of_the_file_are_planes(box: Box, mover: idmesh.Mover, tmp_path: Path) -> None:
    case = tmp_path / "case"
    (case / "constant" / "polyMesh").mkdir(parents=True)
    mover.update().write(case / "constant" / "polyMesh")
    boundary = case / "constant" / "polyMesh" / "boundary"
    text = boundary.read_text()
    assert idmesh.Mesh.read(case).symmetries == []
    head, tail = text.split("symmetry", 1)
    boundary.write_text(head + "symmetry" + tail.replace("patch;", "symmetryPlane;", 1))
    assert idmesh.Mesh.read(case).symmetries == ["symmetry"]
    solver = Solver(box, False)
    mesh = solver.connect(USMesh({"gridFile": case, "fileType": "OpenFOAM", "backend": "cpu"}))
    mesh.setSurfaceCoordinates(turned(solver.points, 0.2))
    mesh.warpMesh()
    plane = np.unique(box.families["symmetry"])
    grid = mesh.getSolverGrid().reshape(-1, 3)
    assert np.any(grid[plane] != box.points[plane]) and np.array_equal(grid[plane, 1], box.points[plane, 1])
