// SPDX-License-Identifier: Apache-2.0
//! A record run twice side by side, with the code that is in it and with other code: where they first differ.
use crate::Codes;
use crate::player::{Moment, Player, Svv, Unplayable};
use crate::recording::Item;
use kernel::Occasion;

/// The first difference between two runs of one record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Source in which it came.
    pub source: String,
    /// Number of its firing.
    pub number: u64,
    /// Release of the firing, ns on the clock of the record.
    pub time_ns: i64,
    /// True for what a script did between two firings (an `execute`, a start).
    pub between: bool,
    /// Block, with its instance, and port; none where the source only went another way.
    pub port: Option<(String, String)>,
    /// SVV in which the port's value is stored; none of a private cell.
    pub svv: Option<String>,
    /// C type of the port.
    pub type_text: String,
    /// Values that the recorded code stores.
    pub recorded: Vec<u8>,
    /// Values that the other code stores.
    pub replayed: Vec<u8>,
    /// Difference in the way of the source, where there is one.
    pub how: Option<String>,
}

/// Two players of one record.
pub struct Comparison {
    before: Player,
    after: Player,
}

impl Comparison {
    /// Makes a comparison. `recorded`: the code of the record. `other`: the code to compare it with.
    pub fn new(recorded: Box<dyn Codes>, other: Box<dyn Codes>) -> Comparison {
        Comparison { before: Player::new(recorded), after: Player::new(other) }
    }

    /// Plays the next item in both: the moment with the other code, and the difference, if there is one.
    ///
    /// # Errors
    /// As of [`Player::play`]; and where the code of the record does not give what is recorded.
    pub fn play(&mut self, item: &Item) -> Result<Option<(Moment, Option<Difference>)>, Unplayable> {
        let before = self.before.play(item)?;
        let after = self.after.play(item)?;
        let (Some(before), Some(after)) = (before, after) else { return Ok(None) };
        if !before.same {
            let (source, number) = (self.before.name(before.source), before.number);
            return Err(Unplayable(format!("the code of the record itself does not give what is recorded, in firing {number} of source '{source}'")));
        }
        if after.same {
            return Ok(Some((after, None)));
        }
        let difference = self.difference(&after);
        Ok(Some((after, Some(difference))))
    }

    /// Returns the run with the other code.
    pub fn player(&mut self) -> &mut Player {
        &mut self.after
    }

    fn difference(&mut self, moment: &Moment) -> Difference {
        let svvs = self.before.stored_svvs(moment.source).into_iter().zip(self.after.stored_svvs(moment.source));
        let others: Vec<_> = svvs.filter(|(before, after)| before.bytes != after.bytes).collect();
        let (before, after) = (self.before.stored(moment.source), self.after.stored(moment.source));
        let found = before.into_iter().zip(after).find(|(before, after)| before.bytes != after.bytes);
        let (port, type_text, recorded, replayed) = match found {
            Some((before, after)) => (Some((before.block, before.port)), before.type_text, before.bytes, after.bytes),
            None => (None, String::new(), Vec::new(), Vec::new()),
        };
        // Of several SVVs that differ, the one that holds what this port has stored.
        let holds = |(before, after): &&(Svv, Svv)| before.name == after.name && before.bytes == recorded && after.bytes == replayed;
        let svv = others.iter().find(holds).map(|(before, _)| before.name.clone());
        Difference {
            source: self.after.name(moment.source).to_owned(),
            number: moment.number,
            time_ns: moment.time_ns,
            between: moment.occasion != Occasion::Firing,
            port,
            svv,
            type_text,
            recorded,
            replayed,
            how: moment.differs.clone(),
        }
    }
}
