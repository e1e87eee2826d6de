//! Number types of arrays in binary files, and whole numbers that are read in place.

use std::borrow::Cow;

use super::scanner::Endian;

/// A type of number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Number {
    /// The type with VTK's name in XML files (`Int32`) or in legacy files (`int`).
    pub fn named(name: &str) -> Option<Self> {
        Some(match name {
            "Int8" | "char" | "signed_char" => Number::I8,
            "UInt8" | "unsigned_char" => Number::U8,
            "Int16" | "short" => Number::I16,
            "UInt16" | "unsigned_short" => Number::U16,
            // VTK writes its type of indices into legacy files as `int`.
            "Int32" | "int" | "vtktypeint32" | "vtkIdType" => Number::I32,
            "UInt32" | "unsigned_int" => Number::U32,
            "Int64" | "long" | "vtktypeint64" | "vtkIdType64" | "long_long" => Number::I64,
            "UInt64" | "unsigned_long" | "vtktypeuint64" => Number::U64,
            "Float32" | "float" => Number::F32,
            "Float64" | "double" => Number::F64,
            _ => return None,
        })
    }

    /// Size in a binary file, in bytes.
    pub fn bytes(self) -> usize {
        match self {
            Number::I8 | Number::U8 => 1,
            Number::I16 | Number::U16 => 2,
            Number::I32 | Number::U32 | Number::F32 => 4,
            Number::I64 | Number::U64 | Number::F64 => 8,
        }
    }

    /// Converts binary numbers to doubles. The result is empty if a whole number does not fit a
    /// signed integer of 64 bits.
    pub fn doubles(self, bytes: &[u8], endian: Endian) -> Vec<f64> {
        let mut whole = Vec::new();
        match self {
            Number::F32 => all::<4, f32, f64>(bytes, endian, f32::from_le_bytes).collect(),
            Number::F64 => all(bytes, endian, f64::from_le_bytes).collect(),
            _ if self.convert(bytes, endian, &mut whole).is_some() => {
                whole.into_iter().map(|value| value as f64).collect()
            }
            _ => Vec::new(),
        }
    }

    /// Appends binary numbers as integers. `None` if one is no whole number, or too large.
    fn convert(self, bytes: &[u8], endian: Endian, values: &mut Vec<i64>) -> Option<()> {
        match self {
            Number::I8 => values.extend(bytes.iter().map(|&byte| i64::from(byte as i8))),
            Number::U8 => values.extend(bytes.iter().map(|&byte| i64::from(byte))),
            Number::I16 => values.extend(all::<2, i16, i64>(bytes, endian, i16::from_le_bytes)),
            Number::U16 => values.extend(all::<2, u16, i64>(bytes, endian, u16::from_le_bytes)),
            Number::I32 => values.extend(all::<4, i32, i64>(bytes, endian, i32::from_le_bytes)),
            Number::U32 => values.extend(all::<4, u32, i64>(bytes, endian, u32::from_le_bytes)),
            Number::I64 => values.extend(all::<8, i64, i64>(bytes, endian, i64::from_le_bytes)),
            Number::U64 => {
                for value in all::<8, u64, u64>(bytes, endian, u64::from_le_bytes) {
                    values.push(i64::try_from(value).ok()?);
                }
            }
            Number::F32 | Number::F64 => {
                for value in self.doubles(bytes, endian) {
                    values.push((value.fract() == 0.0 && value.abs() < 9.0e15).then_some(value as i64)?);
                }
            }
        }
        Some(())
    }

    /// Whether every number of this type fits a signed integer of 64 bits.
    fn is_whole(self) -> bool {
        !matches!(self, Number::U64 | Number::F32 | Number::F64)
    }
}

fn all<const N: usize, T, U: From<T>>(bytes: &[u8], endian: Endian, of: fn([u8; N]) -> T) -> impl Iterator<Item = U> {
    let (chunks, _) = bytes.as_chunks::<N>();
    chunks.iter().map(move |&(mut chunk)| {
        if endian == Endian::Big {
            chunk.reverse();
        }
        U::from(of(chunk))
    })
}

/// Numbers converted at a time.
const BLOCK: usize = 1024;

/// An array of whole numbers. The numbers of a binary file are converted in place, block by block:
/// memory for all of them would take more time than the rest of reading.
pub(super) struct Integers<'a> {
    bytes: Cow<'a, [u8]>,
    number: Number,
    endian: Endian,
    len: usize,
    /// The converted numbers from index `start` on.
    block: Vec<i64>,
    start: usize,
}

impl<'a> Integers<'a> {
    /// The numbers of this type in `bytes`. `None` if one is no whole number, or too large.
    pub fn stored(bytes: Cow<'a, [u8]>, number: Number, endian: Endian) -> Option<Self> {
        if !number.is_whole() {
            let mut values = Vec::new();
            number.convert(&bytes, endian, &mut values)?;
            return Some(values.into());
        }
        let len = bytes.len() / number.bytes();
        Some(Self { bytes, number, endian, len, block: Vec::new(), start: 0 })
    }

    pub fn len(&self) -> usize {
        self.len
    }

    /// The number at `index`. Fast for consecutive indices.
    #[inline]
    pub fn get(&mut self, index: usize) -> Option<i64> {
        match self.block.get(index.wrapping_sub(self.start)) {
            Some(&value) => Some(value),
            None => self.load(index),
        }
    }

    /// Converts the block that begins at `index`.
    #[cold]
    fn load(&mut self, index: usize) -> Option<i64> {
        if index >= self.len {
            return None;
        }
        let end = self.len.min(index + BLOCK);
        let bytes = self.bytes.get(index * self.number.bytes()..end * self.number.bytes())?;
        self.start = index;
        self.block.clear();
        self.number.convert(bytes, self.endian, &mut self.block)?;
        self.block.first().copied()
    }
}

impl From<Vec<i64>> for Integers<'_> {
    fn from(block: Vec<i64>) -> Self {
        let len = block.len();
        Self { bytes: Cow::Borrowed(&[]), number: Number::I64, endian: Endian::Little, len, block, start: 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In order, backwards and at random, over several blocks and past the end, in either byte
    /// order.
    #[test]
    fn integers_are_those_of_the_bytes() {
        let values: Vec<i32> = (0..3 * BLOCK as i32 + 5).map(|index| (index - 700).wrapping_mul(1_234_567)).collect();
        for endian in [Endian::Little, Endian::Big] {
            let bytes: Vec<u8> = values
                .iter()
                .flat_map(|value| match endian {
                    Endian::Little => value.to_le_bytes(),
                    Endian::Big => value.to_be_bytes(),
                })
                .collect();
            let mut integers = Integers::stored(Cow::Borrowed(&bytes), Number::I32, endian).unwrap();
            let n = values.len();
            assert_eq!(integers.len(), n);
            for index in (0..n).chain((0..n).rev()).chain((0..n).map(|index| index * 997 % n)) {
                assert_eq!(integers.get(index), Some(values[index].into()), "{index}");
            }
            assert_eq!((integers.get(n), integers.get(usize::MAX)), (None, None));
        }
    }

    #[test]
    fn only_whole_numbers_are_integers() {
        let of = |value: f64| Integers::stored(Cow::Owned(value.to_le_bytes().to_vec()), Number::F64, Endian::Little);
        assert_eq!(of(-3.0).unwrap().get(0), Some(-3));
        assert!([0.5, f64::NAN, 1e300].into_iter().all(|value| of(value).is_none()));
        let large = Cow::Owned(u64::MAX.to_le_bytes().to_vec());
        assert!(Integers::stored(large, Number::U64, Endian::Little).is_none());
    }
}
