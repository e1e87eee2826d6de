//! CGNS files of zones of one cube each: conditions that hold the same faces, and zones that meet
//! in faces.

use super::cgns::{node, numbers, text};
use super::*;

/// Corners of a unit cube in CGNS's order, and its faces with their normals outward.
const CUBE: [[f64; 3]; 8] =
    [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.], [0., 0., 1.], [1., 0., 1.], [1., 1., 1.], [0., 1., 1.]];
const FACES: [[i32; 4]; 6] = [[1, 4, 3, 2], [1, 2, 6, 5], [2, 3, 7, 6], [3, 4, 8, 7], [1, 5, 8, 4], [5, 6, 7, 8]];

/// The numbers of the cube's faces are 2 to 7: the cell is 1. The faces at x = 1 and x = 0 are:
const AT_1: i32 = 4;
const AT_0: i32 = 6;

/// A zone of one cube.
struct Zone {
    name: &'static str,
    points: [[f64; 3]; 8],
    faces: [[i32; 4]; 6],
    /// The first number of the section of faces.
    first: i32,
    conditions: Vec<hdf5_pure::GroupBuilder>,
    connections: Vec<hdf5_pure::GroupBuilder>,
}

impl Zone {
    fn new(name: &'static str) -> Self {
        Self { name, points: CUBE, faces: FACES, first: 2, conditions: Vec::new(), connections: Vec::new() }
    }

    fn node(self) -> hdf5_pure::GroupBuilder {
        let mut zone = numbers(self.name, "Zone_t", &[8, 1, 0]);
        zone.add_group(text("ZoneType", "ZoneType_t", "Unstructured").finish());
        let mut coordinates = node("GridCoordinates", "GridCoordinates_t");
        for (axis, name) in ["CoordinateX", "CoordinateY", "CoordinateZ"].into_iter().enumerate() {
            let mut of_axis = node(name, "DataArray_t");
            of_axis.create_dataset(" data").with_f64_data(&self.points.map(|at| at[axis])).with_shape(&[8]);
            coordinates.add_group(of_axis.finish());
        }
        zone.add_group(coordinates.finish());
        let first = self.first;
        for (name, kind, range, vertices) in [
            ("cells", 17, [1, 1], (1..=8).collect::<Vec<i32>>()),
            ("faces", 7, [first, first + 5], self.faces.concat()),
        ] {
            let mut section = numbers(name, "Elements_t", &[kind, 0]);
            section.add_group(numbers("ElementRange", "IndexRange_t", &range).finish());
            section.add_group(numbers("ElementConnectivity", "DataArray_t", &vertices).finish());
            zone.add_group(section.finish());
        }
        for (name, label, children) in [
            ("ZoneBC", "ZoneBC_t", self.conditions),
            ("ZoneGridConnectivity", "ZoneGridConnectivity_t", self.connections),
        ] {
            let mut all = node(name, label);
            children.into_iter().for_each(|child| drop(all.add_group(child.finish())));
            zone.add_group(all.finish());
        }
        zone
    }
}

fn read_zones(zones: Vec<Zone>) -> Result<MeshFile, String> {
    let mut base = numbers("Base", "CGNSBase_t", &[3, 3]);
    zones.into_iter().for_each(|zone| drop(base.add_group(zone.node().finish())));
    let mut file = hdf5_pure::FileBuilder::new();
    file.add_group(base.finish());
    read_bytes("a.cgns", &file.finish().unwrap()).map_err(|error| error.to_string())
}

/// A condition on faces, with a list of them or with a range.
fn condition(name: &str, kind: &str, faces: &[i32], family: Option<&str>) -> hdf5_pure::GroupBuilder {
    let mut condition = text(name, "BC_t", "FamilySpecified");
    condition.add_group(text("GridLocation", "GridLocation_t", "FaceCenter").finish());
    condition.add_group(numbers(kind, "IndexArray_t", faces).finish());
    if let Some(family) = family {
        condition.add_group(text("FamilyName", "FamilyName_t", family).finish());
    }
    condition
}

fn with_conditions(conditions: Vec<hdf5_pure::GroupBuilder>) -> Result<MeshFile, String> {
    read_zones(vec![Zone { conditions, ..Zone::new("Zone") }])
}

fn n_faces(file: &MeshFile, family: &str) -> usize {
    let id = file.mesh.family(family).unwrap_or_else(|| panic!("no {family} in {:?}", file.mesh.families));
    file.others.quadrilateral_family.iter().filter(|&&of| of == id).count()
}

/// A face has one family. Several conditions of one family may hold it.
#[test]
fn a_face_of_two_families_is_refused() {
    let (list, range) = ("PointList", "PointRange");
    for (kind, faces) in [(list, [4, 5]), (range, [4, 7])] {
        let far = || condition("far", range, &[2, 4], None);
        let error = with_conditions(vec![far(), condition("wall", kind, &faces, None)]).map(drop).unwrap_err();
        let words = "a.cgns: /Base/Zone/ZoneBC/wall: expected faces that no condition of another family holds, found face \
                     4 of the family 'wall', which /Base/Zone/ZoneBC/far puts into the family 'far'; leave each face";
        assert!(error.contains(words), "{error}");
        // Both conditions are of one family.
        let far = condition("far", range, &[2, 4], Some("skin"));
        let file = with_conditions(vec![far, condition("wall", kind, &faces, Some("skin"))]).unwrap();
        assert_eq!(n_faces(&file, "skin"), if kind == list { 4 } else { 6 });
    }
    let twice = with_conditions(vec![condition("wall", list, &[2, 3, 3, 2, 4, 5, 6, 7], None)]).unwrap();
    assert_eq!((n_faces(&twice, "wall"), twice.mesh.families.len()), (6, 1));
}

/// A condition names elements of its zone: the cell is 1, the faces are 2 to 7.
#[test]
fn elements_of_conditions_exist() {
    for (kind, faces, found) in [
        ("PointList", [2, 8], "found 8"),
        ("PointList", [0, 3], "found 0"),
        ("PointRange", [2, 99_999], "found 99999"),
        ("PointRange", [-3, 7], "found -3"),
    ] {
        let error = with_conditions(vec![condition("wall", kind, &faces, None)]).map(drop).unwrap_err();
        let words = "/Base/Zone/ZoneBC/wall: expected elements of the zone, 1 to 7 (is it on vertices, with another";
        assert!(error.contains(words) && error.ends_with(found), "{error}");
    }
    let error = with_conditions(vec![condition("wall", "PointRange", &[7, 2], None)]).map(drop).unwrap_err();
    assert!(error.ends_with("/Base/Zone/ZoneBC/wall: expected a range that ascends, found 7 to 2"), "{error}");
    // Two sections number their elements alike.
    let error = read_zones(vec![Zone { first: 1, ..Zone::new("Zone") }]).map(drop).unwrap_err();
    let words = "/Base/Zone/faces/";
    assert!(
        error.contains("expected numbers of its elements that no other section has, found 1 to 6")
            && !error.contains(words),
        "{error}"
    );
}

/// A connection of a zone's faces with those of another zone.
fn connection(donor: &str, location: &str, own: &[i32], other: &[i32]) -> hdf5_pure::GroupBuilder {
    let mut connection = text("joint", "GridConnectivity_t", donor);
    connection.add_group(text("GridConnectivityType", "GridConnectivityType_t", "Abutting1to1").finish());
    connection.add_group(text("GridLocation", "GridLocation_t", location).finish());
    connection.add_group(numbers("PointList", "IndexArray_t", own).finish());
    connection.add_group(numbers("PointListDonor", "IndexArray_t", other).finish());
    connection
}

/// The cube at x = 0 to 1, with these connections.
fn left(connections: Vec<hdf5_pure::GroupBuilder>) -> Zone {
    Zone { connections, ..Zone::new("Left") }
}

/// The cube at x = 1 to 2, whose points are `off` from the other cube's.
fn right(off: f64) -> Zone {
    Zone { points: CUBE.map(|[x, y, z]| [x + 1.0 + off, y - off, z + off]), ..Zone::new("Right") }
}

/// Two cubes that share a face have 12 vertices and 10 outer faces, however the shared face is
/// listed.
#[test]
fn zones_meet_in_the_faces_of_a_connection() {
    let joint = || connection("Right", "FaceCenter", &[AT_1], &[AT_0]);
    for off in [0.0, 1e-8, -7e-7] {
        for turn in 0..8 {
            let mut other = right(off);
            other.faces[AT_0 as usize - 2].rotate_left(turn % 4);
            if turn >= 4 {
                other.faces[AT_0 as usize - 2].reverse();
            }
            let file = read_zones(vec![left(vec![joint()]), other]).unwrap();
            assert_eq!((file.mesh.vertices.len(), file.others.hexahedra.len()), (12, 2));
            assert_eq!(file.others.quadrilaterals.len(), 10);
            let [one, two] = file.others.hexahedra[..] else { panic!() };
            let shared: Vec<_> = one.iter().filter(|vertex| two.contains(vertex)).collect();
            assert!(shared.len() == 4 && shared.iter().all(|&&vertex| file.mesh.vertices[vertex as usize].x == 1.0));
            // Corners in the order of the cubes.
            for (cell, by) in [(one, 0.0), (two, 1.0)] {
                for (vertex, corner) in cell.into_iter().zip(CUBE) {
                    let at = file.mesh.vertices[vertex as usize] - DVec3::X * by;
                    assert!(at.abs_diff_eq(DVec3::from_array(corner), 1e-6), "{at} {corner:?}");
                }
            }
            idmesh::mesh::validate(file.cells()).unwrap();
        }
    }
}

#[test]
fn zones_that_a_connection_does_not_join_are_refused() {
    let refused = |connections, other: Zone, words: &str| {
        let error = read_zones(vec![left(connections), other]).map(drop).unwrap_err();
        assert!(error.contains(words), "expected: {words}\nfound:    {error}");
    };
    let on = |location, own: &[i32], other: &[i32]| vec![connection("Right", location, own, other)];
    let joint = "/Base/Left/ZoneGridConnectivity/joint: ";
    // The size is 2, so points may be apart by 2e-6.
    refused(
        on("FaceCenter", &[AT_1], &[AT_0]),
        right(3e-6),
        &format!("{joint}expected points of two zones at the same place, found [1, "),
    );
    refused(on("FaceCenter", &[AT_1], &[AT_1]), right(0.0), "expected points of two zones at the same place");
    refused(
        on("FaceCenter", &[1], &[AT_0]),
        right(0.0),
        "joint/PointList: expected triangles or quadrilaterals of /Base/Left, found 1; save the faces between zones",
    );
    refused(
        on("FaceCenter", &[AT_1], &[9]),
        right(0.0),
        "PointListDonor: expected triangles or quadrilaterals of /Base/R",
    );
    refused(
        on("FaceCenter", &[AT_1, 2], &[AT_0]),
        right(0.0),
        &format!("{joint}expected as many faces in both zones, found 2 and 1"),
    );
    refused(
        on("CellCenter", &[1], &[1]),
        right(0.0),
        &format!("{joint}a connectivity with the GridLocation CellCenter is not read"),
    );
    refused(
        vec![],
        right(1e-8),
        "a zone that shares no point with the others is not read; mesh the zones so that they",
    );
}
