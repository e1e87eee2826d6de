"""Writes the golden files `mixed/*` of tests/formats: pip install gmsh meshio vtk h5py, python make_mixed.py.

One hexahedron (the unit cube), a prism on its face x = 1, a pyramid on its top and a tet on the pyramid: volume
1 + 0.5 + 0.2 + 0.1. Two families: "wing skin" is the face x = 0 of the cube, "far field" all the rest.
"""

import os
import struct

import gmsh
import meshio
import numpy
import vtk

# The ascii ugrid of meshio 5.3.5 holds what numpy prints.
numpy.set_printoptions(legacy="1.25")
here = os.path.join(os.path.dirname(os.path.abspath(__file__)), "mixed")
points = [
    (0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1),
    (0.5, 0.5, 1.6), (2, 0, 1 / 3), (2, 1, 1 / 3), (0.5, -0.7, 1.36),
]  # fmt: skip
hexahedron = [0, 1, 2, 3, 4, 5, 6, 7]
pyramid = [4, 5, 6, 7, 8]
prism = [1, 5, 9, 2, 6, 10]
tet = [4, 5, 8, 11]
wing_quads = [[0, 4, 7, 3]]
far_quads = [[0, 3, 2, 1], [0, 1, 5, 4], [3, 7, 6, 2], [1, 2, 10, 9], [9, 10, 6, 5]]
far_triangles = [[1, 9, 5], [2, 6, 10], [5, 6, 8], [6, 7, 8], [7, 4, 8], [4, 5, 11], [5, 8, 11], [8, 4, 11]]


def with_gmsh():
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.add("mixed")
    mesh = gmsh.model.mesh
    gmsh.model.addDiscreteEntity(2, 1)
    gmsh.model.addDiscreteEntity(2, 2)
    gmsh.model.addDiscreteEntity(3, 1, [1, 2])
    mesh.addNodes(3, 1, list(range(1, 13)), [x for point in points for x in point])
    tag = 1

    def add(dimension, entity, kind, elements):
        nonlocal tag
        tags = list(range(tag, tag + len(elements)))
        mesh.addElements(dimension, entity, [kind], [tags], [[v + 1 for e in elements for v in e]])
        tag += len(elements)

    add(2, 1, 3, wing_quads)
    add(2, 2, 3, far_quads)
    add(2, 2, 2, far_triangles)
    add(3, 1, 4, [tet])
    add(3, 1, 5, [hexahedron])
    add(3, 1, 6, [prism])
    add(3, 1, 7, [pyramid])
    gmsh.model.addPhysicalGroup(2, [1], 1, name="wing skin")
    gmsh.model.addPhysicalGroup(2, [2], 2, name="far field")
    gmsh.model.addPhysicalGroup(3, [1], 3, name="fluid")
    for version in [4.1, 2.2]:
        for binary in [0, 1]:
            gmsh.option.setNumber("Mesh.MshFileVersion", version)
            gmsh.option.setNumber("Mesh.Binary", binary)
            name = f"gmsh.v{version}.{['ascii', 'binary'][binary]}.msh".replace("v4.1", "v41").replace("v2.2", "v22")
            gmsh.write(os.path.join(here, name))
    for binary in [0, 1]:
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.write(os.path.join(here, f"gmsh.{['ascii', 'binary'][binary]}.vtk"))
    gmsh.option.setNumber("Mesh.Binary", 0)
    for extension in ["su2", "cgns"]:
        gmsh.write(os.path.join(here, f"gmsh.{extension}"))
    gmsh.finalize()


def with_meshio():
    cells = [
        ("quad", wing_quads + far_quads), ("triangle", far_triangles), ("tetra", [tet]),
        ("hexahedron", [hexahedron]), ("wedge", [prism]), ("pyramid", [pyramid]),
    ]  # fmt: skip
    family = [numpy.array(x, dtype=numpy.int32) for x in [[1] + 5 * [2], 8 * [2], [10], [10], [10], [10]]]
    mesh = meshio.Mesh(numpy.array(points, dtype=float), cells, cell_data={"family": family})
    mesh.point_data["x"] = mesh.points[:, 0].copy()

    def write(name, **options):
        meshio.write(os.path.join(here, name), mesh, **options)

    write("meshio.ascii.vtu", binary=False)
    write("meshio.zlib.vtu")
    write("meshio.plain.vtu", compression=None)
    write("meshio.ascii.vtk", file_format="vtk51", binary=False)
    write("meshio.binary.vtk", file_format="vtk51")
    # meshio 5.3.5 writes no references of faces but 1: one family.
    one_family = meshio.Mesh(mesh.points, cells)
    for kind in ["", "b8.", "lb8.", "b4.", "lb4.", "b8l.", "lb8l."]:
        meshio.write(os.path.join(here, f"meshio.{kind}ugrid"), one_family)
    # meshio 5.3.5 says wrong lengths of Fortran's records: 7 counts are one, the rest is another.
    plain = open(os.path.join(here, "meshio.lb8.ugrid"), "rb").read()
    with open(os.path.join(here, "records.lr8.ugrid"), "wb") as out:
        for record in [plain[:28], plain[28:]]:
            out.write(struct.pack("<i", len(record)) + record + struct.pack("<i", len(record)))
    write("meshio.meshb")
    write("meshio.mesh")
    single = meshio.Mesh(mesh.points.astype(numpy.float32), cells, cell_data={"family": family})
    meshio.write(os.path.join(here, "meshio.single.vtu"), single)


def with_vtk():
    grid = vtk.vtkUnstructuredGrid()
    places = vtk.vtkPoints()
    places.SetDataTypeToDouble()
    for point in points:
        places.InsertNextPoint(point)
    grid.SetPoints(places)
    family = vtk.vtkIntArray()
    family.SetName("family")
    height = vtk.vtkDoubleArray()
    height.SetName("height")
    for kind, number, elements in [
        (vtk.VTK_QUAD, 1, wing_quads), (vtk.VTK_QUAD, 2, far_quads), (vtk.VTK_TRIANGLE, 2, far_triangles),
        (vtk.VTK_TETRA, 0, [tet]), (vtk.VTK_HEXAHEDRON, 0, [hexahedron]), (vtk.VTK_WEDGE, 0, [prism]),
        (vtk.VTK_PYRAMID, 0, [pyramid]),
    ]:  # fmt: skip
        for element in elements:
            grid.InsertNextCell(kind, len(element), element)
            family.InsertNextValue(number)
            height.InsertNextValue(number / 7)
    grid.GetCellData().AddArray(height)
    grid.GetCellData().AddArray(family)
    z = vtk.vtkDoubleArray()
    z.SetName("z")
    for point in points:
        z.InsertNextValue(point[2])
    grid.GetPointData().SetScalars(z)

    def write(name, mode, compressor=None, wide=False, encode=False, big=False, pieces=1):
        writer = vtk.vtkXMLUnstructuredGridWriter()
        writer.SetFileName(os.path.join(here, name))
        if pieces == 1:
            writer.SetInputData(grid)
        else:
            # Gives each piece points of its own, in single precision.
            parts = vtk.vtkExtractUnstructuredGridPiece()
            parts.CreateGhostCellsOff()
            parts.SetInputData(grid)
            writer.SetInputConnection(parts.GetOutputPort())
            writer.SetNumberOfPieces(pieces)
        writer.SetDataMode(mode)
        writer.SetCompressor(compressor)
        if wide:
            writer.SetHeaderTypeToUInt64()
        else:
            writer.SetHeaderTypeToUInt32()
        writer.SetEncodeAppendedData(encode)
        if big:
            writer.SetByteOrderToBigEndian()
        # Small blocks, so that there are several of them.
        writer.SetBlockSize(96)
        writer.Write()

    ascii, inline, appended = vtk.vtkXMLWriter.Ascii, vtk.vtkXMLWriter.Binary, vtk.vtkXMLWriter.Appended
    zlib = vtk.vtkZLibDataCompressor()
    write("vtk.ascii.vtu", ascii)
    write("vtk.inline.vtu", inline)
    write("vtk.inline.zlib.vtu", inline, zlib, wide=True)
    write("vtk.raw.vtu", appended)
    write("vtk.raw.big.vtu", appended, wide=True, big=True)
    write("vtk.raw.zlib.vtu", appended, zlib)
    write("vtk.base64.vtu", appended, encode=True, wide=True)
    write("vtk.base64.zlib.vtu", appended, zlib, encode=True)
    write("vtk.lz4.vtu", appended, vtk.vtkLZ4DataCompressor())
    write("vtk.lzma.vtu", appended, vtk.vtkLZMADataCompressor())
    write("vtk.inline.lz4.vtu", inline, vtk.vtkLZ4DataCompressor(), wide=True)
    write("vtk.pieces.ascii.vtu", ascii, pieces=2)
    write("vtk.pieces.raw.vtu", appended, pieces=3)
    write("vtk.pieces.zlib.vtu", appended, zlib, pieces=2)
    for name, ascii_mode, version in [
        ("vtk.ascii.vtk", True, 51), ("vtk.binary.vtk", False, 51),
        ("vtk.42.ascii.vtk", True, 42), ("vtk.42.binary.vtk", False, 42),
    ]:  # fmt: skip
        writer = vtk.vtkUnstructuredGridWriter()
        writer.SetFileName(os.path.join(here, name))
        writer.SetInputData(grid)
        writer.SetFileVersion(version)
        if ascii_mode:
            writer.SetFileTypeToASCII()
        else:
            writer.SetFileTypeToBinary()
        writer.Write()


def foam(folder, binary):
    """A polyMesh folder after the OpenFOAM user guide; VTK's reader of OpenFOAM must find the same cells in it."""
    faces_of = {
        4: [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)],
        5: [(0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)],
        6: [(0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)],
        8: [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)],
    }
    found = {}
    for cell, corners in enumerate([hexahedron, prism, pyramid, tet]):
        for face in faces_of[len(corners)]:
            face = [corners[place] for place in face]
            found.setdefault(tuple(sorted(face)), []).append((cell, face))
    inside = sorted((sides for sides in found.values() if len(sides) == 2), key=lambda sides: (sides[0][0], sides[1][0]))
    patches = [found[tuple(sorted(face))] for face in wing_quads + far_quads + far_triangles]
    faces = [sides[0][1] for sides in inside + patches]
    owner = [sides[0][0] for sides in inside + patches]
    neighbour = [sides[1][0] for sides in inside]
    path = os.path.join(here, folder, "constant", "polyMesh")
    os.makedirs(path, exist_ok=True)

    def write(name, kind, count, body):
        form = "binary" if binary else "ascii"
        with open(os.path.join(path, name), "wb") as out:
            header = f"""/*---- by hand, after the user guide ----*/
FoamFile
{{
    version     2.0;
    format      {form};
    arch        "LSB;label=32;scalar=64";
    class       {kind};
    note        "nPoints: {len(points)}; nCells: 4";
    location    "constant/polyMesh";
    object      {name};
}}
// * * * //

"""
            out.write(header.encode() + (b"" if count is None else f"{count}\n(".encode()) + body + b")\n\n// ** //\n")

    def ints(values):
        return struct.pack(f"<{len(values)}i", *values)

    if binary:
        write("points", "vectorField", len(points), struct.pack(f"<{3 * len(points)}d", *[x for p in points for x in p]))
        starts = [0]
        for face in faces:
            starts.append(starts[-1] + len(face))
        corners = [v for face in faces for v in face]
        body = f"{len(starts)}\n(".encode() + ints(starts) + f")\n{len(corners)}\n(".encode() + ints(corners)
        write("faces", "faceCompactList", None, body)
        write("owner", "labelList", len(owner), ints(owner))
        write("neighbour", "labelList", len(neighbour), ints(neighbour))
    else:
        lines = lambda texts: ("\n" + "\n".join(texts) + "\n").encode()
        write("points", "vectorField", len(points), lines("(%r %r %r)" % tuple(p) for p in points))
        write("faces", "faceList", len(faces), lines(f"{len(f)}({' '.join(map(str, f))})" for f in faces))
        write("owner", "labelList", len(owner), lines(map(str, owner)))
        write("neighbour", "labelList", len(neighbour), lines(map(str, neighbour)))
    entry = "    %s\n    {\n        type            %s;\n        inGroups        1(%s);\n"
    entry += "        nFaces          %d;\n        startFace       %d;\n    }\n"
    body = entry % ("wing_skin", "wall", "wall", 1, len(inside)) + entry % ("far_field", "patch", "free", 13, len(inside) + 1)
    write("boundary", "polyBoundaryMesh", 2, b"\n" + body.encode())
    case = os.path.join(here, folder, "case.foam")
    open(case, "w").close()
    reader = vtk.vtkOpenFOAMReader()
    reader.SetFileName(case)
    reader.Update()
    grid = reader.GetOutput().GetBlock(0)
    assert sorted(grid.GetCellType(cell) for cell in range(grid.GetNumberOfCells())) == [10, 12, 13, 14]
    os.remove(case)


foam("foam.ascii", False)
foam("foam.binary", True)
with_gmsh()
with_meshio()
with_vtk()
