"""Opens what idmesh writes with the programs it is written for: a check for developers, not part of tests/run.

    pip install gmsh meshio vtk h5py numpy
    cargo build --release
    python tests/formats/check_with_others.py [target/release/idmesh]

Converts the meshes `small` and `mixed` of tests/data to every format, and compares numbers of vertices and cells and the
box with the original, read by gmsh, meshio, VTK and h5py. Then moves `small` from the encodings that VTK alone writes, and
compares where VTK finds it with the motion from Gmsh's file.
"""

import os
import subprocess
import sys
import tempfile

import gmsh
import h5py
import meshio
import numpy
import vtk
from vtk.util.numpy_support import vtk_to_numpy

here = os.path.dirname(os.path.abspath(__file__))
data = os.path.join(here, "..", "data")
idmesh = sys.argv[1] if len(sys.argv) > 1 else os.path.join(here, "../../target/release/idmesh")
failures = []


def check(what, found, expected):
    good = numpy.allclose(found, expected, rtol=1e-6)
    print("good" if good else "BAD ", what, numpy.round(found, 6))
    if not good:
        failures.append(what)


def by_meshio(path):
    mesh = meshio.read(path)
    names = {"tetra": 0, "pyramid": 1, "wedge": 2, "hexahedron": 3, "triangle": 4, "quad": 5}
    counts = [0] * 6
    for block in mesh.cells:
        if block.type in names:
            counts[names[block.type]] += len(block.data)
    return [len(mesh.points), *counts, *mesh.points.min(axis=0), *mesh.points.max(axis=0)]


def by_gmsh(path):
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.open(path)
    counts = []
    for kind in [4, 7, 6, 5, 2, 3]:
        counts.append(len(gmsh.model.mesh.getElementsByType(kind)[0]))
    tags, points, _ = gmsh.model.mesh.getNodes()
    names = sorted(gmsh.model.getPhysicalName(*group) for group in gmsh.model.getPhysicalGroups(2))
    gmsh.finalize()
    points = numpy.array(points).reshape(-1, 3)
    print("     families:", ", ".join(names))
    return [len(tags), *counts, *points.min(axis=0), *points.max(axis=0)]


def by_vtk(path):
    if path.endswith("polyMesh"):
        case = os.path.join(os.path.dirname(path), "..", "case.foam")
        open(case, "w").close()
        reader = vtk.vtkOpenFOAMReader()
        reader.SetFileName(case)
        reader.Update()
        grid = reader.GetOutput().GetBlock(0)
    else:
        kind = vtk.vtkXMLUnstructuredGridReader if path.endswith("vtu") else vtk.vtkUnstructuredGridReader
        reader = kind()
        reader.SetFileName(path)
        reader.Update()
        grid = reader.GetOutput()
    counts = [0] * 6
    kinds = {10: 0, 14: 1, 13: 2, 12: 3, 5: 4, 9: 5}
    for cell in range(grid.GetNumberOfCells()):
        counts[kinds[grid.GetCellType(cell)]] += 1
    box = grid.GetBounds()
    return [grid.GetNumberOfPoints(), *counts, *box[0::2], *box[1::2]]


def by_h5py(path):
    counts = [0] * 6
    kinds = {10: 0, 12: 1, 14: 2, 17: 3, 5: 4, 7: 5}
    with h5py.File(path) as file:
        zone = file["Base/Zone"]
        points = numpy.array([zone[f"GridCoordinates/Coordinate{axis}/ data"] for axis in "XYZ"]).T
        for node in zone.values():
            if node.attrs.get("label") == b"Elements_t":
                first, last = node["ElementRange/ data"]
                counts[kinds[node[" data"][0]]] += last - first + 1
        print("     families:", ", ".join(sorted(zone["ZoneBC"])))
    return [len(points), *counts, *points.min(axis=0), *points.max(axis=0)]


def moved_points(folder, mesh, families):
    """Where VTK finds the vertices of `small`, moved from a file to other profiles."""
    output = os.path.join(folder, "moved.vtu")
    roles = ["wing", "trailing-edge", "wingtip", "carenage", "plane", "fixed"]
    profiles = os.path.join(os.path.abspath(data), "profiles")
    case = f'mesh = "{mesh}"\n[profiles."{families[0]}"]\nnew = "{profiles}/planform_2.csv"\nold = "{profiles}/old_2.csv"\n'
    case += "".join(f'[family."{name}"]\nrole = "{role}"\n' for name, role in zip(families, roles))
    with open(os.path.join(folder, "case.toml"), "w") as out:
        out.write(case + f'[output]\nmesh = "{output}"\n')
    subprocess.check_call([idmesh, "-q", "run", os.path.join(folder, "case.toml"), "--backend", "cpu"], stdout=subprocess.DEVNULL)
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(output)
    reader.Update()
    return vtk_to_numpy(reader.GetOutput().GetPoints().GetData())


with tempfile.TemporaryDirectory() as folder:
    plain = os.path.join(folder, "small.msh")
    with open(plain, "wb") as out:
        out.write(subprocess.check_output(["gzip", "-dc", os.path.join(data, "small.msh.gz")]))
    names = ["wing", "trailing_edge", "wingtip", "carenage", "symmetry", "farfield"]
    reference = moved_points(folder, plain, names)
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(os.path.join(data, "small.vtu"))
    reader.Update()
    kinds = [vtk.vtkZLibDataCompressor, vtk.vtkLZ4DataCompressor, vtk.vtkLZMADataCompressor, lambda: None]
    for compressor in [kind() for kind in kinds]:
        for mode in [vtk.vtkXMLWriter.Appended, vtk.vtkXMLWriter.Binary, vtk.vtkXMLWriter.Ascii]:
            if mode == vtk.vtkXMLWriter.Ascii and compressor:
                continue
            writer = vtk.vtkXMLUnstructuredGridWriter()
            writer.SetFileName(os.path.join(folder, "vtk.vtu"))
            writer.SetInputData(reader.GetOutput())
            writer.SetDataMode(mode)
            writer.SetCompressor(compressor)
            writer.Write()
            found = moved_points(folder, writer.GetFileName(), [f"surface {n}" for n in range(1, 7)])
            name = compressor.GetClassName() if compressor else "no compression"
            # Text of VTK has eleven digits.
            exact = 1e-9 if mode == vtk.vtkXMLWriter.Ascii else 0
            check(f"small moved from VTK, mode {mode}, {name}", [float(abs(found - reference).max() > exact)], [0.0])

for source in ["small.msh.gz", "mixed/gmsh.v41.binary.msh"]:
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(data, source)
        if path.endswith(".gz"):
            plain = os.path.join(folder, "original.msh")
            with open(plain, "wb") as out:
                out.write(subprocess.check_output(["gzip", "-dc", path]))
            path = plain
        expected = by_gmsh(path)
        foam = os.path.join(folder, "constant", "polyMesh")
        os.makedirs(os.path.dirname(foam))
        targets = [
            ("a.msh", [by_gmsh, by_meshio]),
            ("a.vtu", [by_vtk, by_meshio]),
            ("a.vtk", [by_vtk, by_meshio]),
            # gmsh 4.15.2 reads neither prisms nor pyramids from Medit files.
            ("a.mesh", [by_meshio] if "mixed" in source else [by_gmsh, by_meshio]),
            ("a.meshb", [by_meshio]),
            ("a.su2", [by_meshio]),
            *[(f"a.{kind}ugrid", [by_meshio]) for kind in ["", "b8.", "lb8.", "b4.", "lb4.", "b8l.", "lb8l."]],
            ("a.cgns", [by_gmsh, by_h5py]),
            (foam, [by_vtk]),
        ]
        for name, readers in targets:
            target = os.path.join(folder, name)
            subprocess.check_call([idmesh, "-q", "convert", path, target])
            for reader in readers:
                what = f"{source} to {os.path.basename(name)} by {reader.__name__[3:]}"
                try:
                    found = reader(target)
                except Exception as error:
                    print("BAD ", what, error)
                    failures.append(what)
                    continue
                # OpenFOAM's reader gives the inside only.
                drop = slice(5, 7) if name == foam else slice(0, 0)
                check(what, numpy.delete(found, drop), numpy.delete(expected, drop))
print(f"{len(failures)} bad")
sys.exit(len(failures) > 0)
