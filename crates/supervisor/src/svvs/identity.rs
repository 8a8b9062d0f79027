// SPDX-License-Identifier: Apache-2.0
//! Resolution of the names of SVVs. One that is made again under the name of another is another: a caller that says `NAME@NUMBER`, with the
//! number that `svv_about` gave as its `id`, means the one that it has seen, and never gets its successor.
use crate::refuse::{refuse, unknown};
use crate::registry::Registry;
use crate::svvs::cells::SvvRecord;
use model::refusal::{Class, Refusals};

/// Returns a name and the number behind its `@`; none if there is none.
fn numbered(asked: &str) -> Option<(&str, u32)> {
    let (name, number) = asked.rsplit_once('@')?;
    Some((name, number.parse().ok()?))
}

impl Registry {
    /// Returns the name of what is asked for: as it is, or before `@` if the SVV has that number. Errors: `UnknownName`, where it is
    /// gone or another has its name.
    pub fn name_of<'a>(&self, asked: &'a str) -> Result<&'a str, Refusals> {
        let Some((name, number)) = numbered(asked).filter(|_| !self.svvs.contains_key(asked)) else { return Ok(asked) };
        match self.svvs.get(name) {
            Some(svv) if svv.id.0 == number => Ok(name),
            Some(_) => {
                let why = format!("the SVV '{name}' that was asked for is gone: it was deleted, and another has its name");
                Err(refuse(Class::UnknownName, why, "ask for the one that is there now"))
            }
            None => Err(unknown("SVV", name, self.svvs.keys().map(String::as_str))),
        }
    }

    /// Returns the name that was asked for, and the SVV of that name. `DEVICE.CHANNEL@channel` is the channel, though an SVV may have its name.
    /// Errors: as
    /// `name_of`.
    pub fn asked<'a>(&self, asked: &'a str) -> Result<(&'a str, Option<&SvvRecord>), Refusals> {
        if let Some(channel) = asked.strip_suffix("@channel").filter(|_| !self.svvs.contains_key(asked)) {
            return Ok((channel, None));
        }
        let name = self.name_of(asked)?;
        Ok((name, self.svvs.get(name)))
    }
}
