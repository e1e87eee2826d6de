//! Files of few bytes that unpack to many: the sizes that they declare are compared before anything
//! is unpacked, and an unpacked stream has a limit.

use std::fmt::Write as _;

use super::*;

/// One tet in SU2.
const SU2: &str = "NDIME= 3
NELEM= 1
10 0 1 2 3 0
NPOIN= 4
0 0 0 0
1 0 0 1
0 1 0 2
0 0 1 3
NMARK= 1
MARKER_TAG= wall
MARKER_ELEMS= 4
5 0 2 1
5 0 1 3
5 1 2 3
5 0 3 2
";

fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

fn base64(bytes: &[u8]) -> String {
    let letters: Vec<char> = ('A'..='Z').chain('a'..='z').chain('0'..='9').chain(['+', '/']).collect();
    let mut text = String::new();
    for three in bytes.chunks(3) {
        let bits = (0..3).fold(0, |bits, i| bits << 8 | u32::from(three.get(i).copied().unwrap_or(0)));
        for i in 0..4 {
            text.push(if i <= three.len() { letters[(bits >> (18 - 6 * i) & 63) as usize] } else { '=' });
        }
    }
    text
}

/// The header of an array in one block of `plain` bytes that take `packed` bytes.
fn header(plain: u64, packed: usize) -> Vec<u8> {
    [1, plain, 0, packed as u64].iter().flat_map(|number| number.to_le_bytes()).collect()
}

/// A VTU file with a tet of four points. `arrays` are the attributes and the text of the arrays of
/// points, connectivity, offsets and types; `None` stands for those of the tet.
fn vtu(compressor: &str, arrays: [Option<(&str, &str)>; 4], appended: &[u8]) -> Vec<u8> {
    let plain = ["0 0 0 1 0 0 0 1 0 0 0 1", "0 1 2 3", "4", "10"];
    let kinds = [
        "type=\"Float64\" NumberOfComponents=\"3\"",
        "type=\"Int64\" Name=\"connectivity\"",
        "type=\"Int64\" Name=\"offsets\"",
        "type=\"Int64\" Name=\"types\"",
    ];
    let mut text = format!(
        "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\" header_type=\"UInt64\" \
         compressor=\"{compressor}\"><UnstructuredGrid><Piece NumberOfPoints=\"4\" NumberOfCells=\"1\">"
    );
    for (index, array) in arrays.into_iter().enumerate() {
        let (attributes, values) = array.unwrap_or(("format=\"ascii\"", plain[index]));
        text += ["<Points>", "</Points><Cells>", "", ""][index];
        write!(text, "<DataArray {} {attributes}>{values}</DataArray>", kinds[index]).unwrap();
    }
    text += "</Cells></Piece></UnstructuredGrid><AppendedData encoding=\"raw\">_";
    [text.as_bytes(), appended, b"</AppendedData></VTKFile>"].concat()
}

fn message(name: &str, bytes: &[u8]) -> String {
    read_bytes(name, bytes).expect_err("a bomb was read").to_string()
}

/// The blocks here are no compressed data at all, so an attempt to unpack them would be told. An
/// array of more numbers than the piece declares is refused before.
#[test]
fn counts_are_compared_before_anything_is_unpacked() {
    // Without a bomb all arrays are read. Only triangles are missing.
    let found = message("a.vtu", &vtu("", [None; 4], b""));
    assert!(found.contains("the file has no boundary triangles"), "{found}");
    let garbage = vec![0xaa; 100_000];
    for compressor in ["vtkZLibDataCompressor", "vtkLZ4DataCompressor", "vtkLZMADataCompressor"] {
        let plain = 8 * 2_000_000;
        let inline = base64(&header(plain, garbage.len())) + &base64(&garbage);
        let appended = [header(plain, garbage.len()), garbage.clone()].concat();
        for (index, expected) in [
            (0, "expected 4 points, as the piece declares, found 2000000 coordinates"),
            (2, "expected 1 numbers in 'offsets', as many as the piece declares cells, found 2000000"),
            (3, "expected 1 numbers in 'types', as many as the piece declares cells, found 2000000"),
        ] {
            let mut arrays = [None; 4];
            arrays[index] = Some(("format=\"binary\"", &*inline));
            let found = message("a.vtu", &vtu(compressor, arrays, b""));
            assert!(found.contains(expected), "{compressor}: {found}");
            arrays[index] = Some(("format=\"appended\" offset=\"0\"", ""));
            let found = message("a.vtu", &vtu(compressor, arrays, &appended));
            assert!(found.contains(expected), "{compressor}: {found}");
        }
    }
}

/// Nothing promises the length of the connectivity, so the size of the file limits it.
#[test]
fn an_array_without_a_promise_has_a_limit() {
    let packed = zlib(&vec![0; 32 << 20]);
    let appended = [header(32 << 20, packed.len()), packed].concat();
    let arrays = [None, Some(("format=\"appended\" offset=\"0\"", "")), None, None];
    let bytes = vtu("vtkZLibDataCompressor", arrays, &appended);
    let found = message("a.vtu", &bytes);
    let most = 64 * bytes.len() + (16 << 20);
    let expected = format!(
        "a.vtu: the array 'connectivity' unpacks to 33554432 bytes, expected at most {most} from a file of {} bytes",
        bytes.len()
    );
    assert!(found.contains(&expected) && found.contains("--max-memory"), "{found}");
}

/// Pieces that all name the same bytes: together they are too many.
#[test]
fn pieces_that_share_bytes_count_several_times() {
    let packed = zlib(&vec![0; 24 << 17]);
    let piece = "<Piece NumberOfPoints=\"131072\" NumberOfCells=\"0\"><Points><DataArray type=\"Float64\" \
                 NumberOfComponents=\"3\" format=\"appended\" offset=\"0\"/></Points><Cells><DataArray type=\"Int64\" \
                 Name=\"connectivity\" format=\"ascii\"/><DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\"/>\
                 <DataArray type=\"Int64\" Name=\"types\" format=\"ascii\"/></Cells></Piece>";
    let text = format!(
        "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\" header_type=\"UInt64\" \
         compressor=\"vtkZLibDataCompressor\"><UnstructuredGrid>{}</UnstructuredGrid><AppendedData encoding=\"raw\">_",
        piece.repeat(200)
    );
    let bytes = [text.into_bytes(), header(24 << 17, packed.len()), packed, b"</AppendedData></VTKFile>".to_vec()];
    let found = message("a.vtu", &bytes.concat());
    assert!(found.contains("the array '', with the parts before it, unpacks to "), "{found}");
}

#[test]
fn a_gzipped_bomb_of_any_format_is_refused() {
    let bomb = zipped(&vec![b'\n'; 96 << 20]);
    let most = 64 * bomb.len() + (16 << 20);
    assert!(most < 90 << 20, "the bomb is too large: {}", bomb.len());
    let names = formats::FORMATS.iter().filter(|format| !format.is_folder());
    for extension in names.flat_map(|format| format.extensions) {
        let name = format!("a.{extension}.gz");
        let found = message(&name, &bomb);
        let expected = format!("{name}: the gzipped file unpacks to more than {most} bytes, expected at most {most}");
        assert!(found.contains(&expected), "{found}");
    }

    let folder = tempfile::tempdir().unwrap();
    for name in ["points", "owner", "neighbour", "boundary"] {
        fs::copy(data("mixed/foam.ascii/constant/polyMesh").join(name), folder.path().join(name)).unwrap();
    }
    fs::write(folder.path().join("faces.gz"), &bomb).unwrap();
    let found = read_mixed(&folder.path().join("points")).unwrap_err().to_string();
    assert!(found.contains("faces.gz: the gzipped file unpacks to more than"), "{found}");
}

/// A file that shrinks a lot, but not beyond the limit, is read like the plain one. Its rest is
/// counted before it is unpacked.
#[test]
fn what_shrinks_much_is_still_read() {
    let plain = format!("{}{SU2}", "% nothing here\n".repeat(700_000));
    let packed = zipped(plain.as_bytes());
    assert!(plain.len() > 16 * packed.len() + (8 << 20), "it does not shrink enough: {}", packed.len());
    let file = read_bytes("a.su2.gz", &packed).unwrap();
    assert_eq!(file.mesh.vertices, [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z]);
    assert!(unzipped(&packed) == plain.as_bytes());
    assert_eq!(written(&file, "b.su2", &file.mesh.vertices), plain.as_bytes());
    // A cut stream is told as such, in the part that is counted too.
    let found = message("a.su2.gz", &packed[..packed.len() - 100]);
    assert!(found.contains("a.su2.gz: cannot be unzipped, the file is damaged or cut short"), "{found}");
}
