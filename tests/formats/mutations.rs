//! Random damage to the bytes of a file, of text and of binary numbers.

use std::io::Write;
use std::ops::Range;

use flate2::Compression;
use flate2::write::GzEncoder;

/// Xorshift: good enough, and the same everywhere.
pub struct Random(pub u64);

impl Random {
    pub fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as usize % limit.max(1)
    }

    fn of<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.below(list.len())]
    }

    fn yes(&mut self) -> bool {
        self.below(2) == 0
    }

    /// A range of `length` bytes at most.
    fn piece(&mut self, bytes: &[u8], length: usize) -> Range<usize> {
        let start = self.below(bytes.len());
        start..start + self.below(length.min(bytes.len() - start) + 1)
    }
}

/// Numbers that break things where they are taken for counts, indices or sizes.
const NUMBERS: [i64; 10] =
    [0, -1, 1, 7, i32::MAX as i64, i32::MIN as i64, u32::MAX as i64, i64::MAX, i64::MIN, 1 << 40];
const WORDS: [&str; 13] = [
    "nan",
    "-inf",
    "1e999",
    "-1",
    "18446744073709551615",
    "99999999",
    "0",
    "-0.0",
    "\n",
    "2147483648",
    "4e-320",
    "1e300",
    "-3e38",
];

/// Bytes that text must not hold, or holds with another meaning.
const ODD: [&[u8]; 16] = [
    b"\0",
    b"\0\0\0\0",
    b"\xff",
    b"\xc3\xa9",
    b"\xe2\x80\xa8",
    b"\xc2\xa0",
    b"\r",
    b"\r\n",
    b"\t",
    b"\x0b",
    b"\x1a",
    b"\"",
    b"--",
    b", 2=",
    b"&#45;",
    b"<!-- families: 1=a, 2=a -->",
];

/// Damages a file in one to four places, now and then in many, and gzips some files.
pub fn damage(seed: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    let most = if random.below(20) == 0 { 12 } else { 4 };
    for _ in 0..1 + random.below(most) {
        if bytes.is_empty() {
            break;
        }
        match random.below(18) {
            0..4 => flip(&mut bytes, random),
            4 | 5 => set_number(&mut bytes, random),
            6 | 7 => change_number(&mut bytes, random),
            8..11 => change_word(&mut bytes, random),
            11..13 => change_piece(&mut bytes, random),
            13 => change_lines(&mut bytes, random),
            14 => insert_odd(&mut bytes, random),
            15 => swap_numbers(&mut bytes, random),
            _ => change_digit(&mut bytes, random),
        }
    }
    if random.below(50) == 0 { zip(&bytes, random) } else { bytes }
}

/// A bit, a byte, or the end of the file.
fn flip(bytes: &mut Vec<u8>, random: &mut Random) {
    let at = random.below(bytes.len());
    match random.below(6) {
        0 | 1 => bytes[at] ^= 1 << random.below(8),
        2 => bytes[at] = random.of(b"0-$\n \xff<>%=\"#"),
        // The next letter, of base64 too.
        3 => bytes[at] = bytes[at].wrapping_add(1),
        4 => bytes.truncate(at),
        _ => drop(bytes.drain(at..(at + random.below(9)).min(bytes.len()))),
    }
}

/// A number in a binary file, of either byte order.
fn set_number(bytes: &mut [u8], random: &mut Random) {
    let mut number = random.of(&NUMBERS).to_le_bytes()[..random.of(&[4, 8])].to_vec();
    if random.yes() {
        number.reverse();
    }
    let at = random.below(bytes.len()) / 4 * 4;
    let end = (at + number.len()).min(bytes.len());
    bytes[at..end].copy_from_slice(&number[..end - at]);
}

/// A little more or less, or twice as much.
fn changed(value: i64, random: &mut Random) -> i64 {
    match random.below(4) {
        0 => value.wrapping_add(1 + random.below(8) as i64),
        1 => value.wrapping_sub(1 + random.below(8) as i64),
        2 => value.wrapping_mul(2),
        _ => value.wrapping_neg(),
    }
}

/// A number becomes a little greater or less: in text, or in a binary file of either byte order.
fn change_number(bytes: &mut Vec<u8>, random: &mut Random) {
    if random.yes() {
        let Some(word) = word(bytes, random) else { return };
        if let Ok(number) = String::from_utf8_lossy(&bytes[word.clone()]).parse::<i64>() {
            drop(bytes.splice(word, changed(number, random).to_string().into_bytes()));
        }
        return;
    }
    let at = random.below(bytes.len()) / 4 * 4;
    let Some(place) = bytes[at..].first_chunk_mut::<4>() else { return };
    *place = match random.yes() {
        true => (changed(i32::from_le_bytes(*place).into(), random) as i32).to_le_bytes(),
        false => (changed(i32::from_be_bytes(*place).into(), random) as i32).to_be_bytes(),
    };
}

/// The range of a word in a text. `None` where it is long, as in a binary file.
fn word(bytes: &[u8], random: &mut Random) -> Option<Range<usize>> {
    let at = random.below(bytes.len());
    let blank = |byte: &u8| byte.is_ascii_whitespace() || *byte == b'"';
    let start = bytes[..at].iter().rposition(blank).map_or(0, |place| place + 1);
    let end = bytes[at..].iter().position(blank).map_or(bytes.len(), |place| at + place);
    (start < end && end - start < 40).then_some(start..end)
}

/// A word of a text becomes another one: one that breaks things, or another one of the file.
fn change_word(bytes: &mut Vec<u8>, random: &mut Random) {
    let Some(old) = word(bytes, random) else { return };
    let new = if random.yes() {
        random.of(&WORDS).into()
    } else {
        word(bytes, random).map_or_else(Vec::new, |other| bytes[other].to_vec())
    };
    drop(bytes.splice(old, new));
}

/// A piece once more, somewhere else, there in place of what was there or not; or two pieces change
/// their places.
fn change_piece(bytes: &mut Vec<u8>, random: &mut Random) {
    let length = if random.yes() { 64 } else { bytes.len() / 2 };
    let of = random.piece(bytes, length);
    let piece = bytes[of.clone()].to_vec();
    let to = random.below(bytes.len());
    let end = (to + piece.len()).min(bytes.len());
    match random.below(3) {
        0 => drop(bytes.splice(to..to, piece)),
        1 => drop(bytes.splice(to..end, piece)),
        _ => {
            let other = bytes[to..end].to_vec();
            bytes[to..end].copy_from_slice(&piece[..end - to]);
            let place = of.start..of.start + other.len();
            bytes[place].copy_from_slice(&other);
        }
    }
}

/// Lines that occur twice, are missing, change their places, or end as on other systems.
fn change_lines(bytes: &mut Vec<u8>, random: &mut Random) {
    let mut lines: Vec<&[u8]> = bytes.split_inclusive(|&byte| byte == b'\n').collect();
    let (first, second) = (random.below(lines.len()), random.below(lines.len()));
    let some = first..(first + 1 + random.below(20)).min(lines.len());
    match random.below(5) {
        0 => {
            let moved: Vec<_> = lines.drain(some).collect();
            let to = second.min(lines.len());
            drop(lines.splice(to..to, moved));
        }
        1 => {
            let copied = lines[some].to_vec();
            drop(lines.splice(second..second, copied));
        }
        2 => drop(lines.drain(some)),
        3 => lines.swap(first, second),
        _ => {
            let end: &[u8] = random.of(&[b"\r\n", b"\r", b"\n\n"]);
            let ended =
                lines.iter().map(|line| line.strip_suffix(b"\n").map_or(line.to_vec(), |line| [line, end].concat()));
            *bytes = ended.collect::<Vec<_>>().concat();
            return;
        }
    }
    *bytes = lines.concat();
}

fn insert_odd(bytes: &mut Vec<u8>, random: &mut Random) {
    let at = random.below(bytes.len() + 1);
    drop(bytes.splice(at..at, random.of(&ODD).to_vec()));
}

/// A digit of a text becomes another one, so that most numbers stay numbers.
pub fn change_digit(bytes: &mut [u8], random: &mut Random) {
    let start = random.below(bytes.len());
    if let Some(digit) = bytes[start..].iter_mut().find(|byte| byte.is_ascii_digit()) {
        *digit = random.of(b"0123456789");
    }
}

/// A number of a binary file becomes another one of the file.
fn swap_numbers(bytes: &mut [u8], random: &mut Random) {
    let width = random.of(&[4, 8]);
    if bytes.len() < width {
        return;
    }
    let step = random.of(&[1, width]);
    let [from, to] = [0; 2].map(|_| random.below(bytes.len() - width + 1) / step * step);
    bytes.copy_within(from..from + width, to);
}

/// The file gzipped: in two members, cut short, changed within, or with bytes after the end.
fn zip(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let cut = random.below(bytes.len() + 1);
    let mut zipped = Vec::new();
    for part in [&bytes[..cut], &bytes[cut..]] {
        let mut encoder = GzEncoder::new(&mut zipped, Compression::fast());
        encoder.write_all(part).unwrap();
        encoder.finish().unwrap();
    }
    let at = random.below(zipped.len());
    match random.below(5) {
        0 => zipped.truncate(at),
        1 => zipped[at] ^= 1 << random.below(8),
        2 => zipped.extend_from_slice(b"\0\0rest"),
        _ => {}
    }
    zipped
}
