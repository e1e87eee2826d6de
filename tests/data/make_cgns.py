"""Writes the golden files `slab.*.cgns` of tests/formats: pip install h5py numpy pycgns, apt install cgns-convert,
python make_cgns.py.

A slab of 2 x 1 x 1 of twelve tets, in CGNS as its programs write it. Two families: "wing" is the face z = 0, "far" all
the rest. h5py writes the nodes as the CGNS library does (groups with tracked order, HDF5 1.8), `adf2hdf` and `hdf2adf`
are the CGNS library itself. pyCGNS writes HDF5 by itself.
"""

import os
import subprocess
import sys

import h5py
import numpy as np

here = os.path.dirname(os.path.abspath(__file__))
points = np.array([(x, y, z) for x in (0.0, 1.0, 2.0) for y in (0.0, 1.0) for z in (0.0, 1.0 / 3)])
# The six tets about a diagonal of each cube.
cubes = [[0, 4, 6, 2, 1, 5, 7, 3], [4, 8, 10, 6, 5, 9, 11, 7]]
paths = [(1, 2), (2, 3), (3, 7), (7, 4), (4, 5), (5, 1)]
tets = np.array([[c[0], c[a], c[b], c[6]] for c in cubes for a, b in paths])


def faces_of(tet):
    a, b, c, d = tet
    return [(a, c, b), (a, b, d), (b, c, d), (a, d, c)]


def boundary(tets):
    count = {}
    for tet in tets:
        for face in faces_of(tet):
            count.setdefault(tuple(sorted(face)), []).append(face)
    return np.array([faces[0] for faces in count.values() if len(faces) == 1])


def node(parent, name, label, kind, data=None, **options):
    group = parent.create_group(name, track_order=True)
    for key, value, length in [("name", name, 33), ("label", label, 33), ("type", kind, 3)]:
        group.attrs.create(key, np.bytes_(value), dtype=h5py.string_dtype("ascii", length))
    group.attrs["flags"] = np.array([1], "i4")
    if data is not None and options.get("compact"):
        create = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        create.set_layout(h5py.h5d.COMPACT)
        space, kind = h5py.h5s.create_simple(data.shape), h5py.h5t.py_create(data.dtype)
        h5py.h5d.create(group.id, b" data", kind, space, create).write(space, space, data)
    elif data is not None:
        group.create_dataset(" data", data=data, **options)
    return group


def text(parent, name, label, words):
    return node(parent, name, label, "C1", np.frombuffer(words.encode(), "i1"))


def whole(parent, name, label, values, **options):
    return node(parent, name, label, "I4", np.array(values, "i4"), **options)


def condition(zone_bc, name, location, numbers):
    bc = text(zone_bc, name, "BC_t", "FamilySpecified" if location == "FaceCenter" else "BCWall")
    text(bc, "GridLocation", "GridLocation_t", location)
    whole(bc, "PointList", "IndexArray_t", np.reshape(numbers, (-1, 1)))
    return bc


def add_zone(base, name, tets, faces, conditions, **options):
    """`faces`: triangles by section; `conditions`: name, location, section or vertices of the slab."""
    used = np.unique(tets)
    number = {vertex: index + 1 for index, vertex in enumerate(used)}
    renumbered = lambda cells: [[number[v] for v in cell] for cell in cells]
    zone = whole(base, name, "Zone_t", [[len(used)], [len(tets)], [0]])
    text(zone, "ZoneType", "ZoneType_t", "Unstructured")
    grid = node(zone, "GridCoordinates", "GridCoordinates_t", "MT")
    for axis in range(3):
        node(grid, "Coordinate" + "XYZ"[axis], "DataArray_t", "R8", points[used, axis], **options)
    first, numbers = 1, {}
    for section, kind, cells in [("tets", 10, tets)] + [(section, 5, cells) for section, cells in faces.items()]:
        last = first + len(cells) - 1
        elements = whole(zone, section, "Elements_t", [kind, 0])
        whole(elements, "ElementRange", "IndexRange_t", [first, last])
        whole(elements, "ElementConnectivity", "DataArray_t", np.ravel(renumbered(cells)), **options)
        numbers[section] = range(first, last + 1)
        first = last + 1
    zone_bc = node(zone, "ZoneBC", "ZoneBC_t", "MT")
    for bc, location, of in conditions:
        held = numbers[of] if isinstance(of, str) else sorted(number[v] for v in of if v in number)
        if len(held) > 0:
            condition(zone_bc, bc, location, held)
    return zone, number


def write(name, fill, libver=("earliest", "v108")):
    path = os.path.join(here, name)
    with h5py.File(path, "w", libver=libver, track_order=True) as file:
        for key, value, length in [("name", "HDF5 MotherNode", 33), ("label", "Root Node of HDF5 File", 33), ("type", "MT", 3)]:
            file.attrs.create(key, np.bytes_(value), dtype=h5py.string_dtype("ascii", length))
        file.create_dataset(" format", data=np.frombuffer(b"IEEE_LITTLE_32\0", "i1"))
        file.create_dataset(" hdf5version", data=np.frombuffer(b"HDF5 Version 1.8.0".ljust(33, b"\0"), "i1"))
        node(file, "CGNSLibraryVersion", "CGNSLibraryVersion_t", "R4", np.array([3.4], "f4"))
        fill(file)
    return path


def add_base(file, name="Base", dimensions=(3, 3)):
    return whole(file, name, "CGNSBase_t", dimensions)


skin = boundary(tets)
is_wing = (points[skin][:, :, 2] == 0).all(axis=1)
sections = {"wing faces": skin[is_wing], "far faces": skin[~is_wing]}
on_faces = [("wing", "FaceCenter", "wing faces"), ("far", "FaceCenter", "far faces")]
wing_vertices, far_vertices = np.unique(skin[is_wing]), np.unique(skin[~is_wing])


def plain(file, **options):
    add_zone(add_base(file), "Slab", tets, sections, on_faces, **options)


def grids(file):
    """Coordinates of other times stand before and after those of the mesh, as names are sorted."""
    zone, _ = add_zone(add_base(file), "Slab", tets, sections, on_faces)
    for name in ("Before", "GridCoordinates#2"):
        grid = node(zone, name, "GridCoordinates_t", "MT")
        for axis in range(3):
            node(grid, "Coordinate" + "XYZ"[axis], "DataArray_t", "R8", points[:, axis] + 10.0)


def surfaces(file):
    """The wing a second time, in a base of surfaces, whose name stands before the other's."""
    plain(file)
    zone, number = add_zone(add_base(file, "Area", (2, 3)), "Wing", tets, {}, [])
    zone["tets"][" data"][0] = 5
    zone["tets"]["ElementRange"][" data"][1] = len(skin[is_wing])
    del zone["tets"]["ElementConnectivity"]
    whole(zone["tets"], "ElementConnectivity", "DataArray_t", np.ravel(skin[is_wing] + 1))
    zone[" data"][1] = len(skin[is_wing])


def on_vertices(file):
    # All faces are one section, and the two ends of the slab share no vertex.
    ends = [np.flatnonzero(points[:, 0] == x) for x in (0, 2)]
    conditions = [("inflow", "Vertex", ends[0]), ("outflow", "Vertex", ends[1])]
    add_zone(add_base(file), "Slab", tets, {"skin": skin}, conditions)


def bare(file, of_zones=False):
    """No section has faces: conditions on the vertices of the two ends."""
    ends = [np.flatnonzero(points[:, 0] == x) for x in (0, 2)]
    conditions = [("inflow", "Vertex", ends[0]), ("outflow", "Vertex", ends[1])]
    base = add_base(file)
    if of_zones:
        for name, half, condition in zip(("Front", "Back"), (tets[:6], tets[6:]), conditions):
            add_zone(base, name, half, {}, [condition])
    else:
        add_zone(base, "Slab", tets, {}, conditions)


def ambiguous(file):
    conditions = [("far", "Vertex", list(far_vertices)), ("wing", "Vertex", list(wing_vertices))]
    add_zone(add_base(file), "Slab", tets, sections, conditions)


def beside(file):
    conditions = [*on_faces, ("nodes", "Vertex", list(wing_vertices)), ("edges", "EdgeCenter", [0, 1])]
    add_zone(add_base(file), "Slab", tets, sections, conditions)


def grows(file):
    # Lists that may grow in both directions have a B-tree of version 2.
    conditions = [*on_faces[:1]]
    zone, _ = add_zone(add_base(file), "Slab", tets, sections, conditions)
    bc = zone["ZoneBC"]["wing"]
    held = bc["PointList"][" data"][()]
    del bc["PointList"][" data"]
    bc["PointList"].create_dataset(" data", data=held, chunks=(2, 1), maxshape=(None, None))


def halves():
    """The tets of each cube, with their faces of the skin by section."""
    for half in (tets[:6], tets[6:]):
        own = {tuple(sorted(face)) for tet in half for face in faces_of(tet)}
        yield half, {
            name: np.array([face for face in faces if tuple(sorted(face)) in own]) for name, faces in sections.items()
        }


def interface():
    """The faces that the two halves share."""
    return np.array([face for face in boundary(tets[:6]) if (points[face][:, 0] == 1).all()])


def zones(file, connected=False, bases=False, apart=0.0):
    """`apart`: how far the points of the second zone are off. Connected zones have the faces between them."""
    numbers, made = [], []
    base = add_base(file)
    for index, (half, faces) in enumerate(halves()):
        parent = add_base(file, "Rear") if bases and index else base
        if connected:
            faces["between"] = interface()
        points[:, 1] += index * apart
        zone, number = add_zone(parent, ["Front", "Back"][index], half, faces, on_faces)
        points[:, 1] -= index * apart
        made.append(zone)
        numbers.append(number)
    if connected:
        common = sorted(set(numbers[0]) & set(numbers[1]))
        for index, zone in enumerate(made):
            connections = node(zone, "ZoneGridConnectivity", "ZoneGridConnectivity_t", "MT")
            joint = text(connections, "joint", "GridConnectivity_t", ["Back", "Front"][index])
            text(joint, "GridConnectivityType", "GridConnectivityType_t", "Abutting1to1")
            text(joint, "GridLocation", "GridLocation_t", "Vertex")
            for name, of in [("PointList", index), ("PointListDonor", 1 - index)]:
                whole(joint, name, "IndexArray_t", [[numbers[of][v]] for v in common])


def twice(file):
    for name in ("Base", "Copy"):
        add_zone(add_base(file, name), "Slab", tets, sections, on_faces)


def with_pycgns():
    """The slab as a tree of pyCGNS, whose arrays are in Fortran's order."""
    import CGNS.MAP

    def node(name, label, value=None, children=()):
        if isinstance(value, str):
            value = np.array([letter.encode() for letter in value], dtype="S1", order="F")
        elif value is not None:
            value = np.asfortranarray(value)
        return [name, value, list(children), label]

    def section(name, kind, cells, first):
        elements = np.array(np.ravel(cells) + 1, "i4")
        last = first + len(cells) - 1
        numbers[name] = np.array([range(first, last + 1)], "i4")
        return node(name, "Elements_t", np.array([kind, 0], "i4"), [
            node("ElementRange", "IndexRange_t", np.array([first, last], "i4")),
            node("ElementConnectivity", "DataArray_t", elements),
        ])  # fmt: skip

    numbers, found = {}, []
    for name, kind, cells in [("tets", 10, tets)] + [(name, 5, cells) for name, cells in sections.items()]:
        found.append(section(name, kind, cells, 1 + sum(held.size for held in numbers.values())))
    axes = [node("Coordinate" + "XYZ"[axis], "DataArray_t", points[:, axis].copy()) for axis in range(3)]
    boundary = [node(bc, "BC_t", "FamilySpecified", [
        node("GridLocation", "GridLocation_t", "FaceCenter"),
        node("PointList", "IndexArray_t", numbers[name]),
        node("FamilyName", "FamilyName_t", bc),
    ]) for bc, _, name in on_faces]  # fmt: skip
    zone = node("Slab", "Zone_t", np.array([[len(points), len(tets), 0]], "i4"), [
        node("ZoneType", "ZoneType_t", "Unstructured"), node("GridCoordinates", "GridCoordinates_t", None, axes),
        *found, node("ZoneBC", "ZoneBC_t", None, boundary),
    ])  # fmt: skip
    families = [node(bc, "Family_t") for bc, *_ in on_faces]
    base = node("Base", "CGNSBase_t", np.array([3, 3], "i4"), [*families, zone])
    version = node("CGNSLibraryVersion", "CGNSLibraryVersion_t", np.array([4.0], "f4"))
    path = os.path.join(here, "slab.pycgns.cgns")
    if os.path.exists(path):
        os.remove(path)
    CGNS.MAP.save(path, node("CGNSTree", "CGNSTree_t", None, [version, base]))


def converted(tool, source, target):
    subprocess.run([tool, source, os.path.join(here, target)], check=True, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    packed = {"chunks": (5,), "compression": "gzip", "shuffle": True, "fletcher32": True}
    write("slab.plain.cgns", plain)
    write("slab.vertices.cgns", on_vertices)
    write("slab.bare.cgns", bare)
    write("slab.bare.zones.cgns", lambda file: bare(file, of_zones=True))
    write("slab.ambiguous.cgns", ambiguous)
    write("slab.beside.cgns", beside)
    write("slab.grids.cgns", grids)
    write("slab.surfaces.cgns", surfaces)
    write("slab.chunked.cgns", lambda file: plain(file, chunks=(5,)))
    write("slab.gzip.cgns", lambda file: plain(file, maxshape=(None,), **packed))
    write("slab.latest.cgns", lambda file: plain(file, **packed), libver=("v110", "v110"))
    write("slab.lzf.cgns", lambda file: plain(file, chunks=(12,), compression="lzf", shuffle=True, fletcher32=True))
    write("slab.growing.cgns", lambda file: plain(file, chunks=(5,), maxshape=(None,)), libver=("v110", "v110"))
    write("slab.grows.cgns", grows, libver=("v110", "v110"))
    write("slab.compact.cgns", lambda file: plain(file, compact=True), libver=("v110", "v110"))
    write("slab.zones.cgns", zones)
    write("slab.joined.cgns", lambda file: zones(file, connected=True, apart=1e-9))
    write("slab.bases.cgns", lambda file: zones(file, bases=True))
    write("slab.twice.cgns", twice)
    with_pycgns()
    converted("hdf2adf", os.path.join(here, "slab.plain.cgns"), "slab.adf.cgns")
    converted("hdf2adf", os.path.join(here, "slab.joined.cgns"), "slab.adf.joined.cgns")
    converted("hdf2adf", os.path.join(here, "slab.grids.cgns"), "slab.adf.grids.cgns")
    converted("hdf2adf", os.path.join(here, "slab.bare.cgns"), "slab.adf.bare.cgns")
    converted("adf2hdf", os.path.join(here, "slab.adf.cgns"), "slab.library.cgns")
    sys.exit(0)
