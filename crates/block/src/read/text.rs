// SPDX-License-Identifier: Apache-2.0
//! Parsing of type texts.

use super::TypeFace;

/// Returns the normalised form of a type text: blanks only between two words, `bool` for `_Bool`.
pub fn normalise(text: &str) -> String {
    let mut words = String::new();
    let is_letter = |c: char| c.is_ascii_alphanumeric() || c == '_';
    for word in text.split_whitespace() {
        // Blanks are kept between two words, and between the members of a struct.
        let apart = words.ends_with([';', '{', ']']) && !word.starts_with(['[', ';']) || word.starts_with(['{', '}']);
        let joined = words.ends_with(is_letter) && word.starts_with(is_letter);
        if !words.is_empty() && (apart || joined) {
            words.push(' ');
        }
        words.push_str(word);
    }
    words.replace("_Bool", "bool")
}

/// A parsed type text: `double[n][3]` is `double` with the lengths `n` and `3`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TypeText {
    /// Scalar or struct type.
    pub base: String,
    /// Lengths, outermost first; the first may be the name of a size.
    pub lengths: Vec<String>,
}

impl TypeText {
    /// Parses a normalised text; returns `None` if it is not a type.
    pub fn parse(text: &str) -> Option<TypeText> {
        let (base, mut rest) = text.split_at(text.find('[').unwrap_or(text.len()));
        let mut lengths = Vec::new();
        while !rest.is_empty() {
            let close = rest.find(']')?;
            lengths.push(rest.strip_prefix('[')?.get(..close - 1)?.trim().to_string());
            rest = &rest[close + 1..];
        }
        let numbers = lengths.iter().skip(1).all(|length| length.parse::<usize>().is_ok_and(|n| n > 0));
        (!base.is_empty() && numbers && lengths.iter().all(|length| !length.is_empty())).then(|| TypeText { base: base.to_string(), lengths })
    }

    /// Returns the size of the base type in bytes.
    pub fn base_size(&self, types: &[TypeFace]) -> Option<usize> {
        match self.base.as_str() {
            "double" | "int64_t" | "uint64_t" => Some(8),
            "float" | "int32_t" | "uint32_t" => Some(4),
            "int16_t" | "uint16_t" => Some(2),
            "int8_t" | "uint8_t" | "bool" => Some(1),
            name => types.iter().find(|ty| ty.name == name).map(|ty| ty.size),
        }
    }

    /// Returns the name of the size item if the first length is one; `None` if it is a number.
    pub fn size_name(&self) -> Option<&String> {
        self.lengths.first().filter(|length| length.parse::<usize>().is_err())
    }

    /// Returns the number of elements of the base type if all lengths are numbers.
    pub fn count(&self) -> usize {
        self.lengths.iter().filter_map(|length| length.parse::<usize>().ok()).product()
    }

    /// Returns the number of elements of the base type for size `n`.
    pub fn count_of(&self, n: usize) -> usize {
        self.lengths.iter().skip(1).filter_map(|length| length.parse::<usize>().ok()).product::<usize>() * n
    }
}
