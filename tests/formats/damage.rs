//! Random damage to files, for the test of all readers and the long loop of `benches/damage.rs`.
//!
//! Whatever happens to a file, its reader gives an error or a mesh: no panic, no hang, no memory
//! beyond a small multiple of the file's size; and what was read is written back to the byte.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use idmesh::formats::{self, Fields, MeshFile};

/// A file to damage.
pub struct Seed {
    pub name: String,
    pub bytes: Vec<u8>,
}

/// The golden files of all formats, smaller ones first.
pub fn seeds() -> Vec<Seed> {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let mut paths: Vec<PathBuf> = Vec::new();
    for folder in [data.join("mixed"), data] {
        paths.extend(fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()));
    }
    let readable = |path: &PathBuf| {
        let small = fs::metadata(path).is_ok_and(|metadata| metadata.is_file() && metadata.len() < 45_000);
        small && formats::read_mixed(path).is_ok()
    };
    let mut seeds: Vec<Seed> = paths
        .into_iter()
        .filter(readable)
        .map(|path| Seed {
            name: path.file_name().unwrap().to_string_lossy().into_owned(),
            bytes: fs::read(&path).unwrap(),
        })
        .collect();
    seeds.sort_by(|a, b| (a.bytes.len(), &a.name).cmp(&(b.bytes.len(), &b.name)));
    seeds
}

/// Xorshift: good enough, and the same everywhere.
pub struct Random(pub u64);

impl Random {
    pub fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as usize % limit.max(1)
    }
}

/// Numbers that break things where they are taken for counts, indices or sizes.
const NUMBERS: [i64; 10] =
    [0, -1, 1, 7, i32::MAX as i64, i32::MIN as i64, u32::MAX as i64, i64::MAX, i64::MIN, 1 << 40];
const WORDS: [&str; 10] =
    ["nan", "-inf", "1e999", "-1", "18446744073709551615", "99999999", "0", "\n", "2147483648", "4e-320"];

/// Damages a file in one to four places.
pub fn damage(seed: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    for _ in 0..1 + random.below(4) {
        if bytes.is_empty() {
            break;
        }
        let at = random.below(bytes.len());
        match random.below(9) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = *b"0-$\n \xff<>%=\"#".get(random.below(12)).unwrap(),
            2 => bytes.truncate(at),
            3 => drop(bytes.drain(at..(at + random.below(9)).min(seed.len()).min(bytes.len()).max(at))),
            // A number in a binary file, of either byte order.
            4 | 5 => {
                let value = NUMBERS[random.below(NUMBERS.len())];
                let width = if random.below(2) == 0 { 4 } else { 8 };
                let mut number = value.to_le_bytes()[..width].to_vec();
                if random.below(2) == 0 {
                    number.reverse();
                }
                let at = at / 4 * 4;
                let end = (at + width).min(bytes.len());
                bytes[at..end].copy_from_slice(&number[..end - at]);
            }
            // A word in a text file.
            6 | 7 => {
                let blank = |byte: &u8| byte.is_ascii_whitespace() || *byte == b'"';
                let start = bytes[..at].iter().rposition(blank).map_or(0, |place| place + 1);
                let end = bytes[at..].iter().position(blank).map_or(bytes.len(), |place| at + place);
                if start <= end && end - start < 40 {
                    drop(bytes.splice(start..end, WORDS[random.below(WORDS.len())].bytes()));
                }
            }
            // A piece once more, somewhere else.
            _ => {
                let length = random.below(64).min(bytes.len() - at);
                let piece = bytes[at..at + length].to_vec();
                let to = random.below(bytes.len());
                drop(bytes.splice(to..to, piece));
            }
        }
    }
    bytes
}

/// Reads damaged bytes; if that gives a mesh, it must be written back as it was. Returns whether it
/// did.
pub fn survives(name: &str, bytes: &[u8]) -> bool {
    let Ok(file) = formats::read_bytes(Path::new(name), bytes.to_vec()) else { return false };
    let back = written_back(&file, name);
    let same = if bytes.starts_with(&[0x1f, 0x8b]) { true } else { back == bytes };
    assert!(same, "{name}: written back differently");
    true
}

fn written_back(file: &MeshFile, name: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    file.write_to(&mut bytes, Path::new(name), &file.mesh.vertices, &Fields::default()).unwrap();
    bytes.flush().unwrap();
    bytes
}
