//! Damaged mesh files, for the test of all readers and the long loop of `benches/damage.rs`.
//!
//! Whatever happens to a file, its reader gives an error or a mesh: no panic, no hang, no memory
//! beyond a small multiple of the file's size. What was read is written back to the byte. What was
//! read and moved is the same mesh again after it was written, in its own format and in others.

#[path = "hdf5_headers.rs"]
mod hdf5_headers;
#[path = "mutations.rs"]
mod mutations;
#[path = "read_back.rs"]
mod read_back;

use std::fs;
use std::path::{Path, PathBuf};

use idmesh::formats;

pub use hdf5_headers::with_checksums;
pub use mutations::{Random, damage};
use read_back::data;

/// A file to damage.
pub struct Seed {
    pub name: String,
    pub bytes: Vec<u8>,
}

impl Seed {
    fn of(name: String, path: &Path) -> Self {
        Seed { name, bytes: fs::read(path).unwrap() }
    }
}

/// Names of a mesh's references.
const MAPBC: &str = "2\n1 4000 wing skin\n2 5000 far field ! all of it\n";

/// Whether a damaged file is read, see [`read_back::survives`]. A file of HDF5 is read as it is and
/// with checksums that fit the damage.
pub fn survives(name: &str, bytes: &[u8]) -> bool {
    let as_it_is = read_back::survives(name, bytes);
    as_it_is || name.ends_with(".cgns") && read_back::survives(name, &with_checksums(bytes))
}

/// The golden files of all formats, smaller ones first. A name in a folder is the file of an
/// OpenFOAM mesh.
pub fn seeds() -> Vec<Seed> {
    let mut paths: Vec<PathBuf> = Vec::new();
    for folder in [data().join("mixed"), data()] {
        paths.extend(fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()));
    }
    let readable = |path: &PathBuf| {
        let small = fs::metadata(path).is_ok_and(|metadata| metadata.is_file() && metadata.len() < 45_000);
        small && formats::read_mixed(path).is_ok()
    };
    let named = |path: &PathBuf| Seed::of(path.file_name().unwrap().to_string_lossy().into_owned(), path);
    let mut seeds: Vec<Seed> = paths.iter().filter(|path| readable(path)).map(named).collect();
    for folder in ["foam.ascii", "foam.binary"] {
        for name in ["points", "faces", "owner", "neighbour", "boundary"] {
            let path = data().join("mixed").join(folder).join("constant/polyMesh").join(name);
            seeds.push(Seed::of(format!("{folder}/{name}"), &path));
        }
    }
    seeds.push(Seed { name: "names.mapbc".into(), bytes: MAPBC.into() });
    seeds.sort_by(|a, b| (a.bytes.len(), &a.name).cmp(&(b.bytes.len(), &b.name)));
    seeds
}
