//! The object headers of an HDF5 file, which say where an array is.
//!
//! Source: the HDF5 File Format Specification, version 3, "Disk Format: Level 0A", "Level 2A1" and
//! "Data Layout Message".

use std::ops::Range;

/// Types of messages.
const NOTHING: u8 = 0;
const DATASPACE: u8 = 1;
const LAYOUT: u8 = 8;
const FILTERS: u8 = 11;
const CONTINUATION: u8 = 16;

/// Bytes of a layout message for an array in one piece: two numbers of one byte, address and size.
const ONE_PIECE: usize = 18;

/// Most blocks of a header that are followed. Whole files of damage point in circles.
const MOST_BLOCKS: usize = 64;

/// A message of a header.
#[derive(Clone, Debug)]
struct Message {
    kind: u8,
    /// The message with its prefix.
    whole: Range<usize>,
    body: Range<usize>,
    block: usize,
}

/// The places in a file of the messages of an object header.
#[derive(Debug)]
pub(super) struct Header {
    /// Whether the header has version 2, whose blocks end with a checksum.
    has_sums: bool,
    /// Bytes of each block, up to its checksum, and the start of its messages.
    blocks: Vec<(Range<usize>, usize)>,
    messages: Vec<Message>,
}

/// The number of `length` bytes at `at`.
fn number(bytes: &[u8], at: usize, length: usize) -> Option<usize> {
    let mut all = [0; 8];
    all[..length].copy_from_slice(bytes.get(at..at.checked_add(length)?)?);
    usize::try_from(u64::from_le_bytes(all)).ok()
}

impl Header {
    /// The header of an array at `at`. `None` if there is none, or one of another format.
    pub fn parse(bytes: &[u8], at: usize) -> Option<Self> {
        let has_sums = bytes.get(at..)?.starts_with(b"OHDR");
        let version = *bytes.get(at + if has_sums { 4 } else { 0 })?;
        let mut header = Self { has_sums, blocks: Vec::new(), messages: Vec::new() };
        // Bytes that each message has before its body.
        let mut prefix = 8;
        match (has_sums, version) {
            (true, 2) => {
                let flags = *bytes.get(at + 5)?;
                let (times, phases) = (flags >> 5 & 1, flags >> 4 & 1);
                let size_at = at + 6 + 16 * usize::from(times) + 4 * usize::from(phases);
                let width = 1 << (flags & 3);
                let first = size_at + width;
                prefix = 4 + 2 * usize::from(flags >> 2 & 1);
                header.blocks.push((at..first.checked_add(number(bytes, size_at, width)?)?, first));
            }
            (false, 1) => {
                let first = at + 16;
                header.blocks.push((at..first.checked_add(number(bytes, at + 8, 4)?)?, first));
            }
            _ => return None,
        }
        let mut block = 0;
        while let Some((range, first)) = header.blocks.get(block).cloned() {
            if range.end > bytes.len() || block == MOST_BLOCKS {
                return None;
            }
            let mut at = first;
            while at + prefix <= range.end {
                let (kind, size) = match has_sums {
                    true => (bytes[at], number(bytes, at + 1, 2)?),
                    false => (u8::try_from(number(bytes, at, 2)?).unwrap_or(u8::MAX), number(bytes, at + 2, 2)?),
                };
                let body = at + prefix..at + prefix + size;
                if body.end > range.end {
                    return None;
                }
                if kind == CONTINUATION {
                    let (start, length) = (number(bytes, body.start, 8)?, number(bytes, body.start + 8, 8)?);
                    let end = start.checked_add(length)?;
                    let next = match has_sums {
                        true => (start..end.checked_sub(4)?, start.checked_add(4)?),
                        false => (start..end, start),
                    };
                    header.blocks.push(next);
                }
                header.messages.push(Message { kind, whole: at..body.end, body: body.clone(), block });
                at = body.end;
            }
            block += 1;
        }
        header.layout(bytes).is_some().then_some(header)
    }

    fn find(&self, kind: u8) -> Option<&Message> {
        self.messages.iter().find(|message| message.kind == kind)
    }

    /// The layout message, and its version.
    fn layout(&self, bytes: &[u8]) -> Option<(&Message, u8)> {
        let message = self.find(LAYOUT)?;
        Some((message, *bytes.get(message.body.start)?))
    }

    /// The place of an array that stands in the header.
    pub fn compact(&self, bytes: &[u8]) -> Option<Range<usize>> {
        let (message, version) = self.layout(bytes)?;
        let start = message.body.start + 4;
        let is_compact = matches!(version, 3 | 4) && bytes.get(message.body.start + 1) == Some(&0);
        let range = start..start + number(bytes, message.body.start + 2, 2)?;
        (is_compact && range.end <= message.body.end).then_some(range)
    }

    /// Whether there is room for what [`Header::set_place`] says.
    pub fn has_room(&self) -> bool {
        let Some(layout) = self.find(LAYOUT) else { return false };
        let (block, first) = &self.blocks[layout.block];
        let others = self
            .messages
            .iter()
            .filter(|message| message.block == layout.block && !matches!(message.kind, LAYOUT | FILTERS | NOTHING));
        let needed = others.map(|message| message.whole.len()).sum::<usize>() + layout.whole.len() - layout.body.len();
        let is_alone = self.messages.iter().all(|message| message.kind != FILTERS || message.block == layout.block);
        layout.body.len() >= ONE_PIECE || self.has_sums && is_alone && needed + ONE_PIECE <= block.end - first
    }

    /// Says in the header that the array is in one piece, not packed, of a fixed size.
    /// `None` if it [has no room](Header::has_room) or is broken; `bytes` may be changed then.
    pub fn set_place(&self, bytes: &mut [u8], address: usize, length: usize) -> Option<()> {
        let layout = self.find(LAYOUT)?;
        let mut said = vec![3, 1];
        said.extend((address as u64).to_le_bytes());
        said.extend((length as u64).to_le_bytes());
        if let Some(space) = self.find(DATASPACE) {
            fix_size(&mut bytes[space.body.clone()])?;
        }
        let filters = self.find(FILTERS);
        if layout.body.len() >= ONE_PIECE {
            if let Some(filters) = filters {
                let width = if self.has_sums { 1 } else { 2 };
                bytes[filters.whole.start..filters.whole.start + width].fill(NOTHING);
            }
            bytes[layout.body.clone()].fill(0);
            bytes[layout.body.start..layout.body.start + ONE_PIECE].copy_from_slice(&said);
        } else {
            self.squeeze(bytes, layout, &said)?;
        }
        for block in 0..self.blocks.len() {
            self.sum(bytes, block);
        }
        Some(())
    }

    /// Puts a longer layout message where the layout and the filters are, and all other messages of
    /// the block after each other.
    fn squeeze(&self, bytes: &mut [u8], layout: &Message, said: &[u8]) -> Option<()> {
        let (block, first) = &self.blocks[layout.block];
        let prefix = layout.body.start - layout.whole.start;
        let mut messages = Vec::new();
        for message in self.messages.iter().filter(|message| message.block == layout.block) {
            match message.kind {
                LAYOUT => {
                    let at = messages.len();
                    messages.extend_from_slice(&bytes[layout.whole.start..layout.body.start]);
                    messages[at + 1..at + 3].copy_from_slice(&(ONE_PIECE as u16).to_le_bytes());
                    messages.extend_from_slice(said);
                }
                FILTERS | NOTHING => {}
                _ => messages.extend_from_slice(&bytes[message.whole.clone()]),
            }
        }
        let room = (block.end - first).checked_sub(messages.len()).filter(|_| self.has_room())?;
        // What is too short for a message is a gap.
        if room >= prefix {
            messages.push(NOTHING);
            messages.extend(u16::try_from(room - prefix).ok()?.to_le_bytes());
        }
        messages.resize(block.end - first, 0);
        bytes[*first..block.end].copy_from_slice(&messages);
        Some(())
    }

    /// Corrects the checksums of the blocks that hold these bytes.
    pub fn sum_of(&self, bytes: &mut [u8], changed: &Range<usize>) {
        for block in 0..self.blocks.len() {
            if self.blocks[block].0.contains(&changed.start) {
                self.sum(bytes, block);
            }
        }
    }

    fn sum(&self, bytes: &mut [u8], block: usize) {
        let range = self.blocks[block].0.clone();
        if self.has_sums {
            let sum = lookup3(&bytes[range.clone()]);
            bytes[range.end..range.end + 4].copy_from_slice(&sum.to_le_bytes());
        }
    }
}

/// Sets the greatest sizes in a dataspace message to the sizes: an array in one piece cannot grow.
fn fix_size(space: &mut [u8]) -> Option<()> {
    let (&version, &n_indices, &flags) = (space.first()?, space.get(1)?, space.get(2)?);
    let start = match version {
        1 => 8,
        2 => 4,
        _ => return None,
    };
    let length = 8 * usize::from(n_indices);
    if flags & 1 == 1 {
        if space.len() < start + 2 * length {
            return None;
        }
        space.copy_within(start..start + length, start + length);
    }
    Some(())
}

/// Place of the end of the file in the superblock, and whether a checksum stands at the end. `None`
/// if the file is of another format.
fn superblock(bytes: &[u8]) -> Option<(usize, bool)> {
    let is_hdf5 = bytes.starts_with(b"\x89HDF\r\n\x1a\n");
    let (widths, base, end, has_sum) = match *bytes.get(8)? {
        0 => (13, 24, 40, false),
        1 => (13, 28, 44, false),
        2 | 3 => (9, 12, 28, true),
        _ => return None,
    };
    let is_usual = bytes.get(widths..widths + 2)? == [8, 8] && number(bytes, base, 8)? == 0 && bytes.len() >= 56;
    (is_hdf5 && is_usual).then_some((end, has_sum))
}

/// Whether [`append`] can work.
pub(super) fn can_append(bytes: &[u8]) -> bool {
    superblock(bytes).is_some()
}

/// Appends bytes to a file that [`can_append`], and returns their place.
pub(super) fn append(bytes: &mut Vec<u8>, more: &[u8]) -> Option<usize> {
    let (end_at, has_sum) = superblock(bytes)?;
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    let place = bytes.len();
    bytes.extend_from_slice(more);
    let end = bytes.len() as u64;
    bytes[end_at..end_at + 8].copy_from_slice(&end.to_le_bytes());
    if has_sum {
        let sum = lookup3(&bytes[..44]);
        bytes[44..48].copy_from_slice(&sum.to_le_bytes());
    }
    Some(place)
}

/// B. Jenkins's hash, in its variant for bytes.
fn lookup3(bytes: &[u8]) -> u32 {
    let mut state = [0xdead_beef_u32.wrapping_add(bytes.len() as u32); 3];
    let n_before = bytes.len().saturating_sub(1) / 12 * 12;
    let (before, last) = bytes.split_at(n_before);
    for block in before.chunks_exact(12) {
        add(&mut state, block);
        // Each round mixes the three words cyclically.
        for (index, turn) in [4, 6, 8, 16, 19, 4].into_iter().enumerate() {
            let [to, from, other] = [index % 3, (index + 2) % 3, (index + 1) % 3];
            state[to] = state[to].wrapping_sub(state[from]) ^ state[from].rotate_left(turn);
            state[from] = state[from].wrapping_add(state[other]);
        }
    }
    if last.is_empty() {
        return state[2];
    }
    add(&mut state, last);
    for (index, turn) in [14, 11, 25, 16, 4, 14, 24].into_iter().enumerate() {
        let (to, from) = ((index + 2) % 3, (index + 1) % 3);
        state[to] = (state[to] ^ state[from]).wrapping_sub(state[from].rotate_left(turn));
    }
    state[2]
}

/// Adds up to twelve bytes to three words.
fn add(state: &mut [u32; 3], bytes: &[u8]) {
    for (word, bytes) in state.iter_mut().zip(bytes.chunks(4)) {
        let mut four = [0; 4];
        four[..bytes.len()].copy_from_slice(bytes);
        *word = word.wrapping_add(u32::from_le_bytes(four));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From the comments of the published lookup3.c.
    #[test]
    fn sums_are_those_of_the_published_examples() {
        assert_eq!(lookup3(b""), 0xdead_beef);
        assert_eq!(lookup3(b"Four score and seven years ago"), 0x1777_0551);
    }

    /// Dataspace messages of versions 1 and 2, of twelve values that may become any number.
    #[test]
    fn an_array_in_one_piece_cannot_grow() {
        for first in [&[1, 1, 1, 0, 0, 0, 0, 0][..], &[2, 1, 1, 1]] {
            let space = |most: u64| [first, &12u64.to_le_bytes(), &most.to_le_bytes()].concat();
            let mut fixed = space(u64::MAX);
            assert!(fix_size(&mut fixed).is_some());
            assert_eq!(fixed, space(12));
            assert!(fix_size(&mut space(9)[..first.len() + 12]).is_none());
        }
    }
}
