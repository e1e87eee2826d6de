//! The types of numbers in VTK files.

use crate::formats::scanner::Endian;

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
    /// By its name in XML files (`Int32`) or in legacy files (`int`).
    pub fn named(name: &str) -> Option<Self> {
        Some(match name {
            "Int8" | "char" | "signed_char" => Number::I8,
            "UInt8" | "unsigned_char" => Number::U8,
            "Int16" | "short" => Number::I16,
            "UInt16" | "unsigned_short" => Number::U16,
            "Int32" | "int" => Number::I32,
            "UInt32" | "unsigned_int" => Number::U32,
            "Int64" | "long" | "vtktypeint64" | "vtkIdType64" | "long_long" => Number::I64,
            "UInt64" | "unsigned_long" | "vtktypeuint64" => Number::U64,
            "Float32" | "float" => Number::F32,
            "Float64" | "double" => Number::F64,
            _ => return None,
        })
    }

    /// Size in a binary file.
    pub fn bytes(self) -> usize {
        match self {
            Number::I8 | Number::U8 => 1,
            Number::I16 | Number::U16 => 2,
            Number::I32 | Number::U32 | Number::F32 => 4,
            Number::I64 | Number::U64 | Number::F64 => 8,
        }
    }

    /// Binary numbers as integers; none if one is no whole number or too large.
    pub fn integers(self, bytes: &[u8], endian: Endian) -> Option<Vec<i64>> {
        match self {
            Number::I8 => Some(bytes.iter().map(|&byte| i64::from(byte as i8)).collect()),
            Number::U8 => Some(bytes.iter().map(|&byte| i64::from(byte)).collect()),
            Number::I16 => Some(all(bytes, endian, i16::from_le_bytes)),
            Number::U16 => Some(all(bytes, endian, u16::from_le_bytes)),
            Number::I32 => Some(all(bytes, endian, i32::from_le_bytes)),
            Number::U32 => Some(all(bytes, endian, u32::from_le_bytes)),
            Number::I64 => Some(all(bytes, endian, i64::from_le_bytes)),
            Number::U64 => {
                let values: Vec<u64> = all(bytes, endian, u64::from_le_bytes);
                values.into_iter().map(|value| i64::try_from(value).ok()).collect()
            }
            Number::F32 | Number::F64 => {
                let whole = |value: f64| (value.fract() == 0.0 && value.abs() < 9.0e15).then_some(value as i64);
                self.doubles(bytes, endian).into_iter().map(whole).collect()
            }
        }
    }

    /// Binary numbers as doubles.
    pub fn doubles(self, bytes: &[u8], endian: Endian) -> Vec<f64> {
        match self {
            Number::F32 => all::<4, f32, f64>(bytes, endian, f32::from_le_bytes),
            Number::F64 => all(bytes, endian, f64::from_le_bytes),
            _ => self.integers(bytes, endian).unwrap_or_default().into_iter().map(|value| value as f64).collect(),
        }
    }
}

fn all<const N: usize, T, U: From<T>>(bytes: &[u8], endian: Endian, of: fn([u8; N]) -> T) -> Vec<U> {
    let (chunks, _) = bytes.as_chunks::<N>();
    let turned = |&(mut chunk): &[u8; N]| {
        if endian == Endian::Big {
            chunk.reverse();
        }
        U::from(of(chunk))
    };
    chunks.iter().map(turned).collect()
}
