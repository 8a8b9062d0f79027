// SPDX-License-Identifier: Apache-2.0
//! Fields of a text: numbers, words for true or false, strings.
use device::{Channel, Kind, Number, OptionWord, Slot, Type};
use serde::Deserialize;
use serde_json::Value;

/// Numeric options of a field.
pub(super) const FIELD: [OptionWord; 6] = [
    OptionWord::with_default("text", Kind::Whole, "a number", "number of its letters").within(1.0, TEXT_MAX as f64),
    OptionWord::with_default("base", Kind::Whole, "10", "base of its digits, 10 or 16").within(10.0, 16.0),
    OptionWord::with_default("scale", Kind::Number, "1", "value of one unit of its number").within(-1e15, 1e15),
    OptionWord::with_default("offset", Kind::Number, "0", "its value where the number is 0").within(-1e15, 1e15),
    OptionWord::with_default("decimals", Kind::Whole, "as many as are needed", "digits after the decimal point").within(0.0, 12.0),
    OptionWord::with_default("safe", Kind::Number, "none", "value that is sent at the end").within(-1e15, 1e15),
];

/// A declared field.
#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct FieldOptions {
    text: Option<usize>,
    when: Option<String>,
    base: Option<u32>,
    scale: Option<f64>,
    offset: Option<f64>,
    decimals: Option<usize>,
    safe: Option<f64>,
    #[serde(default)]
    unit: String,
    #[serde(default)]
    doc: String,
}

/// Format of a field.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Form {
    /// `value = scale * number + offset`, as a double.
    Number { base: u32, scale: f64, offset: f64, decimals: Option<usize> },
    /// Boolean that is true if this word is present.
    When(Vec<u8>),
    /// String, padded with zeros.
    Text,
}

/// A field and its channel.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Field {
    pub form: Form,
    pub slot: Slot,
    /// True if a safe value was declared.
    pub is_safe: bool,
}

/// Maximum length of the text of a channel.
const TEXT_MAX: usize = 256;

/// Returns the channel and the format of a field; the layout assigns its slot.
///
/// # Errors
/// Returns a message.
pub(super) fn declared(name: &str, value: Option<&Value>, is_written: bool) -> Result<(Channel, Field), String> {
    let asked: FieldOptions = value.map_or(Ok(FieldOptions::default()), |value| serde_json::from_value(value.clone()).map_err(|why| why.to_string()))?;
    let numbers = asked.base.is_some() || asked.scale.is_some() || asked.offset.is_some() || asked.decimals.is_some() || asked.safe.is_some();
    let (form, of) = match (asked.text, &asked.when) {
        (Some(_), Some(_)) => return Err("it cannot be both a \"text\" and a \"when\"".to_owned()),
        (Some(_), _) | (_, Some(_)) if numbers => return Err("only numbers can have \"base\", \"scale\", \"offset\", \"decimals\" and \"safe\"".to_owned()),
        (Some(len), None) => (Form::Text, Type { number: Number::Uint8, elements: Some(len) }),
        (None, Some(_)) if is_written => return Err("a \"when\" can only be read, not written".to_owned()),
        (None, Some(word)) => (Form::When(word.as_bytes().to_vec()), Type::BOOL),
        (None, None) => (number(&asked)?, Type::DOUBLE),
    };
    if !is_written && (asked.safe.is_some() || asked.decimals.is_some()) {
        return Err("only written fields can have \"safe\" and \"decimals\"".to_owned());
    }
    let channel = match is_written {
        true if asked.safe.is_some() => Channel::write(name, of).safe(asked.safe.unwrap_or(0.0).to_ne_bytes().to_vec()),
        true => Channel::write(name, of),
        false => Channel::read(name, of),
    };
    let field = Field { form, slot: Slot { offset: 0, len: channel.len }, is_safe: asked.safe.is_some() };
    Ok((channel.unit(asked.unit).doc(asked.doc), field))
}

fn number(asked: &FieldOptions) -> Result<Form, String> {
    let (base, scale, offset) = (asked.base.unwrap_or(10), asked.scale.unwrap_or(1.0), asked.offset.unwrap_or(0.0));
    if !matches!(base, 10 | 16) {
        return Err("a \"base\" must be 10 or 16".to_owned());
    }
    if scale == 0.0 || !scale.is_finite() || !offset.is_finite() {
        return Err("its scale cannot be 0 or infinite; give a finite one other than 0".to_owned());
    }
    Ok(Form::Number { base, scale, offset, decimals: asked.decimals })
}

impl Field {
    /// Returns the length of the number at the start of a text, including spaces before it and after its sign.
    pub(super) fn number_in(&self, text: &[u8]) -> Option<usize> {
        let Form::Number { base, .. } = self.form else { return None };
        let spaces = |from: usize| from + text[from..].iter().take_while(|byte| **byte == b' ').count();
        let digits = |from: usize| from + text[from..].iter().take_while(|byte| char::from(**byte).is_digit(base)).count();
        let mut at = spaces(0);
        if matches!(text.get(at), Some(b'+' | b'-')) {
            at = spaces(at + 1);
        }
        let begins = at;
        at = digits(at);
        let mut count = at - begins;
        if base == 10 && text.get(at) == Some(&b'.') {
            let end = digits(at + 1);
            (count, at) = (count + end - at - 1, end);
        }
        // Without a following digit, an e belongs to the text after the number.
        if base == 10 && count > 0 && matches!(text.get(at), Some(b'e' | b'E')) {
            let sign = at + 1 + usize::from(matches!(text.get(at + 1), Some(b'+' | b'-')));
            if text.get(sign).is_some_and(u8::is_ascii_digit) {
                at = digits(sign);
            }
        }
        // No device sends a longer one.
        (count > 0 && at - begins <= 40).then_some(at)
    }

    /// Returns true if a part of a text fits into the channel of the field.
    pub(super) fn fits(&self, part: &[u8]) -> bool {
        match self.form {
            Form::Text => part.len() <= self.slot.len,
            Form::Number { base, .. } => parsed(part, base).is_some(),
            Form::When(_) => true,
        }
    }

    /// Stores a part of a text that fits.
    pub(super) fn store(&self, part: &[u8], readings: &mut [u8]) {
        match &self.form {
            Form::Text => {
                let (letters, rest) = self.slot.of_mut(readings).split_at_mut(part.len());
                letters.copy_from_slice(part);
                rest.fill(0);
            }
            Form::When(word) => self.slot.of_mut(readings)[0] = u8::from(part.trim_ascii() == &word[..]),
            Form::Number { base, scale, offset, .. } => {
                let number = parsed(part, *base).unwrap_or(f64::NAN);
                self.slot.set_double(readings, 0, scale * number + offset);
            }
        }
    }

    /// Appends the value to a text; returns `None` for NaN.
    pub(super) fn write(&self, commands: &[u8], text: &mut Vec<u8>) -> Option<()> {
        match &self.form {
            Form::Text => text.extend(self.slot.of(commands).iter().take_while(|byte| **byte != 0)),
            Form::When(_) => {}
            Form::Number { base, scale, offset, decimals } => {
                let number = Some((self.slot.double(commands, 0) - offset) / scale).filter(|number| number.is_finite())?;
                let written = match (base, decimals) {
                    (16, _) => format!("{:X}", number.round() as i64),
                    (_, Some(decimals)) => format!("{number:.decimals$}"),
                    (_, None) => format!("{number}"),
                };
                text.extend_from_slice(written.as_bytes());
            }
        }
        Some(())
    }
}

/// Parses the number in a part, with leading spaces and a sign. Does not allocate, because a number has at most 40 bytes.
fn parsed(part: &[u8], base: u32) -> Option<f64> {
    let part = part.trim_ascii();
    let (sign, digits) = match part.split_first() {
        Some((b'-', rest)) => (-1.0, rest),
        Some((b'+', rest)) => (1.0, rest),
        _ => (1.0, part),
    };
    let digits = std::str::from_utf8(digits.trim_ascii()).ok()?;
    let number = if base == 16 { u64::from_str_radix(digits, 16).ok()? as f64 } else { digits.parse::<f64>().ok()? };
    number.is_finite().then_some(sign * number)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Returns a field at this offset of the readings and of the commands.
    pub(in crate::text) fn field(asked: Value, offset: usize) -> Field {
        let (_, field) = declared("x", Some(&asked), false).expect("it is right");
        Field { slot: Slot { offset, ..field.slot }, ..field }
    }

    #[test]
    fn what_is_wrong_is_told() {
        use serde_json::json;
        for (asked, written, why) in [
            (json!({ "text": 4, "when": "x" }), false, "cannot be both"),
            (json!({ "text": 4, "scale": 2.0 }), false, "only numbers can have"),
            (json!({ "when": "x" }), true, "can only be read, not written"),
            (json!({ "base": 8 }), false, "10 or 16"),
            (json!({ "safe": 1.0 }), false, "only written fields can have"),
            (json!({ "scael": 1.0 }), false, "unknown field"),
        ] {
            let refused = declared("x", Some(&asked), written).err();
            assert!(refused.as_ref().is_some_and(|refused| refused.contains(why)), "{asked}: {refused:?}");
        }
    }
}
