// SPDX-License-Identifier: Apache-2.0
//! The text of a type.

use super::TypeFace;

/// One way to write a type: no blanks but between two words, `_Bool` is `bool`.
pub fn normalise(text: &str) -> String {
    let mut words = String::new();
    let is_letter = |c: char| c.is_ascii_alphanumeric() || c == '_';
    for word in text.split_whitespace() {
        // Blanks stay between two words, and between the members of a struct.
        let apart = words.ends_with([';', '{', ']']) && !word.starts_with(['[', ';']) || word.starts_with(['{', '}']);
        let joined = words.ends_with(is_letter) && word.starts_with(is_letter);
        if !words.is_empty() && (apart || joined) {
            words.push(' ');
        }
        words.push_str(word);
    }
    words.replace("_Bool", "bool")
}

/// A type's text in parts: `double[n][3]` is `double` with the lengths `n` and `3`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TypeText {
    /// The scalar or struct.
    pub base: String,
    /// The lengths, outermost first; the first may be the name of a size.
    pub lengths: Vec<String>,
}

impl TypeText {
    /// Reads a normalised text; `None` where it is none.
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

    /// Bytes of the base type.
    pub fn base_size(&self, types: &[TypeFace]) -> Option<usize> {
        match self.base.as_str() {
            "double" | "int64_t" | "uint64_t" => Some(8),
            "float" | "int32_t" | "uint32_t" => Some(4),
            "int16_t" | "uint16_t" => Some(2),
            "int8_t" | "uint8_t" | "bool" => Some(1),
            name => types.iter().find(|ty| ty.name == name).map(|ty| ty.size),
        }
    }

    /// The name of the size that is the first length, if that is no number.
    pub fn size_name(&self) -> Option<&String> {
        self.lengths.first().filter(|length| length.parse::<usize>().is_err())
    }

    /// Elements of the base type, where all lengths are numbers.
    pub fn count(&self) -> usize {
        self.lengths.iter().filter_map(|length| length.parse::<usize>().ok()).product()
    }

    /// Elements of the base type where the size is `n`.
    pub fn count_of(&self, n: usize) -> usize {
        self.lengths.iter().skip(1).filter_map(|length| length.parse::<usize>().ok()).product::<usize>() * n
    }
}
