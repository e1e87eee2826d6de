//! Packed arrays for the page's script: each array shuffled by bytes, then all of them deflated and
//! written in base64. `view.js` unpacks them.
//!
//! | array | packed as |
//! |---|---|
//! | numbers | the first bytes of all numbers, then their second bytes, ... (little-endian) |
//! | cells and faces | first vertex as the difference from the first vertex of the one before, other vertices from the vertex before; in columns, unsigned: `2 d` for `d >= 0`, `-2 d - 1` for `d < 0` |

use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::{Compression, write::ZlibEncoder};

/// Arrays in the making.
#[derive(Default)]
pub(super) struct Packed {
    bytes: Vec<u8>,
}

impl Packed {
    /// Adds numbers of one width, each as its little-endian bytes.
    pub fn numbers<const WIDTH: usize>(&mut self, numbers: impl Iterator<Item = [u8; WIDTH]> + Clone) {
        for byte in 0..WIDTH {
            self.bytes.extend(numbers.clone().map(|number| number[byte]));
        }
    }

    /// Adds polygons or cells with a number of vertices each, in the order in which they stand.
    pub fn polygons(&mut self, polygons: &[Vec<u32>], n_vertices: usize) {
        let mut columns = Vec::with_capacity(polygons.len() * n_vertices);
        for place in 0..n_vertices {
            let mut before = 0;
            for polygon in polygons {
                let from = if place == 0 { before } else { polygon[place - 1] };
                columns.push(unsigned(i64::from(polygon[place]) - i64::from(from)));
                before = polygon[0];
            }
        }
        self.numbers(columns.iter().map(|number| number.to_le_bytes()));
    }

    /// Number of bytes before they are deflated.
    pub fn len(&self) -> usize {
        self.bytes.len()
    }

    /// The deflated bytes (zlib) in base64.
    pub fn finish(self) -> std::io::Result<String> {
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(6));
        encoder.write_all(&self.bytes)?;
        Ok(STANDARD.encode(encoder.finish()?))
    }
}

/// A small number without sign for a number near zero.
fn unsigned(difference: i64) -> u32 {
    (if difference >= 0 { 2 * difference } else { -2 * difference - 1 }) as u32
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::*;

    /// The inverse, as the script does it.
    struct Unpacked {
        bytes: Vec<u8>,
        at: usize,
    }

    impl Unpacked {
        fn new(base64: &str) -> Self {
            let mut bytes = Vec::new();
            let packed = STANDARD.decode(base64).unwrap();
            flate2::read::ZlibDecoder::new(packed.as_slice()).read_to_end(&mut bytes).unwrap();
            Self { bytes, at: 0 }
        }

        fn numbers<const WIDTH: usize>(&mut self, count: usize) -> Vec<[u8; WIDTH]> {
            let of = &self.bytes[self.at..self.at + WIDTH * count];
            self.at += WIDTH * count;
            (0..count).map(|number| std::array::from_fn(|byte| of[byte * count + number])).collect()
        }

        fn polygons(&mut self, count: usize, n_vertices: usize) -> Vec<Vec<u32>> {
            let codes: Vec<u32> = self.numbers(count * n_vertices).into_iter().map(u32::from_le_bytes).collect();
            let signed =
                |code: u32| if code.is_multiple_of(2) { i64::from(code / 2) } else { -i64::from(code / 2) - 1 };
            let mut polygons: Vec<Vec<u32>> = Vec::new();
            for number in 0..count {
                let mut vertex = polygons.last().map_or(0, |before| i64::from(before[0]));
                let mut polygon = Vec::new();
                for place in 0..n_vertices {
                    vertex += signed(codes[place * count + number]);
                    polygon.push(vertex as u32);
                }
                polygons.push(polygon);
            }
            polygons
        }
    }

    /// Fails if a number, a vertex or their order changes on the way.
    #[test]
    fn arrays_come_back() {
        let floats = [1.5f32, -0.25, f32::MAX, 1e-38, 0.0];
        let small = [-32767i16, 5, 32767];
        // A difference fills 31 bits and its sign.
        let tets = [vec![0, 7, 9, 2_000_000_000], vec![0, 7, 9, 2], vec![3, 1, 2, 0]];
        let mut packed = Packed::default();
        packed.numbers(floats.iter().map(|number| number.to_le_bytes()));
        packed.numbers(small.iter().map(|number| number.to_le_bytes()));
        packed.polygons(&tets, 4);
        packed.polygons(&[], 8);
        let mut unpacked = Unpacked::new(&packed.finish().unwrap());
        assert_eq!(unpacked.numbers(5).into_iter().map(f32::from_le_bytes).collect::<Vec<_>>(), floats);
        assert_eq!(unpacked.numbers(3).into_iter().map(i16::from_le_bytes).collect::<Vec<_>>(), small);
        assert_eq!(unpacked.polygons(3, 4), tets);
        assert_eq!((unpacked.polygons(0, 8).len(), unpacked.at), (0, unpacked.bytes.len()));
    }
}
