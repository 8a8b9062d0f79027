// SPDX-License-Identifier: Apache-2.0
//! Pattern of a text: in `"ST,{weight} kg"`, literal text stands for itself, and fields between braces are channels.
//!
//! The functions for received text neither allocate nor panic.
use super::fields::{Field, Form};

/// A text with fields.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pattern {
    pieces: Vec<Piece>,
    pub fields: Vec<Field>,
}

#[derive(Clone, Debug, PartialEq)]
enum Piece {
    Literal(Vec<u8>),
    /// Field with this index.
    Field(usize),
    /// Any text up to the next piece, written `{}`.
    Any,
}

/// A syntactic part of a pattern.
enum Part<'a> {
    Letters(&'a str),
    Name(&'a str),
}

/// Returns the names in a pattern, in order.
///
/// # Errors
/// Returns a message for an unmatched brace.
pub(super) fn names(text: &str) -> Result<Vec<String>, String> {
    let mut names = Vec::new();
    parts(text, |part| match part {
        Part::Name(name) if !name.is_empty() => names.push(name.to_owned()),
        _ => {}
    })?;
    Ok(names)
}

fn parts<'a>(text: &'a str, mut found: impl FnMut(Part<'a>)) -> Result<(), String> {
    let mut rest = text;
    while let Some(at) = rest.find(['{', '}']) {
        found(Part::Letters(&rest[..at]));
        let (brace, after) = rest[at..].split_at(1);
        if let Some(after) = after.strip_prefix(brace) {
            found(Part::Letters(brace));
            rest = after;
            continue;
        }
        let name = after.split_once('}').filter(|_| brace == "{");
        let (name, after) = name.ok_or_else(|| format!("a '{brace}' in '{text}' has no counterpart; write a literal brace twice"))?;
        found(Part::Name(name));
        rest = after;
    }
    found(Part::Letters(rest));
    Ok(())
}

impl Pattern {
    /// Parses a pattern. `of` returns the field for a name.
    ///
    /// # Errors
    /// Returns a message for unmatched braces, or for two adjacent fields without a clear boundary.
    pub(super) fn parse(text: &str, mut of: impl FnMut(&str) -> Result<Field, String>) -> Result<Pattern, String> {
        let (mut pieces, mut found) = (Vec::new(), Vec::new());
        parts(text, |part| match (part, pieces.last_mut()) {
            (Part::Letters(""), _) => {}
            (Part::Letters(more), Some(Piece::Literal(before))) => before.extend_from_slice(more.as_bytes()),
            (Part::Letters(letters), _) => pieces.push(Piece::Literal(letters.as_bytes().to_vec())),
            (Part::Name(""), _) => pieces.push(Piece::Any),
            (Part::Name(name), _) => {
                pieces.push(Piece::Field(found.len()));
                found.push(name);
            }
        })?;
        let fields = found.iter().map(|name| of(name)).collect::<Result<Vec<Field>, String>>()?;
        let pattern = Pattern { pieces, fields };
        let is_open = |piece: &Piece| match piece {
            Piece::Any => true,
            Piece::Field(index) => !matches!(pattern.fields[*index].form, Form::Number { .. }),
            Piece::Literal(_) => false,
        };
        match pattern.pieces.windows(2).any(|two| is_open(&two[0]) && !matches!(two[1], Piece::Literal(_))) {
            true => Err(format!("in '{text}' a field of letters is directly followed by another field, so its end cannot be recognised")),
            false => Ok(pattern),
        }
    }

    /// Returns true if a text matches this pattern; only then are its values stored in `readings`.
    pub(super) fn take(&self, text: &[u8], readings: &mut [u8]) -> bool {
        let is_of = self.each(text, |_, _| {});
        is_of && self.each(text, |field, part| field.store(part, readings))
    }

    /// Calls `found` with each field and its part of the text.
    fn each(&self, text: &[u8], mut found: impl FnMut(&Field, &[u8])) -> bool {
        let mut rest = text;
        for (at, piece) in self.pieces.iter().enumerate() {
            let part = match piece {
                Piece::Literal(literal) => {
                    let Some(after) = rest.strip_prefix(&literal[..]) else { return false };
                    rest = after;
                    continue;
                }
                Piece::Field(index) if matches!(self.fields[*index].form, Form::Number { .. }) => self.fields[*index].number_in(rest),
                _ => match self.pieces.get(at + 1) {
                    Some(Piece::Literal(ends)) => rest.windows(ends.len()).position(|window| window == &ends[..]),
                    _ => Some(rest.len()),
                },
            };
            let Some(len) = part else { return false };
            let (part, after) = rest.split_at(len);
            rest = after;
            if let Piece::Field(index) = piece {
                if !self.fields[*index].fits(part) {
                    return false;
                }
                found(&self.fields[*index], part);
            }
        }
        rest.is_empty()
    }

    /// Returns the text with the values of `commands`; `None` if one of them is NaN.
    pub(super) fn write(&self, commands: &[u8]) -> Option<Vec<u8>> {
        let mut text = Vec::new();
        for piece in &self.pieces {
            match piece {
                Piece::Literal(literal) => text.extend_from_slice(literal),
                Piece::Field(index) => self.fields[*index].write(commands, &mut text)?,
                Piece::Any => {}
            }
        }
        Some(text)
    }
}

/// A text to send, and the indices of its values among the write channels.
pub(super) struct Order {
    pub(super) pattern: Pattern,
    pub(super) indices: Vec<usize>,
}

#[cfg(test)]
mod tests {
    use super::super::fields::tests::field;
    use super::*;
    use device::Slot;
    use proptest::prelude::*;
    use serde_json::json;

    fn pattern(text: &str) -> Result<Pattern, String> {
        Pattern::parse(text, |name| {
            Ok(match name {
                "weight" => field(json!({ "unit": "kg" }), 0),
                "stable" => field(json!({ "when": "ST" }), 8),
                "code" => field(json!({ "text": 6 }), 16),
                _ => field(json!({ "base": 16, "scale": 0.5, "offset": 1.0 }), 24),
            })
        })
    }

    fn read(text: &str, from: &[u8]) -> Option<(f64, u8, [u8; 6], f64)> {
        let mut readings = [0xAA; 32];
        let taken = pattern(text).expect("it is right").take(from, &mut readings);
        assert!(taken || readings == [0xAA; 32], "nothing is half taken");
        let double = |offset| Slot { offset, len: 8 }.double(&readings, 0);
        taken.then(|| (double(0), readings[8], readings[16..22].try_into().expect("six"), double(24)))
    }

    #[test]
    fn fields_are_read_between_letters() {
        let read = |text, from: &[u8]| read(text, from);
        assert!(read("{stable},GS,{weight}kg", b"ST,GS,+  12.50kg").is_some_and(|(weight, stable, ..)| (weight, stable) == (12.5, 1)));
        assert!(read("{stable},GS,{weight}kg", b"US,GS,-0.4kg").is_some_and(|(weight, stable, ..)| (weight, stable) == (-0.4, 0)));
        assert_eq!(read("{stable},GS,{weight}kg", b"US,GS,----kg"), None);
        assert_eq!(read("{stable},GS,{weight}kg", b"US,GS,1kg "), None, "the text goes on");
        assert!(read("{code}", b"A1B2").is_some_and(|(.., code, _)| &code == b"A1B2\0\0"));
        assert_eq!(read("{code}", b"A1B2C3D"), None, "it is longer than its channel");
        assert!(read("{}:{hex} {{{weight}}}", b"abc:fF {1e3}").is_some_and(|(weight, _, _, hex)| (weight, hex) == (1000.0, 128.5)));
    }

    #[test]
    fn what_nobody_could_read_is_refused() {
        for (text, why) in [("{weight", "has no counterpart"), ("kg}", "has no counterpart"), ("{code}{weight}", "its end cannot be recognised")] {
            assert!(pattern(text).is_err_and(|refused| refused.contains(why)), "{text}");
        }
    }

    #[test]
    fn values_are_written_into_it() {
        let mut commands = [0; 32];
        Slot { offset: 0, len: 8 }.set_double(&mut commands, 0, -12.5);
        commands[16..19].copy_from_slice(b"Box");
        assert_eq!(pattern("SP {weight} {{{code}}}").expect("it is right").write(&commands), Some(b"SP -12.5 {Box}".to_vec()));
        Slot { offset: 0, len: 8 }.set_double(&mut commands, 0, f64::NAN);
        assert_eq!(pattern("SP {weight}").expect("it is right").write(&commands), None);
    }

    proptest! {
        #[test]
        fn no_text_panics(text in proptest::collection::vec(any::<u8>(), 0..80), which in 0..4_usize) {
            let pattern = pattern(["{stable},{weight}kg", "{code}", "{}:{hex}{weight}", "{weight},{code};"][which]).expect("it is right");
            let mut readings = [0; 32];
            pattern.take(&text, &mut readings);
        }

        #[test]
        fn any_pattern_is_read_or_refused(text in "[{}a-z]{0,12}") {
            let _ = (names(&text).is_ok(), pattern(&text).is_ok());
        }
    }
}
