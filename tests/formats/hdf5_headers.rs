//! The checksums of an HDF5 file's object headers, so that damage does not stop at them.
//!
//! Source: the HDF5 File Format Specification, version 3, "Version 2 Data Object Header Prefix";
//! the hash is B. Jenkins's lookup3.

/// The file with checksums that fit its headers. Other bytes stay.
pub fn with_checksums(bytes: &[u8]) -> Vec<u8> {
    let mut repaired = bytes.to_vec();
    for start in (0..bytes.len()).filter(|&at| bytes[at..].starts_with(b"OHDR")) {
        let length = end_of_header(&bytes[start..]);
        if let Some((header, _)) = length.and_then(|length| bytes[start..].split_at_checked(length))
            && let Some(place) = repaired[start + header.len()..].first_chunk_mut()
        {
            *place = lookup3(header).to_le_bytes();
        }
    }
    repaired
}

/// Number of bytes of a header before its checksum.
fn end_of_header(header: &[u8]) -> Option<usize> {
    let flags = *header.get(5)?;
    let times = if flags & 0x20 == 0 { 0 } else { 16 };
    let phases = if flags & 0x10 == 0 { 0 } else { 4 };
    let (size_at, width) = (6 + times + phases, 1 << (flags & 3));
    let mut size = [0; 8];
    size[..width].copy_from_slice(header.get(size_at..size_at + width)?);
    usize::try_from(u64::from_le_bytes(size)).ok()?.checked_add(size_at + width)
}

fn lookup3(bytes: &[u8]) -> u32 {
    let start = 0xdead_beef_u32.wrapping_add(bytes.len() as u32);
    let [mut a, mut b, mut c] = [start; 3];
    // The last block has one to twelve bytes.
    let n_before = bytes.len().saturating_sub(1) / 12 * 12;
    let (before, last) = bytes.split_at(n_before);
    let add = |block: &[u8], [a, b, c]: [&mut u32; 3]| {
        let mut full = [0; 12];
        full[..block.len()].copy_from_slice(block);
        for (sum, word) in [a, b, c].into_iter().zip(full.as_chunks::<4>().0) {
            *sum = sum.wrapping_add(u32::from_le_bytes(*word));
        }
    };
    for block in before.chunks(12) {
        add(block, [&mut a, &mut b, &mut c]);
        for turns in [[4, 6, 8], [16, 19, 4]] {
            a = a.wrapping_sub(c) ^ c.rotate_left(turns[0]);
            c = c.wrapping_add(b);
            b = b.wrapping_sub(a) ^ a.rotate_left(turns[1]);
            a = a.wrapping_add(c);
            c = c.wrapping_sub(b) ^ b.rotate_left(turns[2]);
            b = b.wrapping_add(a);
        }
    }
    add(last, [&mut a, &mut b, &mut c]);
    c = (c ^ b).wrapping_sub(b.rotate_left(14));
    a = (a ^ c).wrapping_sub(c.rotate_left(11));
    b = (b ^ a).wrapping_sub(a.rotate_left(25));
    c = (c ^ b).wrapping_sub(b.rotate_left(16));
    a = (a ^ c).wrapping_sub(c.rotate_left(4));
    b = (b ^ a).wrapping_sub(a.rotate_left(14));
    (c ^ b).wrapping_sub(b.rotate_left(24))
}
