"""Writes `sections/*` for tests/profile_files.rs: pip install vtk, python make_sections.py.

Two diamonds of chord 1 and 2 in the planes y = 0 and y = 3: as segments of a slice, points and segments shuffled.
"""

import os

import vtk

here = os.path.join(os.path.dirname(os.path.abspath(__file__)), "sections")
diamond = [(1, 0), (0.5, 0.1), (0, 0), (0.5, -0.1)]
points = vtk.vtkPoints()
points.SetDataTypeToDouble()
for index in [2, 0, 3, 1]:
    points.InsertNextPoint(diamond[index][0], 0, diamond[index][1])
for index in [1, 3, 0, 2]:
    points.InsertNextPoint(2 * diamond[index][0], 3, 2 * diamond[index][1])
lines = vtk.vtkCellArray()
for a, b in [(0, 3), (1, 2), (5, 6), (4, 7), (3, 1), (2, 0), (6, 4), (7, 5)]:
    line = vtk.vtkLine()
    line.GetPointIds().SetId(0, a)
    line.GetPointIds().SetId(1, b)
    lines.InsertNextCell(line)
data = vtk.vtkPolyData()
data.SetPoints(points)
data.SetLines(lines)
writer = vtk.vtkXMLPolyDataWriter()
writer.SetFileName(os.path.join(here, "diamonds.vtp"))
writer.SetInputData(data)
writer.Write()
writer = vtk.vtkPolyDataWriter()
writer.SetFileName(os.path.join(here, "diamonds.vtk"))
writer.SetInputData(data)
writer.SetFileTypeToBinary()
writer.Write()

# Both diamonds again, each in a data set of its own, put together: VTK then numbers the cells by its type of indices.
slices = vtk.vtkAppendPolyData()
for first in (0, 4):
    chosen = vtk.vtkCellArray()
    for a, b in [(0, 3), (1, 2), (3, 1), (2, 0)]:
        chosen.InsertNextCell(2, [a, b])
    corners = vtk.vtkPoints()
    corners.SetDataTypeToDouble()
    for index in range(first, first + 4):
        corners.InsertNextPoint(points.GetPoint(index))
    one = vtk.vtkPolyData()
    one.SetPoints(corners)
    one.SetLines(chosen)
    slices.AddInputData(one)
for name, kind in (("appended.ascii.vtk", "SetFileTypeToASCII"), ("appended.binary.vtk", "SetFileTypeToBinary")):
    writer = vtk.vtkPolyDataWriter()
    writer.SetFileName(os.path.join(here, name))
    writer.SetInputConnection(slices.GetOutputPort())
    getattr(writer, kind)()
    writer.Write()
