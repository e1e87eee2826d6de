//! Base64 (RFC 4648) as in VTK's files: consecutive chunks, each with its own padding.

const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// The value of each letter; 0xff for other bytes.
const VALUES: [u8; 256] = {
    let mut values = [0xff; 256];
    let mut value = 0;
    while value < 64 {
        values[ALPHABET[value] as usize] = value as u8;
        value += 1;
    }
    values
};

/// Decodes the first `wanted` bytes of a text. Also returns the index after the last letter used.
/// `None` if there are fewer letters, or invalid ones.
pub(super) fn decode(text: &[u8], wanted: usize) -> Option<(Vec<u8>, usize)> {
    if wanted > text.len() / 4 * 3 {
        return None;
    }
    // Most of the text: four letters at a time, up to the first white space or padding.
    let mut bytes = vec![0; wanted / 3 * 3];
    let groups = bytes.as_chunks_mut::<3>().0.iter_mut().zip(text.as_chunks::<4>().0);
    let n_plain = groups
        .map_while(|(bytes, letters)| {
            let [a, b, c, d] = letters.map(|letter| VALUES[letter as usize]);
            *bytes = [a << 2 | b >> 4, b << 4 | c >> 2, c << 6 | d];
            (a | b | c | d < 64).then_some(())
        })
        .count();
    bytes.truncate(3 * n_plain);
    let mut group = [0; 4];
    let mut filled = 0;
    let mut padding = 0;
    for (at, &letter) in text.iter().enumerate().skip(4 * n_plain) {
        if bytes.len() >= wanted && filled == 0 {
            bytes.truncate(wanted);
            return Some((bytes, at));
        }
        group[filled] = match letter {
            b'=' if filled >= 2 => {
                padding += 1;
                0
            }
            _ if letter.is_ascii_whitespace() => continue,
            _ if VALUES[letter as usize] < 64 && padding == 0 => VALUES[letter as usize],
            _ => return None,
        };
        filled += 1;
        if filled == 4 {
            let [a, b, c, d] = group;
            let three = [a << 2 | b >> 4, b << 4 | c >> 2, c << 6 | d];
            bytes.extend_from_slice(&three[..3 - padding]);
            (filled, padding) = (0, 0);
        }
    }
    if bytes.len() < wanted || filled != 0 {
        return None;
    }
    bytes.truncate(wanted);
    Some((bytes, text.len()))
}

/// Appends bytes as one chunk.
pub(super) fn encode(bytes: &[u8], text: &mut Vec<u8>) {
    for three in bytes.chunks(3) {
        let [a, b, c] = [three[0], three.get(1).copied().unwrap_or(0), three.get(2).copied().unwrap_or(0)];
        let group = [a >> 2, (a & 3) << 4 | b >> 4, (b & 15) << 2 | c >> 6, c & 63];
        let letters = group.map(|value| ALPHABET[value as usize]);
        text.extend_from_slice(&letters[..1 + three.len()]);
        text.extend_from_slice(&b"=="[..3 - three.len()]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The test vectors of RFC 4648, section 10.
    #[test]
    fn vectors_of_the_standard() {
        for (plain, coded) in [
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("fooba", "Zm9vYmE="),
            ("foobar", "Zm9vYmFy"),
        ] {
            let mut text = Vec::new();
            encode(plain.as_bytes(), &mut text);
            assert_eq!(text, coded.as_bytes());
            assert_eq!(decode(coded.as_bytes(), plain.len()), Some((plain.as_bytes().to_vec(), coded.len())));
            assert_eq!(decode(coded.as_bytes(), plain.len() + 1), None);
        }
        assert_eq!(decode(b"Zg==Zm8= rest", 3), Some((b"ffo".to_vec(), 8)));
        assert_eq!(decode(b"Z\ng =\t=", 1), Some((b"f".to_vec(), 7)));
        for broken in ["Zg=a", "Z===", "=Zg=", "Zg!=", "Zg"] {
            assert_eq!(decode(broken.as_bytes(), 1), None, "{broken}");
        }
    }
}
