"""Meshes with cells of several kinds."""

from pathlib import Path

import numpy as np
import pytest

import idmesh


@pytest.fixture(scope="module")
def hybrid(root: Path) -> idmesh.Mover:
    data = root / "tests" / "data" / "hybrid"
    families = idmesh.Mesh.read(data / "small.msh.gz").families
    return idmesh.Mover(data / "small.msh.gz", {**dict.fromkeys(families, "fixed"), families[0]: "prescribed"},
                        backend="cpu", tolerance=1e-12)


def test_cells_come_by_kind(hybrid: idmesh.Mover) -> None:
    counts = hybrid.update().report["mesh"]
    assert {kind: len(cells) for kind, cells in hybrid.cells.items()} == {
        kind: counts.get(kind, 0) for kind in ("tets", "pyramids", "prisms", "hexahedra")
    }
    assert len(hybrid.cells["prisms"]) > 0
    for kind, corners in {"tets": 4, "pyramids": 5, "prisms": 6, "hexahedra": 8}.items():
        assert hybrid.cells[kind].shape[1] == corners
    for family in hybrid.families:
        faces = [hybrid.family_triangles(family), hybrid.mesh.family_quadrilaterals(family)]
        own = np.unique(np.concatenate([face.ravel() for face in faces]))
        assert np.array_equal(hybrid.family_vertices(family), own)


def test_a_prescribed_family_moves_all_kinds_of_cells(hybrid: idmesh.Mover) -> None:
    family = hybrid.families[0]
    shift = 1e-4 * np.ptp(hybrid.vertices, axis=0).min() * np.ones((len(hybrid.family_vertices(family)), 3))
    result = hybrid.update(displacements={family: shift})
    n_cells = sum(len(cells) for cells in hybrid.cells.values())
    assert result.jacobian is not None and result.shape is not None
    assert len(result.jacobian) == len(result.shape) == n_cells and len(result.beta) == len(hybrid.tets)
    assert result.jacobian.min() > 0 and result.shape.max() <= 1 + 1e-12
    rng = np.random.default_rng(1)
    direction, seed = rng.standard_normal(shift.shape), rng.standard_normal(hybrid.vertices.shape)
    forward = result.forward(displacements={family: direction})
    apart = np.sum(seed * forward) - np.sum(result.reverse(seed).displacements[family] * direction)
    assert abs(apart) < 1e-12 * np.linalg.norm(seed) * np.linalg.norm(forward)


def test_pyvista_gets_every_kind(hybrid: idmesh.Mover) -> None:
    pytest.importorskip("pyvista", reason='optional: pip install "idmesh[plot]"')
    volume = hybrid.update().to_pyvista()["volume"]
    assert volume.n_cells == sum(len(cells) for cells in hybrid.cells.values())
    assert volume.compute_cell_sizes()["Volume"].min() > 0
    assert np.isnan(volume.cell_data["beta"]).sum() == volume.n_cells - len(hybrid.tets)
