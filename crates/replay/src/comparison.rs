// SPDX-License-Identifier: Apache-2.0
//! Runs a record in two players side by side, with the recorded code and with other code, and finds the first difference.
use crate::Codes;
use crate::player::{Moment, Player, Svv, Unplayable};
use crate::recording::Item;
use kernel::Occasion;

/// The first difference between two runs of one record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Source in which the difference occurred.
    pub source: String,
    /// Number of the source's firing.
    pub number: u64,
    /// Release time of the firing, ns on the clock of the record.
    pub time_ns: i64,
    /// True if a script, such as an `execute` or a start, caused the difference between two firings.
    pub between: bool,
    /// Block, with its instance, and port; `None` if only the execution of the source differs.
    pub port: Option<(String, String)>,
    /// SVV in which the port's value is stored; `None` for a private cell.
    pub svv: Option<String>,
    /// C type of the port.
    pub type_text: String,
    /// Value that the recorded code stores.
    pub recorded: Vec<u8>,
    /// Value that the other code stores.
    pub replayed: Vec<u8>,
    /// Deviation of the execution of the source from the record; `None` if there is none.
    pub how: Option<String>,
}

/// Two players of one record.
pub struct Comparison {
    before: Player,
    after: Player,
}

impl Comparison {
    /// Creates a comparison between the record's own code, `recorded`, and `other`.
    pub fn new(recorded: Box<dyn Codes>, other: Box<dyn Codes>) -> Comparison {
        Comparison { before: Player::new(recorded), after: Player::new(other) }
    }

    /// Plays the next item in both runs. Returns the moment of the run with the other code, and the difference, if there is one.
    ///
    /// # Errors
    /// Fails as [`Player::play`] does, and if the record's own code does not reproduce the recorded values.
    pub fn play(&mut self, item: &Item) -> Result<Option<(Moment, Option<Difference>)>, Unplayable> {
        let before = self.before.play(item)?;
        let after = self.after.play(item)?;
        let (Some(before), Some(after)) = (before, after) else { return Ok(None) };
        if !before.same {
            let (source, number) = (self.before.name(before.source), before.number);
            return Err(Unplayable(format!("the recorded code itself does not reproduce the recorded values, in firing {number} of source '{source}'")));
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
        // Of several SVVs that differ, this is the one that holds the value of this port.
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
