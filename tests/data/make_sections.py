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
