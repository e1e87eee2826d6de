//! The bytes of a mesh file that was read, and where its coordinates stand in them.

use std::io::{self, Write};

use glam::DVec3;

use super::scanner::{Encoding, next_token, parse_double};

/// A mesh file's source with the places of its coordinates: all that is needed to write it back moved.
#[derive(Debug)]
pub(super) struct Document {
    /// Name of the file's format in [`super::FORMATS`].
    pub format: &'static str,
    /// The file, decompressed.
    pub bytes: Vec<u8>,
    /// How coordinates are written in it.
    pub encoding: Encoding,
    /// Offset of each vertex's x `[n_vertices]`, increasing; y and z follow it, in a text file after white space.
    pub slots: Vec<usize>,
}

impl Document {
    /// Writes the file with the vertices moved to `vertices` `[n_vertices]`: every byte but the coordinates is
    /// copied, and in a text file also the coordinates whose value did not change.
    pub fn write(&self, out: &mut dyn Write, vertices: &[DVec3]) -> io::Result<()> {
        let mut copied = 0;
        for (&slot, vertex) in self.slots.iter().zip(vertices) {
            copied = match self.encoding {
                Encoding::Text => self.write_text(out, copied, slot, vertex)?,
                Encoding::Binary(endian) => {
                    out.write_all(&self.bytes[copied..slot])?;
                    let mut block = [0; 24];
                    for (bytes, value) in block.chunks_exact_mut(8).zip(vertex.to_array()) {
                        bytes.copy_from_slice(&endian.double(value));
                    }
                    out.write_all(&block)?;
                    slot + block.len()
                }
            };
        }
        out.write_all(&self.bytes[copied..])
    }

    /// Copies from `copied` to the end of the vertex's last coordinate and returns that end.
    fn write_text(&self, out: &mut dyn Write, copied: usize, slot: usize, vertex: &DVec3) -> io::Result<usize> {
        let (mut copied, mut at) = (copied, slot);
        for value in vertex.to_array() {
            let token = next_token(&self.bytes, at);
            at = token.end;
            // Shorter or longer digits of the same number must stay as they are: compare values, by their bits.
            if parse_double(&self.bytes[token.clone()]).map(f64::to_bits) != Some(value.to_bits()) {
                out.write_all(&self.bytes[copied..token.start])?;
                write_shortest(out, value)?;
                copied = at;
            }
        }
        out.write_all(&self.bytes[copied..at])?;
        Ok(at)
    }
}

/// The fewest digits that read back as the same number; with an exponent where zeros would pile up.
fn write_shortest(out: &mut dyn Write, value: f64) -> io::Result<()> {
    if value == 0.0 || (1e-5..1e16).contains(&value.abs()) { write!(out, "{value}") } else { write!(out, "{value:e}") }
}
