//! Decimal numbers, also in the spellings of Fortran.

use std::str::from_utf8;

/// The number spelled by some bytes, `nan` and `inf` included. `None` if they spell no number.
///
/// Fortran writes the exponent of a double with the letter D (`1.0D+00`). It omits the letter where
/// the exponent has three digits (`1.0-101`).
#[inline]
pub(crate) fn parse_double(token: &[u8]) -> Option<f64> {
    from_utf8(token).ok()?.parse().ok().or_else(|| fortran(token))
}

/// [`parse_double`] of a text.
pub(crate) fn parse_number(word: &str) -> Option<f64> {
    parse_double(word.as_bytes())
}

/// Words about a number with a decimal comma. Empty for every other word.
pub(crate) fn comma_advice(word: &str) -> &'static str {
    let is_comma = word.matches(',').count() == 1 && parse_number(&word.replace(',', ".")).is_some();
    if is_comma { ": it has a decimal comma, expected a decimal point" } else { "" }
}

/// Fortran writes no number with more bytes.
const LONGEST: usize = 64;

#[cold]
fn fortran(token: &[u8]) -> Option<f64> {
    let is_sign = |byte: &u8| matches!(byte, b'+' | b'-');
    let letter = token.iter().position(|byte| matches!(byte, b'd' | b'D'));
    // A sign without a letter begins an exponent only after a mantissa with a point and before
    // three digits. `1-2` is no number.
    let sign = || {
        let sign = 1 + token.get(1..)?.iter().position(is_sign)?;
        let digits = &token[sign + 1..];
        let is_exponent = digits.len() == 3 && digits.iter().all(u8::is_ascii_digit);
        (is_exponent && token[..sign].contains(&b'.')).then_some(sign)
    };
    let (mantissa, exponent) = match letter {
        Some(letter) => (&token[..letter], &token[letter + 1..]),
        None => token.split_at(sign()?),
    };
    // Mantissa and exponent must be plain digits. Otherwise words such as `nan`, or a second
    // exponent, could form a number.
    let is_plain = |part: &[u8], also: u8| {
        let digits = part.strip_prefix(b"+").or_else(|| part.strip_prefix(b"-")).unwrap_or(part);
        digits.iter().any(u8::is_ascii_digit) && digits.iter().all(|&byte| byte.is_ascii_digit() || byte == also)
    };
    if token.len() > LONGEST || !is_plain(mantissa, b'.') || !is_plain(exponent, b'0') {
        return None;
    }
    let mut usual = [0; LONGEST + 1];
    let length = mantissa.len() + 1 + exponent.len();
    usual[..mantissa.len()].copy_from_slice(mantissa);
    usual[mantissa.len()] = b'e';
    usual[mantissa.len() + 1..length].copy_from_slice(exponent);
    from_utf8(&usual[..length]).ok()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::parse_number;

    #[test]
    fn numbers_of_fortran_are_read() {
        for (word, value) in [
            ("1.0D+00", 1.0),
            ("1.d0", 1.0),
            ("-.25D-02", -0.0025),
            ("+5d3", 5000.0),
            ("1.5-101", 1.5e-101),
            ("-0.25+102", -0.25e102),
            ("1.0D-400", 0.0),
            ("1e3", 1000.0),
        ] {
            assert_eq!(parse_number(word), Some(value), "{word}");
        }
        let long = format!("1.{}d0", "0".repeat(80));
        for word in [
            "", "d", "1d", "d0", "1d+", "1d1d1", "1e1d1", "1.0d1.0", "nand1", "1-2", "1-101", "1.0-10", "1.0-",
            "2..5d0", "1 d0", "-", "--1d0", "1d+-1", &long,
        ] {
            assert_eq!(parse_number(word), None, "{word}");
        }
        assert!(parse_number("nan").unwrap().is_nan() && parse_number("1d999") == Some(f64::INFINITY));
    }
}
