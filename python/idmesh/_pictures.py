"""A result as a table, and for pyvista."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from ._idmesh import Mesh, Result

# VTK's numbers of the types, in the order in which idmesh counts cells.
_TYPES = {"tets": 10, "pyramids": 14, "prisms": 13, "hexahedra": 12}


def _pyvista() -> Any:
    try:
        import pyvista
    except ImportError as error:
        raise ImportError('pictures need pyvista: pip install "idmesh[plot]"') from error
    return pyvista


def _faces(mesh: Mesh, family: str) -> Any:
    """The faces of a family as pyvista wants them: a number of corners, then the corners."""
    kinds = [mesh.family_triangles(family), mesh.family_quadrilaterals(family)]
    return np.concatenate([np.insert(kind.astype(np.int64), 0, kind.shape[1], axis=1).ravel() for kind in kinds])


def _surface(mesh: Mesh, family: str, points: Any, displacement: Any) -> Any:
    surface = _pyvista().PolyData(points, faces=_faces(mesh, family))
    surface.point_data["displacement"] = displacement
    # Only the vertices of the family.
    return surface.clean(point_merging=False, lines_to_points=False, polys_to_lines=False, strips_to_polys=False)


def to_pyvista(result: Result) -> Any:
    """See `Result.to_pyvista`."""
    pyvista = _pyvista()
    mesh = result.mesh
    cells = mesh.cells
    rows = [np.insert(cells[kind].astype(np.int64), 0, cells[kind].shape[1], axis=1).ravel() for kind in _TYPES]
    types = [np.full(len(cells[kind]), number, np.uint8) for kind, number in _TYPES.items()]
    grid = pyvista.UnstructuredGrid(np.concatenate(rows), np.concatenate(types), np.array(result.vertices))
    grid.point_data["displacement"] = np.array(result.displacement)
    others = grid.n_cells - len(result.beta)
    grid.cell_data["beta"] = np.concatenate([result.beta, np.full(others, np.nan)])
    for name in ("jacobian", "shape"):
        measure = getattr(result, name)
        if measure is not None:
            grid.cell_data[name] = np.array(measure)
    blocks = pyvista.MultiBlock()
    blocks["volume"] = grid
    for family in mesh.families:
        blocks[family] = _surface(mesh, family, np.array(result.vertices), np.array(result.displacement))
    return blocks


def _moved(result: Result) -> list[str]:
    """The families that moved, but for those that span the mesh, behind which the others would hide."""
    mesh = result.mesh
    size = np.linalg.norm(np.ptp(mesh.vertices, axis=0))
    found = []
    for family in mesh.families:
        own = mesh.family_vertices(family)
        spans = len(own) and np.linalg.norm(np.ptp(mesh.vertices[own], axis=0)) > 0.5 * size
        if np.any(result.displacement[own]) and not spans:
            found.append(family)
    return found or mesh.families


def plot(result: Result, families: list[str] | None, show: bool, off_screen: bool | None) -> Any:
    """See `Result.plot`."""
    plotter = _pyvista().Plotter(shape=(1, 2), off_screen=off_screen)
    shown = _moved(result) if families is None else families
    lengths = np.linalg.norm(result.displacement, axis=1)
    for column, (title, points) in enumerate([("undeformed", result.mesh.vertices), ("moved", result.vertices)]):
        plotter.subplot(0, column)
        plotter.add_text(title, font_size=10)
        for family in shown:
            surface = _surface(result.mesh, family, np.array(points), np.array(result.displacement))
            surface["length of displacement"] = np.linalg.norm(surface.point_data["displacement"], axis=1)
            plotter.add_mesh(
                surface, scalars="length of displacement", clim=[0.0, float(lengths.max())], show_edges=True
            )
    plotter.link_views()
    if show:
        plotter.show()
    return plotter


def table(result: Result) -> str:
    """The quality at the four stages, and whether the result may be used."""
    report = result.report
    error = report["error"]
    state = "valid" if error is None else escape(error["message"])
    names = ["stage", "beta min", "beta max", "beta mean", "inverted", "seconds"]

    def number(value: float | None, form: str) -> str:
        return "" if value is None else format(value, form)

    rows = [
        [
            escape(stage["name"]),
            number(stage["beta_min"], ".6f"),
            number(stage["beta_max"], ".6f"),
            number(stage["beta_mean"], ".7f"),
            str(stage["inverted"]),
            number(stage["seconds"], ".3f"),
        ]
        for stage in report["stages"]
    ]
    head = "".join(f"<th>{name}</th>" for name in names)
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    where = escape(f"{report['backend']['kind']} ({report['backend']['adapter']})")
    caption = f"{report['mesh']['vertices']} vertices on {where}: {state}"
    return f"<table><caption>{caption}</caption><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
