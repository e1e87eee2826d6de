"""Writes the Gmsh golden files of tests/formats.rs beside this script: pip install gmsh, python make_gmsh.py.

A box of 2 x 1 x 1 with three surface groups: "wing skin" (a name with a space, given with a reversed surface),
"far field" and number 7, which has no name. Node tags are spread out and shuffled, one pair of faces is periodic.
"""

import os

import gmsh

here = os.path.dirname(os.path.abspath(__file__))


def build():
    gmsh.clear()
    gmsh.model.add("box")
    gmsh.model.occ.addBox(0, 0, 0, 2, 1, 1)
    gmsh.model.occ.synchronize()
    # Surfaces of an OpenCASCADE box: 1 and 2 at x = 0, 2; 3 and 4 at y = 0, 1; 5 and 6 at z = 0, 1.
    gmsh.model.addPhysicalGroup(2, [-1], 30, name="wing skin")
    gmsh.model.addPhysicalGroup(2, [2, 3, 4, 5], 4, name="far field")
    gmsh.model.addPhysicalGroup(2, [6], 7)
    gmsh.model.addPhysicalGroup(1, [1], 8, name="an edge")
    gmsh.model.addPhysicalGroup(3, [1], 10, name="fluid")
    gmsh.option.setNumber("Mesh.MeshSizeMin", 0.8)
    shift = [1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 1, 0, 0, 0, 0, 1]
    gmsh.model.mesh.setPeriodic(2, [4], [3], shift)
    gmsh.model.mesh.generate(3)


def save(name, version, binary, parametric=0):
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", binary)
    gmsh.option.setNumber("Mesh.SaveParametric", parametric)
    gmsh.write(os.path.join(here, name))


gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
build()
save("box.v41.ascii.msh", 4.1, 0)
save("box.v41.binary.msh", 4.1, 1)
save("box.v41.parametric.ascii.msh", 4.1, 0, 1)
save("box.v41.parametric.binary.msh", 4.1, 1, 1)
save("box.v22.ascii.msh", 2.2, 0)
save("box.v22.binary.msh", 2.2, 1)
save("box.v22.parametric.ascii.msh", 2.2, 0, 1)
save("box.v22.parametric.binary.msh", 2.2, 1, 1)

tags, _, _ = gmsh.model.mesh.getNodes()
# 7919 is prime, so the tags are all different, in no order, and far apart.
gmsh.model.mesh.renumberNodes(tags, [1000 + (int(tag) * 7919) % 100003 for tag in tags])
save("box.v41.sparse.ascii.msh", 4.1, 0)
save("box.v41.sparse.binary.msh", 4.1, 1)
save("box.v22.sparse.binary.msh", 2.2, 1)

build()
gmsh.model.mesh.partition(2)
save("box.v41.partitioned.ascii.msh", 4.1, 0)
save("box.v41.partitioned.binary.msh", 4.1, 1)
gmsh.option.setNumber("Mesh.SaveAll", 1)
save("box.v41.partitioned.all.ascii.msh", 4.1, 0)
gmsh.finalize()
