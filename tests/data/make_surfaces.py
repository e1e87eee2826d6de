"""Writes the golden files `surfaces/*` of tests/displaced_surfaces.rs: pip install gmsh meshio pyvista pandas,
python make_surfaces.py.

The family "wingtip" of small.vtu, displaced by (0.02 z, 0.01 x y, 0.05 y - 0.03 x x), as other programs write it.
"""

import os

import gmsh
import meshio
import numpy
import pandas
import pyvista
import vtk

here = os.path.dirname(os.path.abspath(__file__))
out = os.path.join(here, "surfaces")
mesh = meshio.read(os.path.join(here, "small.vtu"))
index = [block.type for block in mesh.cells].index("triangle")
tags = next(data for name, data in mesh.cell_data.items() if name in ("gmsh:physical", "family"))[index]
triangles = mesh.cells[index].data
sizes = {tag: int((tags == tag).sum()) for tag in set(tags.tolist())}
tip = next(tag for tag, size in sizes.items() if size == 39)
triangles = triangles[tags == tip]
used = numpy.unique(triangles)
number = numpy.full(len(mesh.points), -1)
number[used] = numpy.arange(len(used))
cells = number[triangles]
original = mesh.points[used]
x, y, z = original.T
displacement = numpy.stack([0.02 * z, 0.01 * x * y, 0.05 * y - 0.03 * x * x], axis=1)
moved = original + displacement
shuffle = numpy.random.default_rng(5).permutation(len(used))
place = numpy.argsort(shuffle)


def path(name):
    return os.path.join(out, name)


def poly(points, faces):
    return pyvista.PolyData(points, numpy.hstack([numpy.full((len(faces), 1), 3), faces]).ravel())


def write_poly(surface, name, mode, compressor=None, big=False, encode=False):
    writer = vtk.vtkXMLPolyDataWriter()
    writer.SetFileName(path(name))
    writer.SetInputData(surface)
    writer.SetDataMode(mode)
    writer.SetCompressor(compressor)
    writer.SetEncodeAppendedData(encode)
    if big:
        writer.SetByteOrderToBigEndian()
    # Small blocks, so that there are several of them.
    writer.SetBlockSize(96)
    writer.Write()


def with_vtk():
    ascii, inline, appended = vtk.vtkXMLWriter.Ascii, vtk.vtkXMLWriter.Binary, vtk.vtkXMLWriter.Appended
    plain = poly(moved, cells)
    write_poly(plain, "vtk.ascii.vtp", ascii)
    write_poly(plain, "vtk.inline.vtp", inline)
    write_poly(plain, "vtk.raw.big.vtp", appended, big=True)
    write_poly(plain, "vtk.raw.zlib.vtp", appended, vtk.vtkZLibDataCompressor())
    write_poly(plain, "vtk.base64.lz4.vtp", appended, vtk.vtkLZ4DataCompressor(), encode=True)
    # Other points and triangles first, with normals.
    order = poly(moved[shuffle], place[cells][::-1]).compute_normals(split_vertices=False, auto_orient_normals=False)
    write_poly(order, "vtk.shuffled.vtp", appended)
    for name, kind in [("vtk.ascii.stl", "ascii"), ("vtk.binary.stl", "binary")]:
        writer = vtk.vtkSTLWriter()
        writer.SetFileName(path(name))
        writer.SetInputData(plain)
        writer.SetFileTypeToASCII() if kind == "ascii" else writer.SetFileTypeToBinary()
        writer.Write()


def with_pyvista():
    surface = poly(original[shuffle], place[cells])
    surface.point_data["displacement"] = displacement[shuffle]
    surface.save(path("pyvista.at-rest.vtp"))
    surface.warp_by_vector("displacement").save(path("pyvista.warped.vtp"))
    surface = poly(moved[shuffle], place[cells])
    surface.point_data["original"] = original[shuffle]
    surface.save(path("pyvista.original.vtp"))
    grid = surface.cast_to_unstructured_grid()
    grid.save(path("pyvista.original.vtu"))
    # Cells with points of their own.
    apart = pyvista.PolyData(grid.separate_cells().extract_surface())
    apart.save(path("pyvista.apart.vtp"))
    apart.clear_data()
    apart.save(path("pyvista.apart.bare.vtp"))
    # The family by its number, then its surface, by VTK's filters.
    whole = pyvista.read(os.path.join(here, "small.vtu"))
    name = next(name for name in whole.cell_data if name in ("gmsh:physical", "family"))
    family = whole.threshold((tip, tip), scalars=name).extract_surface()
    x, y, z = family.points.T.astype(float)
    assert len(family.points) == len(used)
    family.points = family.points + numpy.stack([0.02 * z, 0.01 * x * y, 0.05 * y - 0.03 * x * x], axis=1)
    family.clear_data()
    family.save(path("pyvista.threshold.vtp"))


def with_meshio():
    surface = meshio.Mesh(moved, [("triangle", cells)])
    meshio.write(path("meshio.vtu"), surface)
    meshio.write(path("meshio.ascii.vtu"), surface, binary=False)
    meshio.write(path("meshio.ascii.stl"), surface, binary=False)
    meshio.write(path("meshio.binary.stl"), surface, binary=True)
    meshio.write(path("meshio.msh"), surface, file_format="gmsh")
    meshio.write(path("meshio.v22.msh"), surface, file_format="gmsh22", binary=False)
    at_rest = meshio.Mesh(original, [("triangle", cells)], point_data={"displacement": displacement})
    meshio.write(path("meshio.at-rest.vtu"), at_rest)


def with_gmsh():
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.add("tip")
    gmsh.model.addDiscreteEntity(2, 1)
    tags = list(range(101, 101 + len(used)))
    gmsh.model.mesh.addNodes(2, 1, tags, moved.ravel())
    gmsh.model.mesh.addElementsByType(1, 2, [], (cells + 101).ravel())
    for version, binary in [(4.1, 0), (4.1, 1), (2.2, 1)]:
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", binary)
        kind = ["ascii", "binary"][binary]
        gmsh.write(path(f"gmsh.v{str(version).replace('.', '')}.{kind}.msh"))
    gmsh.option.setNumber("Mesh.Binary", 1)
    gmsh.write(path("gmsh.binary.stl"))
    gmsh.finalize()


def tables():
    frame = pandas.DataFrame(numpy.hstack([original, displacement]), columns=["x", "y", "z", "dx", "dy", "dz"])
    frame.iloc[shuffle].to_csv(path("pandas.index.csv"))
    frame.to_csv(path("pandas.semicolon.csv"), sep=";", index=False)
    frame.to_csv(path("pandas.tab.tsv"), sep="\t", index_label="id")
    frame.to_csv(path("pandas.blank.dat"), sep=" ", index=False)
    numpy.savetxt(path("numpy.dat"), frame.values, header="x y z dx dy dz")
    numpy.savetxt(path("numpy.units.txt"), frame.values, header="x [m], y [m], z [m], dx [m], dy [m], dz [m]", delimiter=", ")
    # VTK's writer of tables, with the names of columns that ParaView gives.
    table = vtk.vtkTable()
    columns = [("Point ID", numpy.arange(len(used)))]
    columns += [(f"displacement:{axis}", displacement[:, axis]) for axis in range(3)]
    columns += [(f"Points:{axis}", original[:, axis]) for axis in range(3)]
    for name, values in columns:
        array = vtk.vtkIdTypeArray() if name == "Point ID" else vtk.vtkDoubleArray()
        array.SetName(name)
        for value in values:
            array.InsertNextValue(value)
        table.AddColumn(array)
    writer = vtk.vtkDelimitedTextWriter()
    writer.SetFileName(path("vtk.csv"))
    writer.SetInputData(table)
    writer.Write()


with_vtk()
with_pyvista()
with_meshio()
with_gmsh()
tables()
