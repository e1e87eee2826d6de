"""Tables and pictures of results."""

from html.parser import HTMLParser
from typing import Any

import numpy as np
import pytest

import idmesh


class Cells(HTMLParser):
    """The texts of a table's cells."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.texts: list[str] = []

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open[-1] in ("td", "caption"):
            self.texts.append(data)


def test_a_notebook_shows_the_stages(example: idmesh.Mover) -> None:
    result = example.update()
    cells = Cells()
    cells.feed(result._repr_html_())
    assert not cells.open
    caption, *texts = cells.texts
    assert "valid" in caption and str(len(example.vertices)) in caption
    assert texts[::6] == ["original", "deformed", "corrected", "final"]
    assert texts[19] == f"{result.beta.min():.6f}" and texts[22] == "0"


def test_texts_of_others_are_no_markup(mover: idmesh.Mover) -> None:
    result = mover.update(displacements={"body": np.full((56, 3), [0.0, 0.6, 0.0])}, check=False)
    assert "inverted" in result._repr_html_() or "passes through" in result._repr_html_()
    assert "<idmesh.Result" in repr(result) and "<idmesh.Mover" in repr(mover) and "<idmesh.Mesh" in repr(mover.mesh)


def test_pyvista_gets_cells_families_and_fields(example: idmesh.Mover) -> None:
    pytest.importorskip("pyvista", reason='optional: pip install "idmesh[plot]"')
    result = example.update()
    blocks = result.to_pyvista()
    assert blocks.keys() == ["volume", *example.families]
    volume = blocks["volume"]
    assert np.array_equal(volume.points, result.vertices)
    assert np.array_equal(volume.cells_dict[10], example.tets)
    assert np.array_equal(volume.point_data["displacement"], result.displacement)
    assert np.array_equal(volume.cell_data["beta"], result.beta)
    # pyvista's own volume of the cells.
    assert volume.compute_cell_sizes()["Volume"].min() > 0
    for family in example.families:
        assert blocks[family].n_cells == len(example.family_triangles(family))
        assert blocks[family].n_points == len(example.family_vertices(family))


def test_two_linked_views(example: idmesh.Mover) -> None:
    pytest.importorskip("pyvista", reason='optional: pip install "idmesh[plot]"')
    plotter = example.update().plot(show=False, off_screen=True)
    left, right = plotter.renderers
    assert left.camera is right.camera
    # Wing, trailing edge, wingtip and fuselage move; the symmetry plane slides, but spans the mesh.
    surfaces = [[name for name in view.actors if name.startswith("PolyData")] for view in (left, right)]
    assert [len(names) for names in surfaces] == [4, 4]
    plotter.close()
