//! CGNS files as h5py and the CGNS library wrote them (`data/make_cgns.py`): a slab of 2 x 1 x 1/3,
//! its face z = 0 the wing.

use super::*;
use crate::damage::with_checksums;

fn slab(kind: &str) -> (Vec<u8>, MeshFile) {
    let name = format!("slab.{kind}.cgns");
    let file = read(&data(&name)).unwrap_or_else(|error| panic!("{error}"));
    (bytes(&name), file)
}

fn area(mesh: &TetMesh, family: &str) -> f64 {
    let id = mesh.family(family).unwrap_or_else(|| panic!("no {family} in {:?}", mesh.families));
    let corner = |vertex: u32| mesh.vertices[vertex as usize];
    let of_family = mesh.triangles.iter().zip(&mesh.triangle_family).filter(|(_, of)| **of == id);
    let areas = of_family.map(|(face, _)| {
        let [a, b, c] = face.map(corner);
        0.5 * (b - a).cross(c - a).length()
    });
    areas.sum()
}

/// The slab's volume, its number of vertices, and the areas of its families.
fn assert_is_slab(kind: &str, mesh: &TetMesh, areas: &[(&str, f64)]) {
    let at = |vertex: u32| mesh.vertices[vertex as usize];
    let volume: f64 = mesh.tets.iter().map(|tet| quality::volume(tet.map(at))).sum();
    assert!((volume.abs() - 2.0 / 3.0).abs() < 1e-12, "{kind}: volume {volume}");
    assert_eq!((mesh.vertices.len(), mesh.tets.len(), mesh.triangles.len()), (12, 12, 20), "{kind}");
    assert_eq!(mesh.families.len(), areas.len(), "{kind}: {:?}", mesh.families);
    for (family, expected) in areas {
        let found = area(mesh, family);
        assert!((found - expected).abs() < 1e-12, "{kind}: {family} has the area {found}");
    }
    idmesh::mesh::validate(mesh).unwrap_or_else(|error| panic!("{kind}: {error:?}"));
}

const AREAS: [(&str, f64); 2] = [("wing", 2.0), ("far", 4.0)];

fn moved(vertices: &[DVec3]) -> Vec<DVec3> {
    let place = |(index, at): (usize, &DVec3)| *at + DVec3::new(1e-3, 0.1, -0.02) * (index + 1) as f64;
    vertices.iter().enumerate().map(place).collect()
}

/// Written back where it is, the file is the same; moved, it is the same mesh elsewhere.
fn assert_is_written_back(kind: &str, before: &[u8], file: &MeshFile) -> Vec<u8> {
    assert!(written(file, "same.cgns", &file.mesh.vertices) == before, "{kind}: written back differently");
    let vertices = moved(&file.mesh.vertices);
    let after = written(file, "moved.cgns", &vertices);
    let again = read_bytes("moved.cgns", &after).unwrap_or_else(|error| panic!("{kind}: {error}"));
    assert_eq!(again.mesh.vertices, vertices, "{kind}");
    let expected = TetMesh { vertices, ..file.mesh.clone() };
    assert!(again.mesh.tets == expected.tets && again.mesh.triangles == expected.triangles, "{kind}");
    assert_eq!(again.mesh.triangle_family, expected.triangle_family, "{kind}");
    assert_eq!(again.mesh.families, expected.families, "{kind}");
    after
}

/// Offsets of the bytes that differ.
fn differences(a: &[u8], b: &[u8]) -> Vec<usize> {
    assert_eq!(a.len(), b.len());
    (0..a.len()).filter(|&at| a[at] != b[at]).collect()
}

/// Three coordinates of twelve vertices of eight bytes.
const COORDINATES: usize = 3 * 12 * 8;

#[test]
fn files_of_the_library_are_read_and_written() {
    for kind in ["plain", "library", "pycgns"] {
        let (before, file) = slab(kind);
        assert_is_slab(kind, &file.mesh, &AREAS);
        assert!(file.warnings().is_empty(), "{:?}", file.warnings());
        let after = assert_is_written_back(kind, &before, &file);
        let changed = differences(&before, &after);
        assert!(changed.len() <= COORDINATES && changed.len() >= COORDINATES / 2, "{kind}: {} bytes", changed.len());
    }
}

/// Conditions on vertices and on edges beside those on faces are passed over, and that is told.
#[test]
fn conditions_beside_those_on_faces_are_passed_over_with_a_remark() {
    let (before, file) = slab("beside");
    assert_is_slab("beside", &file.mesh, &AREAS);
    assert_eq!(
        file.warnings(),
        [
            "/Base/Slab/ZoneBC/edges: a boundary condition on edges is passed over",
            "/Base/Slab/ZoneBC/nodes: a boundary condition on vertices, beside those on faces, is passed over",
        ]
    );
    assert_is_written_back("beside", &before, &file);
}

/// The node named GridCoordinates is the mesh, wherever its name stands among the others' (SIDS).
/// Fails if the first node of coordinates is taken, or one of several without that name.
#[test]
fn coordinates_of_other_times_are_passed_over() {
    for kind in ["grids", "adf.grids"] {
        let (before, file) = slab(kind);
        assert_is_slab(kind, &file.mesh, &AREAS);
        assert_eq!(file.mesh.vertices, slab("plain").1.mesh.vertices, "{kind}");
        let others = ["Before", "GridCoordinates#2"];
        let told =
            others.map(|name| format!("/Base/Slab/{name}: coordinates of another time are passed over, and stay"));
        assert_eq!(file.warnings(), told, "{kind}");
        let changed = differences(&before, &assert_is_written_back(kind, &before, &file));
        assert!(changed.len() <= COORDINATES && changed.len() >= COORDINATES / 2, "{kind}: {} bytes", changed.len());
    }
    let [from, to] = ["GridCoordinates", "Gridcoordinates"].map(|name| format!("{name:32}").into_bytes());
    let mut nameless = bytes("slab.adf.grids.cgns");
    for at in 0..nameless.len() - 32 {
        if nameless[at..].starts_with(&from) {
            nameless[at..at + 32].copy_from_slice(&to);
        }
    }
    let error = read_bytes("a.cgns", &nameless).map(drop).unwrap_err().to_string();
    let expected = "/Base/Slab: expected one of its grid coordinates with the name GridCoordinates, \
                    found 'Before', 'GridCoordinates#2', 'Gridcoordinates'";
    assert!(error.ends_with(expected), "{error}");
}

/// Fails if the base of surfaces is read as a part of the mesh.
#[test]
fn a_base_of_surfaces_is_passed_over() {
    let (before, file) = slab("surfaces");
    assert_is_slab("surfaces", &file.mesh, &AREAS);
    assert_eq!(file.warnings(), ["/Area: a base of surfaces is passed over, and stays"]);
    assert_is_written_back("surfaces", &before, &file);
    assert_eq!(file.losses(Path::new("a.vtu")).unwrap()[0], "the base 'Area': not carried into the new file");
}

/// The size of a zone says how many vertices it has (SIDS: VertexSize).
///
/// Fails if coordinates beyond it are vertices.
#[test]
fn a_zone_has_as_many_coordinates_as_vertices() {
    let bytes = bytes("slab.adf.cgns");
    for size in [11u8, 13, 0] {
        let mut broken = bytes.clone();
        broken[data_of(&bytes, "Slab").start] = size;
        let error = read_bytes("a.cgns", &broken).map(drop).unwrap_err().to_string();
        let expected =
            format!("/Base/Slab/GridCoordinates: expected coordinates of {size} vertices, as the zone says, found 12");
        assert!(error.ends_with(&expected), "{error}");
    }
}

/// Where there are only conditions on vertices, they have the faces between their vertices.
#[test]
fn conditions_on_vertices_have_the_faces_between_them() {
    let (before, file) = slab("vertices");
    let third = 1.0 / 3.0;
    assert_is_slab("vertices", &file.mesh, &[("inflow", third), ("outflow", third), ("skin", 6.0 - 2.0 * third)]);
    let what =
        "16 faces have no boundary condition that holds all their vertices: their family is 'skin', as their section";
    assert_eq!(file.warnings(), [what]);
    assert_is_written_back("vertices", &before, &file);
}

/// The same where no section has faces: the boundary of the cells has them. Faces between zones are
/// inside the mesh.
///
/// Fails if a mesh without sections of faces is refused, or a side between two cells is a face.
#[test]
fn conditions_on_vertices_need_no_section_of_faces() {
    let third = 1.0 / 3.0;
    let what = "faces have no boundary condition that holds all their vertices: their family is";
    let ends = [("inflow", third), ("outflow", third)];
    for kind in ["bare", "adf.bare"] {
        let (before, file) = slab(kind);
        assert_is_slab(kind, &file.mesh, &[&ends[..], &[("boundary", 6.0 - 2.0 * third)]].concat());
        assert_eq!(file.warnings(), [format!("16 {what} 'boundary'")]);
        assert_is_written_back(kind, &before, &file);
    }
    let (before, file) = slab("bare.zones");
    let halves = ["Front/boundary", "Back/boundary"].map(|name| (name, 3.0 - third));
    assert_is_slab("bare.zones", &file.mesh, &[&ends[..], &halves].concat());
    assert_is_written_back("bare.zones", &before, &file);
    // Without conditions nothing says what the boundary is.
    let mut bytes = bytes("slab.adf.bare.cgns");
    let label = named(&bytes, "ZoneBC") + 4 + 32;
    bytes[label..label + 8].copy_from_slice(b"ZoneXX_t");
    let error = read_bytes("a.cgns", &bytes).map(drop).unwrap_err().to_string();
    assert!(
        error.contains("/Base/Slab: a zone without sections of faces or conditions on vertices is not read"),
        "{error}"
    );
    assert!(error.contains("save the boundary in sections of TRI_3 or QUAD_4 with a BC_t on each"), "{error}");
}

/// All vertices of the wing are also vertices of its neighbour.
#[test]
fn faces_between_the_vertices_of_two_conditions_are_refused() {
    let error = read(&data("slab.ambiguous.cgns")).unwrap_err().to_string();
    assert!(error.contains("slab.ambiguous.cgns: /Base/Slab/ZoneBC/wing: expected faces all of whose vertices no other condition holds, found the face at ["), "{error}");
    assert!(error.contains("whose vertices 'far' holds too"), "{error}");
}

/// The numbers of a condition without a place are vertices, and there are no more of those.
#[test]
fn vertices_of_conditions_exist() {
    let bytes = bytes("slab.vertices.cgns");
    let outflow = [9i32, 10, 11, 12].map(i32::to_le_bytes).concat();
    let at = bytes.windows(outflow.len()).position(|window| window == outflow).unwrap();
    for wrong in [0, 13, i32::MIN] {
        let mut broken = bytes.clone();
        broken[at..at + 4].copy_from_slice(&wrong.to_le_bytes());
        let error = read_bytes("a.cgns", &broken).map(drop).unwrap_err().to_string();
        let expected = format!(
            "/Base/Slab/ZoneBC/outflow: expected vertices of a condition, 1 to 12 (is it on faces, without a GridLocation?), found {wrong}"
        );
        assert!(error.ends_with(&expected), "{error}");
    }
}

/// Chunks that are not packed are written in their places.
#[test]
fn coordinates_in_chunks_are_written_in_their_places() {
    for kind in ["chunked", "growing"] {
        let (before, file) = slab(kind);
        assert_is_slab(kind, &file.mesh, &AREAS);
        let after = assert_is_written_back(kind, &before, &file);
        let changed = differences(&before, &after);
        assert!(changed.len() <= COORDINATES && changed.len() >= COORDINATES / 2, "{kind}: {} bytes", changed.len());
        assert!(file.losses(Path::new("a.cgns")).unwrap().is_empty(), "{kind}");
    }
}

/// An index of chunks that is not read is named with its node and a way out.
#[test]
fn chunks_that_grow_in_several_directions_are_refused() {
    let error = read(&data("slab.grows.cgns")).unwrap_err().to_string();
    assert!(error.contains("/Base/Slab/ZoneBC/wing/PointList: data in chunks that may grow in several"), "{error}");
    assert!(error.contains("is not read; repack it (h5repack -l CONTI"), "{error}");
}

/// Packed coordinates are written unpacked, behind everything else, and the file says so in a few
/// bytes of its headers.
#[test]
fn packed_coordinates_are_written_unpacked() {
    for kind in ["gzip", "latest", "lzf"] {
        let (before, file) = slab(kind);
        assert_is_slab(kind, &file.mesh, &AREAS);
        let after = assert_is_written_back(kind, &before, &file);
        let length = before.len().next_multiple_of(8) + COORDINATES;
        assert_eq!(after.len(), length, "{kind}");
        let changed = differences(&before, &after[..before.len()]);
        // An address and a size for each axis, a filter less, and the end of the file. In new files
        // the messages of three headers move, and have checksums.
        assert!(changed.len() < if kind == "latest" { 500 } else { 100 }, "{kind}: {} bytes", changed.len());
        let again = read_bytes("a.cgns", &after).unwrap();
        assert!(again.losses(Path::new("b.cgns")).unwrap().is_empty(), "{kind}");
        let told = ["coordinates: packed in the file that was read, and not where they move"];
        assert_eq!(file.losses(Path::new("a.cgns")).unwrap(), told, "{kind}");
        // Only what moves is unpacked.
        let mut vertices = file.mesh.vertices.clone();
        vertices[3].y = 0.7;
        assert_eq!(written(&file, "b.cgns", &vertices).len(), length - COORDINATES / 3 * 2, "{kind}");
    }
}

/// Coordinates in the headers of their arrays, which have checksums.
#[test]
fn coordinates_in_headers_are_written_there() {
    let (before, file) = slab("compact");
    assert_is_slab("compact", &file.mesh, &AREAS);
    let after = assert_is_written_back("compact", &before, &file);
    assert!(with_checksums(&after) == after, "the checksums are right");
    let changed = differences(&before, &after);
    let most = COORDINATES + 3 * 4;
    assert!(changed.len() <= most && changed.len() >= COORDINATES / 2, "{} bytes", changed.len());
}

/// A chunk that is damaged, or unpacks to more than it holds, is no chunk.
#[test]
fn broken_chunks_are_refused() {
    let bytes = bytes("slab.gzip.cgns");
    // zlib's first bytes at level 4, as h5py packs.
    let chunks: Vec<usize> = (0..bytes.len() - 1).filter(|&at| bytes[at..at + 2] == [0x78, 0x5e]).collect();
    assert!(chunks.len() > 9, "{}", chunks.len());
    for chunk in chunks {
        let mut broken = bytes.clone();
        broken[chunk + 5] ^= 0x10;
        let error = read_bytes("a.cgns", &broken).map(drop).unwrap_err().to_string();
        assert!(error.contains("expected data in chunks, found a broken chunk at ["), "{error}");
    }
}

/// Files in ADF, of the CGNS library, and the same with the numbers of other machines.
#[test]
fn adf_is_read_and_written_in_place() {
    let (before, file) = slab("adf");
    assert_is_slab("adf", &file.mesh, &AREAS);
    let plain = slab("plain").1.mesh;
    assert_eq!((&file.mesh.vertices, &file.mesh.tets), (&plain.vertices, &plain.tets));
    let after = assert_is_written_back("adf", &before, &file);
    let changed = differences(&before, &after);
    assert!(changed.len() <= COORDINATES && changed.len() >= COORDINATES / 2, "{} bytes", changed.len());

    let big = with_big_numbers(&before);
    let of_big = read_bytes("big.cgns", &big).unwrap();
    assert!(of_big.mesh.vertices == plain.vertices && of_big.mesh.tets == plain.tets);
    assert!(differences(&big, &assert_is_written_back("big", &big, &of_big)).len() >= COORDINATES / 2);
    // Versions with other first letters.
    let mut plain = before.clone();
    plain[..4].copy_from_slice(b"@(#)");
    assert_eq!(read_bytes("plain.cgns", &plain).unwrap().mesh.tets, file.mesh.tets);
}

/// The number of these hexadecimal letters.
fn hexadecimal(letters: &[u8]) -> usize {
    usize::from_str_radix(std::str::from_utf8(letters).unwrap(), 16).unwrap()
}

/// The place that stands in a file of ADF: a block and an offset.
fn place(bytes: &[u8], at: usize) -> usize {
    hexadecimal(&bytes[at..at + 8]) * 4096 + hexadecimal(&bytes[at + 8..at + 12])
}

/// Places of the nodes of ADF.
fn nodes(bytes: &[u8]) -> Vec<usize> {
    (0..bytes.len() - 246)
        .filter(|&at| bytes[at..].starts_with(b"NoDe") && bytes[at + 242..].starts_with(b"TaiL"))
        .collect()
}

/// The node of ADF with this name.
fn named(bytes: &[u8], name: &str) -> usize {
    let letters = format!("{name:32}");
    nodes(bytes).into_iter().find(|at| bytes[at + 4..].starts_with(letters.as_bytes())).unwrap()
}

/// A file of ADF as a machine writes it that has the more significant byte first.
fn with_big_numbers(bytes: &[u8]) -> Vec<u8> {
    let mut big = bytes.to_vec();
    big[100] = b'B';
    for node in nodes(bytes) {
        let size = match &bytes[node + 96..node + 98] {
            b"I4" | b"R4" => 4,
            b"R8" => 8,
            _ => continue,
        };
        let chunk = place(bytes, node + 230);
        let data = chunk + 16..place(bytes, chunk + 4);
        big[data].chunks_exact_mut(size).for_each(<[u8]>::reverse);
    }
    big
}

/// The data of a node of ADF may be in several chunks, which a table lists.
#[test]
fn adf_may_have_data_in_several_chunks() {
    let (before, file) = slab("adf");
    let node = named(&before, "CoordinateY");
    let chunk = place(&before, node + 230);
    let (start, end) = (chunk + 16, place(&before, chunk + 4));
    let mut split = before.clone();
    split.resize(split.len().next_multiple_of(4096), 0);
    let letters = |at: usize| format!("{:08X}{:04X}", at / 4096, at % 4096).into_bytes();
    let mut chunks = Vec::new();
    for part in [start..start + 40, start + 40..end] {
        let at = split.len();
        let data = &before[part];
        let after = at + 16 + data.len();
        split.extend([b"DaTa", &letters(after)[..], data, b"dEnD"].concat());
        chunks.extend([letters(at), letters(after)].concat());
    }
    let table = split.len();
    split.extend([b"DCtb", &letters(table + 16 + 48)[..], &chunks, b"dcTE"].concat());
    split[node + 226..node + 230].copy_from_slice(b"0002");
    split[node + 230..node + 242].copy_from_slice(&letters(table));
    let again = read_bytes("split.cgns", &split).unwrap();
    assert_eq!(again.mesh.vertices, file.mesh.vertices);
    assert_is_written_back("split", &split, &again);
}

/// Nodes that are their own ancestors, or children of two, and places beyond the file.
#[test]
fn broken_adf_is_refused() {
    let bytes = bytes("slab.adf.cgns");
    let letters = |at: usize| format!("{:08X}{:04X}", at / 4096, at % 4096).into_bytes();
    let refused = |at: usize, new: &[u8], expected: &str| {
        let mut broken = bytes.clone();
        broken[at..at + new.len()].copy_from_slice(new);
        let error = read_bytes("a.cgns", &broken).map(drop).unwrap_err().to_string();
        assert!(error.contains(expected), "expected: {expected}\nfound:    {error}");
    };
    let [zone, grid, x, y] = ["Slab", "GridCoordinates", "CoordinateX", "CoordinateY"].map(|name| named(&bytes, name));
    let first_child = |node: usize| place(&bytes, node + 84) + 16 + 32;
    let children = "expected the children of a node of ADF, found";
    let elsewhere = format!("/Base/Slab: {children} number 1 that is elsewhere in the tree too");
    for ancestor in [place(&bytes, 134), named(&bytes, "Base"), zone, grid] {
        refused(first_child(zone), &letters(ancestor), if ancestor == grid { children } else { &elsewhere });
    }
    refused(first_child(zone), &letters(1 << 31), &format!("/Base/Slab: {children} none at the place of number 1"));
    refused(first_child(zone), b"x", &format!("{children} none at the place of number 1"));
    refused(zone + 68, b"FFFFFFFF", &format!("{children} 4294967295 of them"));
    refused(zone + 84, &letters(bytes.len()), &format!("{children} no table of them"));
    refused(x + 230, &bytes[y + 230..y + 242], "coordinates with places of their own, found two that share bytes");
    refused(x + 230, &letters(zone), "CoordinateX: expected data, found no chunk at its place");
    refused(x + 130, b"0000000D", "CoordinateX: expected data, found 8 bytes too few");
    refused(x + 130, b"0000000B", "expected three coordinates of one kind for every vertex, found [11, 12, 12]");
    refused(x + 226, b"FFFF", "CoordinateX: expected data, found no table of chunks");
    refused(x + 96, b"X4", "CoordinateX: expected data, found data of the type 'X4'");
    refused(named(&bytes, "ZoneBC") + 96, b"LK", "/Base/Slab/ZoneBC: a link to another node is not read");
    refused(
        100,
        b"C",
        "a.cgns: ADF with numbers of kind 'C' is not read; turn it into HDF5 (adf2hdf old.cgns new.cgns)",
    );
    refused(25, b"B", "a.cgns: ADF of version B02011 is not read");
    for length in [25, 100, 185, 5000, 8191] {
        let error = read_bytes("a.cgns", &bytes[..length]).unwrap_err().to_string();
        assert!(error.contains(": the file ends where the ") || length < 26, "{error}");
    }
}

/// Two zones, with equal points or with points that a connectivity says are one, in one base or in
/// two.
#[test]
fn zones_are_one_mesh() {
    for kind in ["zones", "joined", "bases", "adf.joined"] {
        let (before, file) = slab(kind);
        assert_is_slab(kind, &file.mesh, &AREAS);
        let after = assert_is_written_back(kind, &before, &file);
        // Four vertices are points of both zones.
        let changed = differences(&before, &after);
        let coordinates = COORDINATES / 12 * 16;
        assert!(changed.len() <= coordinates && changed.len() >= coordinates / 2, "{kind}: {} bytes", changed.len());
        let between = "4 faces without a boundary condition lie between zones and are passed over";
        let warnings = if kind.contains("joined") { vec![between] } else { vec![] };
        assert_eq!(file.warnings(), warnings, "{kind}");
    }
}

/// Points that are one by their connectivity, but not quite at one place, stay where they are, and
/// move to one place.
#[test]
fn points_that_are_nearly_one_keep_their_bits() {
    let (before, file) = slab("joined");
    let mut vertices = file.mesh.vertices.clone();
    let shared = vertices.iter().position(|at| at.x == 1.0).unwrap();
    vertices[shared].y = 0.25;
    let changed = differences(&before, &written(&file, "a.cgns", &vertices));
    assert!((2..=16).contains(&changed.len()), "{changed:?}");
    let again = read_bytes("a.cgns", &written(&file, "a.cgns", &vertices)).unwrap();
    assert_eq!(again.mesh.vertices, vertices);
}

/// The data of this node in a file of ADF.
fn data_of(bytes: &[u8], name: &str) -> std::ops::Range<usize> {
    let chunk = place(bytes, named(bytes, name) + 230);
    chunk + 16..place(bytes, chunk + 4)
}

#[test]
fn zones_that_do_not_fit_are_refused() {
    let bytes = bytes("slab.adf.joined.cgns");
    let refused = |change: &dyn Fn(&mut Vec<u8>), expected: &str| {
        let mut broken = bytes.clone();
        change(&mut broken);
        let error = read_bytes("a.cgns", &broken).map(drop).unwrap_err().to_string();
        assert!(error.contains(expected), "expected: {expected}\nfound:    {error}");
    };
    let set = |name: &'static str, at: usize, new: &'static [u8]| {
        move |bytes: &mut Vec<u8>| {
            let start = data_of(bytes, name).start + at;
            bytes[start..start + new.len()].copy_from_slice(new);
        }
    };
    let joint = "/ZoneGridConnectivity/joint: ";
    refused(
        &set("GridConnectivityType", 0, b"Abutting\0\0\0\0"),
        "a connectivity of type Abutting is not read; mesh the zones",
    );
    refused(&set("joint", 0, b"Bacj"), "expected the name of a zone, found Bac");
    refused(&set("PointListDonor", 0, &[9, 0, 0, 0]), "PointListDonor: expected points, 1 to 8, found 9");
    refused(&set("PointListDonor", 0, &[0, 0, 0, 0]), "PointListDonor: expected points, 1 to 8, found 0");
    refused(&set("PointListDonor", 0, &[8, 0, 0, 0]), "expected points of two zones at the same place, found [");
    refused(
        &|bytes| {
            let node = named(bytes, "PointListDonor");
            bytes[node + 130 + 8..node + 130 + 16].copy_from_slice(b"00000003");
        },
        &format!("{joint}expected as many points in both zones, found"),
    );
}

/// Where a zone has two points at a place, equal coordinates do not say which of them another zone
/// meets.
#[test]
fn points_that_could_be_either_of_two_are_refused() {
    let bytes = bytes("slab.zones.cgns");
    let file = read_bytes("a.cgns", &bytes).unwrap();
    // The zone Back comes first. One of its points that the other zone lacks goes to one of the
    // points that the zones share.
    let shared = file.mesh.vertices.iter().position(|at| at.x == 1.0).unwrap();
    let own = file.mesh.vertices.iter().position(|at| at.x == 2.0).unwrap();
    let mut vertices = file.mesh.vertices.clone();
    vertices[own] = vertices[shared];
    let slit = written(&file, "a.cgns", &vertices);
    let error = read_bytes("a.cgns", &slit).map(drop).unwrap_err().to_string();
    assert!(
        error.contains(
            "a.cgns: /Base/Front: expected at most one point of a zone where zones meet, found two of them at [1, "
        ),
        "{error}"
    );
}

/// A base that is a copy of another one has all its cells.
#[test]
fn cells_of_two_zones_are_refused() {
    let error = read(&data("slab.twice.cgns")).map(drop).unwrap_err().to_string();
    assert!(error.contains("/Copy/Slab: expected cells of its own, found one that /Base/Slab has too"), "{error}");
}
