// SPDX-License-Identifier: Apache-2.0
//! Types of a channel: a number, or a fixed-size array of numbers.
use std::fmt;
use std::str::FromStr;

/// Number of a fixed width, or a Boolean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Number {
    Bool,
    Int8,
    Uint8,
    Int16,
    Uint16,
    Int32,
    Uint32,
    Int64,
    Uint64,
    Float,
    Double,
}

/// Number types, each with its C name and its width in bytes.
const NUMBERS: [(Number, &str, usize); 11] = [
    (Number::Bool, "bool", 1),
    (Number::Int8, "int8_t", 1),
    (Number::Uint8, "uint8_t", 1),
    (Number::Int16, "int16_t", 2),
    (Number::Uint16, "uint16_t", 2),
    (Number::Int32, "int32_t", 4),
    (Number::Uint32, "uint32_t", 4),
    (Number::Int64, "int64_t", 8),
    (Number::Uint64, "uint64_t", 8),
    (Number::Float, "float", 4),
    (Number::Double, "double", 8),
];

impl Number {
    fn row(self) -> &'static (Number, &'static str, usize) {
        NUMBERS.iter().find(|(number, ..)| *number == self).expect("every number has a row")
    }

    /// Returns the C name.
    pub fn name(self) -> &'static str {
        self.row().1
    }

    /// Returns the width in bytes, which is also the alignment.
    pub fn width(self) -> usize {
        self.row().2
    }
}

/// Type of a channel. As text, it is a C type such as `double` or `int16_t[4]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Type {
    pub number: Number,
    /// Number of elements of an array.
    pub elements: Option<usize>,
}

impl Type {
    pub const DOUBLE: Type = Type::of(Number::Double);
    pub const BOOL: Type = Type::of(Number::Bool);

    /// Creates the type of a single number.
    pub const fn of(number: Number) -> Type {
        Type { number, elements: None }
    }

    /// Creates the type of an array of `elements` doubles; a single double is not an array.
    pub const fn doubles(elements: usize) -> Type {
        Type { number: Number::Double, elements: if elements == 1 { None } else { Some(elements) } }
    }

    /// Returns the number of elements.
    pub fn count(self) -> usize {
        self.elements.unwrap_or(1)
    }

    /// Returns the length in bytes.
    #[allow(clippy::len_without_is_empty)]
    pub fn len(self) -> usize {
        self.number.width() * self.count()
    }
}

impl fmt::Display for Type {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.elements {
            None => f.write_str(self.number.name()),
            Some(elements) => write!(f, "{}[{elements}]", self.number.name()),
        }
    }
}

impl FromStr for Type {
    /// Error message.
    type Err = String;

    fn from_str(text: &str) -> Result<Type, String> {
        let (name, elements) = match text.split_once('[') {
            None => (text, None),
            Some((name, count)) => (name, Some(count.trim_end_matches(']').parse().map_err(|_| format!("there is no type '{text}'"))?)),
        };
        let found = NUMBERS.iter().find(|(_, of, _)| *of == name);
        let (number, ..) = found.ok_or_else(|| format!("there is no type '{name}'; use double, float, bool, int8_t to int64_t or uint8_t to uint64_t"))?;
        Ok(Type { number: *number, elements })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_type_is_its_text() {
        for (text, len) in [("double", 8), ("float[3]", 12), ("bool", 1), ("uint16_t[4]", 8), ("double[1]", 8)] {
            let parsed: Type = text.parse().unwrap();
            assert_eq!((parsed.to_string(), parsed.len()), (text.to_owned(), len));
        }
        assert_eq!(Type::doubles(1), Type::DOUBLE);
        assert_eq!("complex".parse::<Type>(), Err("there is no type 'complex'; use double, float, bool, int8_t to int64_t or uint8_t to uint64_t".to_owned()));
        assert_eq!("double[x]".parse::<Type>(), Err("there is no type 'double[x]'".to_owned()));
    }
}
