// SPDX-License-Identifier: Apache-2.0
//! C types: the fixed-width integers, `float`, `double`, `bool`, fixed arrays of a type, and structs of these.
//!
//! A type is identified by its normalised declaration and its layout. Tags and typedef names are ignored; member names are significant.
mod codec;
mod parse;
mod tree;

pub use tree::{TypeForm, TypeTree};

use std::fmt;

/// A numeric or Boolean type.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Scalar {
    Int8,
    Int16,
    Int32,
    Int64,
    Uint8,
    Uint16,
    Uint32,
    Uint64,
    Float,
    Double,
    Bool,
}

impl Scalar {
    /// Returns the C name of the scalar.
    pub const fn name(self) -> &'static str {
        match self {
            Scalar::Int8 => "int8_t",
            Scalar::Int16 => "int16_t",
            Scalar::Int32 => "int32_t",
            Scalar::Int64 => "int64_t",
            Scalar::Uint8 => "uint8_t",
            Scalar::Uint16 => "uint16_t",
            Scalar::Uint32 => "uint32_t",
            Scalar::Uint64 => "uint64_t",
            Scalar::Float => "float",
            Scalar::Double => "double",
            Scalar::Bool => "bool",
        }
    }

    /// Returns the size in bytes, which is also the alignment.
    pub const fn size(self) -> usize {
        match self {
            Scalar::Int8 | Scalar::Uint8 | Scalar::Bool => 1,
            Scalar::Int16 | Scalar::Uint16 => 2,
            Scalar::Int32 | Scalar::Uint32 | Scalar::Float => 4,
            Scalar::Int64 | Scalar::Uint64 | Scalar::Double => 8,
        }
    }
}

/// A member of a struct.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Member {
    pub name: String,
    pub member_type: Type,
}

/// A C type with a layout that is the same on all platforms (LP64, natural alignment).
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Type {
    Scalar(Scalar),
    Array(Box<Type>, usize),
    Struct(Vec<Member>),
}

impl Type {
    /// Returns the size of a value in bytes, including padding.
    pub fn size(&self) -> usize {
        match self {
            Type::Scalar(scalar) => scalar.size(),
            Type::Array(element, count) => element.size() * count,
            Type::Struct(members) => {
                let end = members.iter().fold(0, |at, m| round_up(at, m.member_type.align()) + m.member_type.size());
                round_up(end, self.align())
            }
        }
    }

    /// Returns the alignment in bytes.
    pub fn align(&self) -> usize {
        match self {
            Type::Scalar(scalar) => scalar.size(),
            Type::Array(element, _) => element.align(),
            Type::Struct(members) => members.iter().map(|m| m.member_type.align()).max().unwrap_or(1),
        }
    }

    /// Returns the offset of each member of a struct (empty for any other type).
    pub fn offsets(&self) -> Vec<usize> {
        let Type::Struct(members) = self else { return Vec::new() };
        let mut end = 0;
        members
            .iter()
            .map(|m| {
                let offset = round_up(end, m.member_type.align());
                end = offset + m.member_type.size();
                offset
            })
            .collect()
    }

    /// Returns the normalised declaration without tags and typedef names: `struct { double x; double[4] q; }`.
    pub fn normalised(&self) -> String {
        self.to_string()
    }

    /// Returns an identity that is the same across modules and machines: a hash (FNV-1a) of the normalised declaration and the layout.
    pub fn hash(&self) -> u64 {
        let text = format!("{self}|{}|{}|{:?}", self.size(), self.align(), self.offsets());
        text.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3))
    }
}

impl fmt::Display for Type {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Type::Scalar(scalar) => f.write_str(scalar.name()),
            Type::Array(element, count) => {
                let mut counts = vec![*count];
                let mut innermost = element;
                while let Type::Array(element, count) = &**innermost {
                    counts.push(*count);
                    innermost = element;
                }
                write!(f, "{innermost}")?;
                counts.iter().try_for_each(|count| write!(f, "[{count}]"))
            }
            Type::Struct(members) => {
                f.write_str("struct {")?;
                members.iter().try_for_each(|m| write!(f, " {} {};", m.member_type, m.name))?;
                f.write_str(" }")
            }
        }
    }
}

const fn round_up(at: usize, align: usize) -> usize {
    at.div_ceil(align) * align
}
