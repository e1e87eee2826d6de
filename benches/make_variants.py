"""Writes a mesh of tets in the variants of formats that idmesh reads, but does not write new: for `--bench formats`.

    pip install gmsh vtk numpy
    python benches/make_variants.py MESH.msh FOLDER [target/release/idmesh]

gmsh and VTK write their own formats, the latter from idmesh's VTU file; a binary OpenFOAM folder is put together from idmesh's
ascii one. Prints the paths, as the benchmark takes them.
"""

import os
import re
import subprocess
import sys

import gmsh
import numpy
import vtk

mesh, folder = sys.argv[1:3]
idmesh = sys.argv[3] if len(sys.argv) > 3 else os.path.join(os.path.dirname(__file__), "../target/release/idmesh")
written = []


def path(name):
    written.append(os.path.join(folder, name))
    return written[-1]


def convert(target):
    subprocess.check_call([idmesh, "-q", "convert", mesh, target])
    return target


def with_gmsh():
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.open(mesh)
    for version, name in [(4.1, "msh41"), (2.2, "msh22")]:
        for binary in [0, 1]:
            gmsh.option.setNumber("Mesh.MshFileVersion", version)
            gmsh.option.setNumber("Mesh.Binary", binary)
            gmsh.write(path(f"{name}.{['ascii', 'binary'][binary]}.msh"))
    gmsh.finalize()


def with_vtk():
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(convert(os.path.join(folder, "plain.vtu")))
    reader.Update()
    for compressor, name in [
        (None, "none"),
        (vtk.vtkZLibDataCompressor(), "zlib"),
        (vtk.vtkLZ4DataCompressor(), "lz4"),
        (vtk.vtkLZMADataCompressor(), "lzma"),
    ]:
        for mode, word in [(vtk.vtkXMLWriter.Appended, "raw"), (vtk.vtkXMLWriter.Binary, "base64"), (vtk.vtkXMLWriter.Ascii, "ascii")]:
            if mode != vtk.vtkXMLWriter.Appended and name in ("lz4", "lzma") or mode == vtk.vtkXMLWriter.Ascii and name != "none":
                continue
            # One that has written raw arrays goes on with them where it should write base64.
            writer = vtk.vtkXMLUnstructuredGridWriter()
            writer.SetInputData(reader.GetOutput())
            writer.SetFileName(path(f"vtk.{word}.{name}.vtu"))
            writer.SetEncodeAppendedData(False)
            writer.SetDataMode(mode)
            writer.SetCompressor(compressor)
            writer.Write()
    legacy = vtk.vtkUnstructuredGridWriter()
    legacy.SetInputData(reader.GetOutput())
    for name, kind in [("ascii", vtk.VTK_ASCII), ("binary", vtk.VTK_BINARY)]:
        legacy.SetFileName(path(f"vtk.{name}.vtk"))
        legacy.SetFileType(kind)
        legacy.Write()


def binary_foam():
    source = convert(os.path.join(folder, "polyMesh"))
    target = path("binary/polyMesh")
    os.makedirs(target, exist_ok=True)
    for name, dtype in [("points", float), ("faces", "<i4"), ("owner", "<i4"), ("neighbour", "<i4")]:
        with open(os.path.join(source, name), "rb") as file:
            header, count, body = re.fullmatch(rb"(.*?\})\s*(\d+)\s*\((.*)\)\s*", file.read(), re.S).groups()
        numbers = numpy.array(body.translate(bytes.maketrans(b"()", b"  ")).split(), dtype)
        parts = [numbers]
        if name == "faces":
            # Every face is a triangle: the 3 before its vertices goes.
            corners = numbers.reshape(-1, 4)[:, 1:].flatten()
            parts = [numpy.arange(0, len(corners) + 1, 3, dtype), corners]
            header = header.replace(b"faceList", b"faceCompactList")
        with open(os.path.join(target, name), "wb") as file:
            file.write(header.replace(b"format ascii;", b'format binary; arch "LSB;label=32;scalar=64";') + b"\n")
            for part in parts:
                count = len(part) // (3 if name == "points" else 1)
                file.write(f"{count}\n(".encode() + part.tobytes() + b")\n")
    with open(os.path.join(source, "boundary")) as file, open(os.path.join(target, "boundary"), "w") as out:
        out.write(file.read())


os.makedirs(folder, exist_ok=True)
with_gmsh()
with_vtk()
binary_foam()
print(*written)
