// SPDX-License-Identifier: Apache-2.0
//! Replays a file to the requested point, and reports the findings.
use crate::comparison::{Comparison, Difference};
use crate::condition::Condition;
use crate::file::Reader;
use crate::found::{DifferenceText, ReplayResult, ShownSvv, StopReason};
use crate::player::{Moment, Player};
use crate::recording::Item;
use crate::trust::Trust;
use kernel::Occasion;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Options of a replay.
#[derive(Clone, Debug, Default, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReplayOptions {
    /// Condition at which to stop.
    pub until: Option<String>,
    /// Time at which to stop, ns on the clock of the record.
    pub to_ns: Option<i64>,
    /// Names of SVVs to report at the end; `*` is a wildcard.
    pub show: Vec<String>,
    /// Code modules that replace recorded ones: (name of the module, shared object).
    pub with: Vec<(String, PathBuf)>,
    /// Code modules in the file that may run; none by default.
    pub trust: Trust,
    /// Interpreter used to test code modules in a separate process.
    pub python: String,
}

enum Runner {
    One(Box<Player>),
    Two(Box<Comparison>),
}

/// A file being replayed.
pub struct Run {
    path: PathBuf,
    reader: Reader,
    runner: Runner,
    until: Option<Condition>,
    asked: ReplayOptions,
    last: Option<(String, u64, i64)>,
    /// Code modules found in the record so far.
    modules: Vec<String>,
}

impl Run {
    /// Opens a record.
    ///
    /// # Errors
    /// Fails with a message if the file, the condition or a module cannot be read, or if the file contains untrusted code. None of the file's code has run at that point.
    pub fn open(path: &Path, asked: ReplayOptions) -> Result<Run, String> {
        let read = |(name, file): &(String, PathBuf)| {
            let bytes = std::fs::read(file).map_err(|why| format!("cannot read module '{}': {why}", file.display()))?;
            Ok((name.clone(), bytes))
        };
        let others = asked.with.iter().map(read).collect::<Result<Vec<_>, String>>()?;
        Run::with_code(path, asked, others)
    }

    /// Opens a record, replacing recorded code modules with modules from memory, (name, shared object).
    pub(crate) fn with_code(path: &Path, asked: ReplayOptions, others: Vec<(String, Vec<u8>)>) -> Result<Run, String> {
        asked.trust.check_file(path)?;
        let until = asked.until.as_deref().map(Condition::read).transpose()?;
        let probe = probe(&asked.python);
        let runner = if others.is_empty() {
            Runner::One(Box::new(Player::new(Box::new(rtp::Code::new(probe)))))
        } else {
            let mut other = crate::recorded_script::ExchangedCode::new(rtp::Code::new(probe.clone()));
            for (name, bytes) in others {
                other.exchange(&name, bytes);
            }
            Runner::Two(Box::new(Comparison::new(Box::new(rtp::Code::new(probe)), Box::new(other))))
        };
        Ok(Run { path: path.to_owned(), reader: Reader::open(path)?, runner, until, asked, last: None, modules: Vec::new() })
    }

    /// Continues the replay for at most `slice` of real time; returns the findings when the run has ended.
    ///
    /// # Errors
    /// Fails with a message if the file is damaged, or if the condition refers to an SVV or element that does not exist.
    pub fn some(&mut self, slice: Duration) -> Result<Option<ReplayResult>, String> {
        let begun = Instant::now();
        let mut steps = 0u32;
        loop {
            steps += 1;
            if steps.is_multiple_of(256) && begun.elapsed() >= slice {
                return Ok(None);
            }
            let Some(item) = self.reader.next_item()? else { return self.over().map(Some) };
            if item.time_ns().is_some_and(|time_ns| self.asked.to_ns.is_some_and(|to_ns| time_ns > to_ns)) {
                return Ok(Some(self.found(StopReason::Time, None, String::new())));
            }
            if let Item::Module { name, bytes, .. } = &item {
                self.asked.trust.check(&self.path, name, bytes)?;
                self.modules.push(name.clone());
            }
            let (moment, difference) = match &mut self.runner {
                Runner::One(player) => match player.play(&item) {
                    Ok(moment) => (moment, None),
                    Err(why) => return Ok(Some(self.found(StopReason::Unplayable, None, why.0))),
                },
                Runner::Two(comparison) => match comparison.play(&item) {
                    Ok(Some((moment, difference))) => (Some(moment), difference),
                    Ok(None) => (None, None),
                    Err(why) => return Ok(Some(self.found(StopReason::Unplayable, None, why.0))),
                },
            };
            let Some(moment) = moment else { continue };
            if let Some(found) = self.at(&moment, difference)? {
                return Ok(Some(found));
            }
        }
    }

    /// Returns the progress: release time of the last firing, ns, and number of firings so far.
    pub fn progress(&mut self) -> (Option<i64>, u64) {
        (self.last.as_ref().map(|(_, _, time_ns)| *time_ns), self.player().firings())
    }

    fn at(&mut self, moment: &Moment, difference: Option<Difference>) -> Result<Option<ReplayResult>, String> {
        let player = self.player();
        self.last = Some((player.name(moment.source).to_owned(), moment.number, moment.time_ns));
        if !moment.same {
            let told = difference.map_or_else(|| self.unnamed(moment), |difference| DifferenceText::of(&difference));
            return Ok(Some(self.found(StopReason::Difference, Some(told), String::new())));
        }
        let Some(until) = self.until.clone() else { return Ok(None) };
        let holds = until.holds(self.player())?;
        Ok(holds.then(|| self.found(StopReason::Condition, None, String::new())))
    }

    fn over(&mut self) -> Result<ReplayResult, String> {
        if !self.reader.has_items() && self.reader.is_cut_off() {
            return Err("the file ends before there is anything to replay: its recorder was stopped too soon".to_owned());
        }
        if !self.reader.has_items() {
            return Err("the file has nothing to replay: record it with cell.record(path, replay=True), or with 'opengpac record'".to_owned());
        }
        let until = self.until.clone();
        let unknown = until.iter().flat_map(Condition::svvs).find(|name| self.player().svv(name).is_none());
        if let Some(name) = unknown {
            let mut known: Vec<&str> = self.player().svvs().collect();
            known.sort_unstable();
            return Err(format!("the record has no SVV '{name}'; it has {}", known.join(", ")));
        }
        if let Some((name, _)) = self.asked.with.iter().find(|(name, _)| !self.modules.contains(name)) {
            let known = if self.modules.is_empty() { "only the library".to_owned() } else { self.modules.join(", ") };
            return Err(format!("the record has no code module '{name}' that could be replaced; it has {known}"));
        }
        let message = if self.reader.is_cut_off() { "the file is incomplete: its recorder was stopped" } else { "" };
        Ok(self.found(StopReason::End, None, message.to_owned()))
    }

    fn player(&mut self) -> &mut Player {
        match &mut self.runner {
            Runner::One(player) => player,
            Runner::Two(comparison) => comparison.player(),
        }
    }

    /// Describes a deviation of the recorded code itself if it is known only from a digest.
    fn unnamed(&mut self, moment: &Moment) -> DifferenceText {
        let how = moment.differs.clone().unwrap_or_else(|| {
            "the code of the record produces other values here than during the recording: the version of the library differs, or a block is not a function of its inputs".to_owned()
        });
        let player = self.player();
        DifferenceText {
            source: player.name(moment.source).to_owned(),
            number: moment.number,
            time_ns: moment.time_ns,
            between: moment.occasion != Occasion::Firing,
            block: String::new(),
            port: String::new(),
            svv: String::new(),
            type_text: String::new(),
            recorded: Vec::new(),
            replayed: Vec::new(),
            how,
            stored: player.stored_svvs(moment.source).into_iter().map(ShownSvv::of).collect(),
        }
    }

    fn found(&mut self, stopped: StopReason, difference: Option<DifferenceText>, message: String) -> ReplayResult {
        let show = std::mem::take(&mut self.asked.show);
        let player = self.player();
        let mut names: Vec<String> = player.svvs().filter(|name| show.iter().any(|pattern| is_like(name, pattern))).map(str::to_owned).collect();
        names.sort_unstable();
        let svvs = names.iter().filter_map(|name| player.svv(name)).map(ShownSvv::of).collect();
        let (source, number, time_ns) = self.last.clone().unwrap_or_default();
        let same = difference.is_none() && stopped != StopReason::Unplayable;
        let fingerprint = format!("{:016x}", self.player().fingerprint());
        ReplayResult { stopped, firings: self.player().firings(), fingerprint, same, source, number, time_ns, difference, message, svvs }
    }
}

fn probe(python: &str) -> modules::Probe {
    match python {
        "" => modules::Probe::default(),
        python => modules::Probe::python(python),
    }
}

/// Returns true if `name` matches `pattern`, in which `*` is a wildcard.
fn is_like(name: &str, pattern: &str) -> bool {
    match pattern.split_once('*') {
        None => name == pattern,
        Some((start, rest)) => {
            name.strip_prefix(start).is_some_and(|left| (0..=left.len()).filter(|at| left.is_char_boundary(*at)).any(|at| is_like(&left[at..], rest)))
        }
    }
}
