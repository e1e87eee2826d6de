//! VTU files whose arrays are not where they should be. Read, they would be another mesh once their
//! points have moved.

use super::*;

fn golden(name: &str) -> Vec<u8> {
    bytes(&format!("mixed/{name}"))
}

fn find(bytes: &[u8], pattern: &str) -> usize {
    bytes.windows(pattern.len()).position(|window| window == pattern.as_bytes()).unwrap()
}

/// The file with one text in place of another, which must occur once.
fn replaced(bytes: &[u8], from: &str, to: &str) -> Vec<u8> {
    let at = find(bytes, from);
    [&bytes[..at], to.as_bytes(), &bytes[at + from.len()..]].concat()
}

/// Offset of the first appended array.
fn appended(bytes: &[u8]) -> usize {
    let section = find(bytes, "<AppendedData");
    section + find(&bytes[section..], "_") + 1
}

/// The offsets of all appended arrays.
fn offsets(bytes: &[u8]) -> Vec<usize> {
    let head = String::from_utf8_lossy(&bytes[..find(bytes, "<AppendedData")]).into_owned();
    head.split("offset=\"").skip(1).map(|rest| rest.split('"').next().unwrap().parse().unwrap()).collect()
}

fn refusal(bytes: &[u8]) -> String {
    formats::read_bytes(Path::new("a.vtu"), bytes.to_vec()).unwrap_err().to_string()
}

/// Each array in turn has a last block that is a few bytes longer than it is: these belong to the
/// next array, or are the end of the section. What is compressed does not show it.
#[test]
fn a_packed_size_beyond_the_array_is_refused() {
    let file = golden("vtk.raw.zlib.vtu");
    for offset in offsets(&file) {
        let at = appended(&file) + offset;
        let int = |place: usize| u32::from_le_bytes(file[at + 4 * place..][..4].try_into().unwrap());
        let last = 2 + int(0) as usize;
        let mut broken = file.clone();
        broken[at + 4 * last..][..4].copy_from_slice(&(int(last) + 6).to_le_bytes());
        let error = refusal(&broken);
        assert!(error.contains("expected the array") && error.contains("between the bytes"), "{offset}: {error}");
    }
}

/// The same in base64, where a few blanks within an array push its end into the next array.
#[test]
fn blanks_do_not_hide_where_an_array_ends() {
    let file = golden("vtk.base64.vtu");
    let head = String::from_utf8_lossy(&file[..find(&file, "<AppendedData")]).into_owned();
    let of_points = head.split("Name=\"Points\"").nth(1).unwrap().split("offset=\"").nth(1).unwrap();
    let offset: usize = of_points.split('"').next().unwrap().parse().unwrap();
    let mut broken = file.clone();
    broken[appended(&file) + offset + 40..][..4].copy_from_slice(b"    ");
    let error = refusal(&broken);
    assert!(error.contains("the array 'Points' between the bytes"), "{error}");
}

#[test]
fn points_share_no_bytes_with_another_array() {
    let file = golden("vtk.raw.vtu");
    let head = String::from_utf8_lossy(&file[..find(&file, "<AppendedData")]).into_owned();
    let of_points = head.split("Name=\"Points\"").nth(1).unwrap().split("offset=\"").nth(1).unwrap();
    let offset = of_points.split('"').next().unwrap();
    // The first array of the file is an array of points' data, which is not read.
    let broken = replaced(&file, "offset=\"0\"", &format!("offset=\"{offset}\""));
    let error = refusal(&broken);
    assert!(error.contains("bytes of their own for the points 'Points'"), "{error}");
}

#[test]
fn appended_data_begin_with_an_underscore() {
    let file = golden("vtk.raw.vtu");
    let mut broken = file.clone();
    broken[appended(&file) - 1] = b'x';
    let error = refusal(&broken);
    assert!(error.contains("expected '_' before appended data"), "{error}");
}

/// An array that idmesh does not read stands after the points. Moved points are packed to another
/// length, and the offset of the array says so.
#[test]
fn an_array_that_is_not_read_is_still_found() {
    let file = golden("vtk.raw.zlib.vtu");
    let end = find(&file, "\n  </AppendedData>");
    let zeros = [0u8; 12];
    for (tag, closing) in [
        ("<FieldData><DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"0\"", "</FieldData>"),
        ("<PointData><Array type=\"String\" Name=\"names\"", "</PointData>"),
    ] {
        let offset = end - appended(&file);
        let bytes = [&file[..end], &zeros[..], &file[end..]].concat();
        let place = if tag.contains("Field") { "<Piece" } else { "<Points>" };
        let tag = format!("{tag} format=\"appended\" offset=\"{offset}\"/>{closing}\n      {place}");
        let bytes = replaced(&bytes, place, &tag);
        let mesh = read_bytes("a.vtu", &bytes).unwrap_or_else(|error| panic!("{tag}: {error}"));
        let vertices: Vec<DVec3> = mesh.mesh.vertices.iter().map(|vertex| 0.7 * *vertex + DVec3::X / 3.0).collect();
        let after = written(&mesh, "a.vtu", &vertices);
        assert_ne!(after.len(), bytes.len(), "the points have the same length");
        let now = find(&after, "\n  </AppendedData>") - zeros.len() - appended(&after);
        assert!(offsets(&after).contains(&now), "{tag}: {now} is not in {:?}", offsets(&after));
    }
}

/// A moved point does not fit an array of whole numbers, even where it is text.
#[test]
fn points_that_are_whole_numbers_are_refused() {
    let file = golden("vtk.ascii.vtu");
    let broken = replaced(&file, "type=\"Float64\" Name=\"Points\"", "type=\"Int64\" Name=\"Points\"");
    assert!(refusal(&broken).contains("points of type Float64 or Float32"), "{}", refusal(&broken));
    let file = golden("meshio.ascii.vtk");
    let broken = replaced(&file, "POINTS 12 double", "POINTS 12 int");
    let error = read_bytes("a.vtk", &broken).unwrap_err().to_string();
    assert!(error.contains("points of type float or double"), "{error}");
}

/// A vertex of two pieces is at 0 in one and at -0 in the other. Moved, both are at the same place,
/// so they must have been one vertex before.
#[test]
fn pieces_meet_where_a_zero_is_negative() {
    let file = String::from_utf8(golden("vtk.pieces.ascii.vtu")).unwrap();
    let whole = read_bytes("a.vtu", file.as_bytes()).unwrap();
    let second = file.rfind("<Points>").unwrap();
    let row = second + file[second..].find(" 0 ").unwrap();
    let signed = format!("{} -0 {}", &file[..row], &file[row + 3..]);
    let mesh = read_bytes("a.vtu", signed.as_bytes()).unwrap();
    assert_eq!(mesh.mesh.vertices.len(), whole.mesh.vertices.len());
    assert!(written(&mesh, "a.vtu", &mesh.mesh.vertices) == signed.as_bytes());
    let vertices: Vec<DVec3> = mesh.mesh.vertices.iter().map(|vertex| *vertex + DVec3::ONE).collect();
    let again = read_bytes("a.vtu", &written(&mesh, "a.vtu", &vertices)).unwrap();
    assert_eq!(again.mesh.vertices, vertices);
    assert_eq!((again.mesh.tets, again.mesh.triangles), (mesh.mesh.tets, mesh.mesh.triangles));
}
