"""Draws docs/src/images/wing-body.png: the mesh of the example before and after.

    idmesh run examples/wing-body/case.toml --out target/picture
    pip install pyvista pillow
    python3 docs/picture.py target/picture/moved.vtu docs/src/images/wing-body.png

The file that `run` writes holds the displacement of every vertex, so one file gives both states.
"""

import sys

import numpy as np
import pyvista as pv
from PIL import Image

CHORD = 2.0  # the wing's root chord, in the unit of the mesh
CUT = 3.5  # where along the span the lower row looks at the tets
SHOWN = [1, 2, 3, 4]  # wing, trailing edge, wingtip and carenage
COLOURS = {"shared": "#c9ced6", "edge": "#3a3f47"}


def main(path, picture):
    pv.OFF_SCREEN = True
    moved = pv.read(path)
    displacement = np.asarray(moved.point_data["displacement"])
    moved.point_data["length"] = np.linalg.norm(displacement, axis=1) / CHORD
    original = moved.copy()
    original.points = moved.points - displacement

    plotter = pv.Plotter(shape=(2, 2), window_size=(1240, 840), border=False)
    limits = [0, float(moved.point_data["length"].max())]
    for column, (title, mesh) in enumerate([("before", original), ("after", moved)]):
        plotter.subplot(0, column)
        plotter.add_text(title, font_size=12, color="black", position="lower_left")
        add_surface(plotter, mesh, column == 1, limits)
        plotter.camera_position = [(-3.0, 9.0, 5.2), (1.0, 1.9, -0.05), (0, 0, 1)]
        plotter.camera.zoom(1.5)
        plotter.subplot(1, column)
        add_section(plotter, mesh, column == 1, limits)
        plotter.enable_parallel_projection()
        plotter.camera_position = [(1.98, -5.0, 0.03), (1.98, CUT, 0.03), (0, 0, 1)]
        plotter.camera.parallel_scale = 0.44
    image = Image.fromarray(plotter.screenshot(return_img=True))
    image.quantize(32, dither=Image.Dither.NONE).save(picture, optimize=True)


def add_surface(plotter, mesh, coloured, limits):
    surface = mesh.extract_cells(
        (mesh.celltypes == pv.CellType.TRIANGLE) & np.isin(mesh.cell_data["family"], SHOWN)
    )
    style = {"show_edges": True, "edge_color": COLOURS["edge"], "line_width": 0.4}
    if not coloured:
        plotter.add_mesh(surface, color=COLOURS["shared"], **style)
        return
    bar = {"title": "displacement / root chord", "color": "black", "fmt": "%.2f", "n_labels": 2,
           "position_x": 0.5, "position_y": 0.03, "width": 0.42, "height": 0.12,
           "title_font_size": 16, "label_font_size": 14}
    plotter.add_mesh(surface, scalars="length", clim=limits, cmap="viridis", scalar_bar_args=bar, **style)


def add_section(plotter, mesh, coloured, limits):
    """The tets that a plane across the span meets."""
    tets = mesh.extract_cells(mesh.celltypes == pv.CellType.TETRA).slice(normal="y", origin=(0, CUT, 0))
    style = {"show_edges": True, "edge_color": COLOURS["edge"], "line_width": 0.4, "lighting": False}
    if coloured:
        plotter.add_mesh(tets, scalars="length", clim=limits, cmap="viridis", show_scalar_bar=False, **style)
    else:
        plotter.add_mesh(tets, color=COLOURS["shared"], **style)


main(*sys.argv[1:])
