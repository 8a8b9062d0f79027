// SPDX-License-Identifier: Apache-2.0
//! Conditions over SVVs: `force > 20`, `arm.joint1.sensed >= 0.5 and flange[2] < 0.1 or stop == 1`.
use crate::player::{Player, Svv};

/// A condition at which a run stops.
#[derive(Clone, Debug, PartialEq)]
pub struct Condition {
    /// Alternatives; the condition holds if all parts of one of them hold.
    any: Vec<Vec<Part>>,
}

#[derive(Clone, Debug, PartialEq)]
struct Part {
    svv: String,
    element: usize,
    relation: Relation,
    limit: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Relation {
    Above,
    AtLeast,
    Below,
    AtMost,
    Equal,
    Other,
}

/// Relational operators by their text. Longer ones come first, so that `>=` is not parsed as `>`.
const RELATIONS: [(&str, Relation); 6] =
    [(">=", Relation::AtLeast), ("<=", Relation::AtMost), ("==", Relation::Equal), ("!=", Relation::Other), (">", Relation::Above), ("<", Relation::Below)];

impl Condition {
    /// Parses a condition: comparisons of an SVV, or an element of one, with a number, joined by `and` and `or`; `and` has the higher
    /// precedence.
    ///
    /// # Errors
    /// Fails with a message that quotes the invalid text and describes the syntax.
    pub fn read(text: &str) -> Result<Condition, String> {
        let words: Vec<&str> = text.split_whitespace().collect();
        let any = words.split(|word| *word == "or").map(|all| all.split(|word| *word == "and").map(|part| part_of(&part.join(" "), text)).collect());
        Ok(Condition { any: any.collect::<Result<_, _>>()? })
    }

    /// Returns the SVVs to which the condition refers.
    pub fn svvs(&self) -> impl Iterator<Item = &str> {
        self.any.iter().flatten().map(|part| part.svv.as_str())
    }

    /// Returns true if the condition holds now; any comparison with an SVV that does not exist yet is false.
    ///
    /// # Errors
    /// Fails with a message if an SVV has no such element or is not a number.
    pub fn holds(&self, player: &mut Player) -> Result<bool, String> {
        for all in &self.any {
            let mut holds = true;
            for part in all {
                holds = holds && part.holds(player)?;
            }
            if holds {
                return Ok(true);
            }
        }
        Ok(false)
    }
}

fn part_of(part: &str, whole: &str) -> Result<Part, String> {
    let refused = |why: &str| format!("cannot read '{part}' in the condition '{whole}': {why}; write, for example, 'force > 20 and joint.sensed[2] <= 0.5'");
    let found = RELATIONS.iter().find_map(|(sign, relation)| part.split_once(sign).map(|(name, limit)| (name.trim(), *relation, limit.trim())));
    let Some((name, relation, limit)) = found else { return Err(refused("it compares nothing")) };
    let limit = match limit {
        "true" => 1.0,
        "false" => 0.0,
        _ => limit.parse().map_err(|_| refused(&format!("'{limit}' is not a number")))?,
    };
    let (svv, element) = match name.strip_suffix(']').and_then(|name| name.rsplit_once('[')) {
        Some((svv, element)) => (svv, element.parse().map_err(|_| refused(&format!("'{element}' is not the number of an element")))?),
        None => (name, 0),
    };
    if svv.is_empty() || svv.contains(char::is_whitespace) {
        return Err(refused("the name of an SVV belongs on the left"));
    }
    Ok(Part { svv: svv.to_owned(), element, relation, limit })
}

impl Part {
    fn holds(&self, player: &mut Player) -> Result<bool, String> {
        let Some(svv) = player.svv(&self.svv) else { return Ok(false) };
        let value =
            svv.number(self.element).ok_or_else(|| format!("element {1} of SVV '{0}' of type {2} is not a number", svv.name, svv.type_text, self.element))?;
        Ok(match self.relation {
            Relation::Above => value > self.limit,
            Relation::AtLeast => value >= self.limit,
            Relation::Below => value < self.limit,
            Relation::AtMost => value <= self.limit,
            Relation::Equal => value == self.limit,
            Relation::Other => value != self.limit,
        })
    }
}

impl Svv {
    /// Returns an element as a number; `None` if the type is a structure or the index is out of range.
    pub fn number(&self, element: usize) -> Option<f64> {
        number(&self.type_text, &self.bytes, element)
    }
}

/// Returns element `element` of a value of C type `type_text` as a number.
pub(crate) fn number(type_text: &str, bytes: &[u8], element: usize) -> Option<f64> {
    let scalar = type_text.split('[').next().unwrap_or_default().trim();
    let at = |len: usize| bytes.get(element.checked_mul(len)?..element.checked_add(1)?.checked_mul(len)?);
    Some(match scalar {
        "double" => f64::from_le_bytes(at(8)?.try_into().ok()?),
        "float" => f64::from(f32::from_le_bytes(at(4)?.try_into().ok()?)),
        "bool" | "_Bool" | "uint8_t" | "unsigned char" => f64::from(*at(1)?.first()?),
        "int8_t" | "char" | "signed char" => f64::from(at(1)?.first()?.cast_signed()),
        "int16_t" | "short" => f64::from(i16::from_le_bytes(at(2)?.try_into().ok()?)),
        "uint16_t" | "unsigned short" => f64::from(u16::from_le_bytes(at(2)?.try_into().ok()?)),
        "int32_t" | "int" => f64::from(i32::from_le_bytes(at(4)?.try_into().ok()?)),
        "uint32_t" | "unsigned" | "unsigned int" => f64::from(u32::from_le_bytes(at(4)?.try_into().ok()?)),
        "int64_t" | "long" => i64::from_le_bytes(at(8)?.try_into().ok()?) as f64,
        "uint64_t" | "size_t" | "unsigned long" => u64::from_le_bytes(at(8)?.try_into().ok()?) as f64,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn and_binds_closer_than_or() {
        let read = Condition::read("force > 20 and a[2]<=0.5 or stop == true").expect("it is understood");
        assert_eq!(read.any.iter().map(Vec::len).collect::<Vec<_>>(), [2, 1]);
        assert_eq!(read.svvs().collect::<Vec<_>>(), ["force", "a", "stop"]);
        assert_eq!(read.any[0][1], Part { svv: "a".into(), element: 2, relation: Relation::AtMost, limit: 0.5 });
    }

    #[test]
    fn what_is_not_understood_is_named() {
        for (text, why) in [
            ("force", "compares nothing"),
            ("force > much", "'much' is not a number"),
            ("a[x] > 1", "'x' is not the number of an element"),
            ("> 3", "belongs on the left"),
        ] {
            let refused = Condition::read(text).expect_err("it is refused");
            assert!(refused.contains(why), "{refused}");
        }
    }

    #[test]
    fn numbers_of_every_type_are_read() {
        assert_eq!(number("double[2]", &[1.5f64.to_le_bytes(), (-2.0f64).to_le_bytes()].concat(), 1), Some(-2.0));
        assert_eq!(number("int16_t", &(-3i16).to_le_bytes(), 0), Some(-3.0));
        assert_eq!(number("bool", &[1], 0), Some(1.0));
        assert_eq!(number("double", &[0; 8], 1), None);
        assert_eq!(number("pose", &[0; 56], 0), None);
    }
}
