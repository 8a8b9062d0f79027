// SPDX-License-Identifier: Apache-2.0
//! Resolution of SVV names. An SVV recreated under the same name is a different one: a caller that uses `NAME@NUMBER`, with the number
//! that `svv_about` returned as its `id`, refers to the SVV that it has seen and never to its successor.
use crate::refuse::{refuse, unknown};
use crate::registry::Registry;
use crate::svvs::cells::SvvRecord;
use model::refusal::{Class, Refusals};

/// Splits a name from the number after its `@`; `None` if there is no number.
fn numbered(asked: &str) -> Option<(&str, u32)> {
    let (name, number) = asked.rsplit_once('@')?;
    Some((name, number.parse().ok()?))
}

impl Registry {
    /// Returns the requested name: unchanged, or the part before `@` if the SVV has that number. Fails with `UnknownName` if the SVV was
    /// deleted or the name now belongs to a different one.
    pub fn name_of<'a>(&self, asked: &'a str) -> Result<&'a str, Refusals> {
        let Some((name, number)) = numbered(asked).filter(|_| !self.svvs.contains_key(asked)) else { return Ok(asked) };
        match self.svvs.get(name) {
            Some(svv) if svv.id.0 == number => Ok(name),
            Some(_) => {
                let why = format!("the requested SVV '{name}' no longer exists: it was deleted, and its name is now used by another SVV");
                Err(refuse(Class::UnknownName, why, "look up the current one by its name"))
            }
            None => Err(unknown("SVV", name, self.svvs.keys().map(String::as_str))),
        }
    }

    /// Returns the requested name, and the SVV with that name. `DEVICE.CHANNEL@channel` denotes the channel even if there is an SVV with
    /// its name. Fails as `name_of` does.
    pub fn asked<'a>(&self, asked: &'a str) -> Result<(&'a str, Option<&SvvRecord>), Refusals> {
        if let Some(channel) = asked.strip_suffix("@channel").filter(|_| !self.svvs.contains_key(asked)) {
            return Ok((channel, None));
        }
        let name = self.name_of(asked)?;
        Ok((name, self.svvs.get(name)))
    }
}
