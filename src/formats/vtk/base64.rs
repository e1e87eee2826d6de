//! Base64 (RFC 4648) as in VTK's files: consecutive chunks, each with its own padding.

use base64::engine::{GeneralPurpose, GeneralPurposeConfig};
use base64::{Engine, alphabet};

/// Before padding some writers leave bits that belong to no byte.
const STANDARD: GeneralPurpose =
    GeneralPurpose::new(&alphabet::STANDARD, GeneralPurposeConfig::new().with_decode_allow_trailing_bits(true));

/// Decodes the first `wanted` bytes of a text. Also returns the index after the last letter used.
/// `None` if there are fewer letters, or invalid ones.
pub(super) fn decode(text: &[u8], wanted: usize) -> Option<(Vec<u8>, usize)> {
    if wanted > text.len() / 4 * 3 {
        return None;
    }
    // Most arrays are one chunk without white space.
    let letters = wanted.div_ceil(3) * 4;
    if let Some(Ok(mut bytes)) = text.get(..letters).map(|chunk| STANDARD.decode(chunk))
        && bytes.len() >= wanted
    {
        bytes.truncate(wanted);
        return Some((bytes, letters));
    }
    let mut bytes = Vec::with_capacity(wanted);
    let mut group = Vec::with_capacity(4);
    for (at, letter) in text.iter().enumerate().filter(|(_, letter)| !letter.is_ascii_whitespace()) {
        group.push(*letter);
        if group.len() == 4 {
            STANDARD.decode_vec(&group, &mut bytes).ok()?;
            group.clear();
            if bytes.len() >= wanted {
                bytes.truncate(wanted);
                return Some((bytes, at + 1));
            }
        }
    }
    if wanted == 0 { Some((bytes, 0)) } else { None }
}

/// Appends bytes as one chunk.
pub(super) fn encode(bytes: &[u8], text: &mut Vec<u8>) {
    let start = text.len();
    text.resize(start + bytes.len().div_ceil(3) * 4, 0);
    let length = STANDARD.encode_slice(bytes, &mut text[start..]);
    assert_eq!(length, Ok(text.len() - start), "a chunk has four letters for three bytes");
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
        // Bits that belong to no byte.
        assert_eq!(decode(b"Zh==Zm9=", 3), Some((b"ffo".to_vec(), 8)));
        for broken in ["Zg=a", "Z===", "=Zg=", "Zg!=", "Zg"] {
            assert_eq!(decode(broken.as_bytes(), 1), None, "{broken}");
        }
    }
}
