// SPDX-License-Identifier: Apache-2.0
//! Replays the items of a record one after another.
use crate::recorded_script::{Codes, RecordedScript};
use crate::recording::Item;
use device::{Channel, Direction};
use kernel::{Cell, Event, Occasion, Script, SourceId, SourceKind};
use runtime::Host;
use runtime::Stretch;
use runtime::encoding::{CellAt, Reader};
use runtime::trace::Entry;
use runtime::{Change, PlayedSegment};
use std::collections::HashMap;
use std::sync::Arc;

/// Reason why a record cannot be replayed further, as a message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unplayable(pub String);

impl std::fmt::Display for Unplayable {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Unplayable {}

/// A replayed segment of a source.
#[derive(Clone, Debug)]
pub struct Moment {
    /// Source of the segment.
    pub source: SourceId,
    /// Event that caused the firing.
    pub occasion: Occasion,
    /// Number of the firing.
    pub number: u64,
    /// Release time of the firing, ns on the clock of the record.
    pub time_ns: i64,
    /// True if every value stored by the blocks of the source equals the recorded value, bit for bit.
    pub same: bool,
    /// Deviation of the source's execution from the record, as a message; `None` if there is none.
    pub differs: Option<String>,
}

/// A state vector variable (SVV) of the record, with its value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Svv {
    /// Name.
    pub name: String,
    /// C type.
    pub type_text: String,
    /// Unit; empty if there is none.
    pub unit: String,
    /// Current value.
    pub bytes: Vec<u8>,
}

struct SvvCell {
    source: SourceId,
    type_text: String,
    unit: String,
    at: CellAt,
    cell: Option<Cell>,
}

/// Player of a record.
pub struct Player {
    host: Arc<Host>,
    ground: RecordedScript,
    reader: Reader,
    scripts: HashMap<u64, Box<Script>>,
    /// Names of sources.
    sources: Vec<String>,
    /// Location of each SVV.
    svvs: HashMap<String, Vec<SvvCell>>,
    firings: u64,
    fingerprint: u64,
}

impl Player {
    /// Creates a player. `codes` provides the code of the blocks.
    pub fn new(codes: Box<dyn Codes>) -> Player {
        let host = Arc::new(Host::playing());
        let ground = RecordedScript { codes, devices: HashMap::new(), host: host.clone() };
        let (scripts, sources, svvs) = (HashMap::new(), Vec::new(), HashMap::new());
        Player { host, ground, reader: Reader::default(), scripts, sources, svvs, firings: 0, fingerprint: 0 }
    }

    /// Plays the next item; returns the outcome if it is a segment of a source.
    ///
    /// # Errors
    /// Fails with the reason if the player cannot replay the record any further.
    pub fn play(&mut self, item: &Item) -> Result<Option<Moment>, Unplayable> {
        let entry = match item {
            Item::Module { key, name, bytes } => {
                self.ground.codes.load(key, name, bytes).map_err(|why| Unplayable(format!("module '{name}' of the record cannot be loaded: {why}")))?;
                return Ok(None);
            }
            Item::Entry(entry) => entry,
        };
        match entry {
            Entry::Source(spec) => {
                if matches!(spec.kind, SourceKind::Timer { period_ns } if period_ns == 0 || i64::try_from(period_ns).is_err()) {
                    return Err(Unplayable(format!("source '{}' of the record has no period: the record is damaged", spec.name)));
                }
                self.sources.push(spec.name.clone());
                self.host.add_source(spec.clone()).map_err(|why| Unplayable(format!("source '{}' cannot be created: {why}", spec.name)))?;
            }
            Entry::Device { name, channels } => {
                if let Some(channel) = channels.iter().find(|channel| !is_sound(channel)) {
                    return Err(Unplayable(format!("channel '{}' of device '{name}' is invalid: the record is damaged", channel.name)));
                }
                self.ground.devices.insert(name.clone(), channels.clone());
            }
            Entry::Script { number, source, parcel } => {
                let script = self.reader.open(*number, parcel.clone(), &mut self.ground).map_err(|why| {
                    let source = self.name(*source);
                    Unplayable(format!("script {number} for source '{source}' cannot be repeated: {why}"))
                })?;
                self.scripts.insert(*number, script);
            }
            Entry::Named { source, name, type_text, unit, cell } => {
                if self.sources.len() <= source.0 as usize {
                    return Err(Unplayable(format!("the record uses SVV '{name}' in source {} before it is created: it is damaged", source.0)));
                }
                let (type_text, unit) = (type_text.clone(), unit.clone());
                let places = self.svvs.entry(name.clone()).or_default();
                places.retain(|place| place.source != *source);
                places.push(SvvCell { source: *source, type_text, unit, at: *cell, cell: None });
            }
            Entry::Broken(why) => return Err(Unplayable(format!("the record cannot be replayed from here on: {why}"))),
            Entry::Stretch(source, stretch) => return self.stretch(*source, stretch).map(Some),
        }
        Ok(None)
    }

    fn stretch(&mut self, source: SourceId, stretch: &Stretch) -> Result<Moment, Unplayable> {
        if self.sources.len() <= source.0 as usize {
            return Err(Unplayable(format!("the record uses source {} before it is created", source.0)));
        }
        if stretch.lost > 0 {
            let (name, number, lost) = (self.name(source), stretch.number, stretch.lost);
            let why = format!("{lost} firings and scripts of source '{name}' before firing {number} are missing from it: its recorder was too slow");
            return Err(Unplayable(format!("the record cannot be replayed from here on: {why}")));
        }
        let script = if let Occasion::Script(number) = stretch.occasion { self.scripts.remove(&number) } else { None };
        let PlayedSegment { digest, stopped, differs } = self.host.play(source, stretch, script);
        // Notifications from kernels are for a supervisor; the record contains its reactions.
        while let Some(event) = self.host.poll() {
            drop::<Event>(event);
        }
        self.mark(source, stretch);
        self.firings += u64::from(stretch.occasion == Occasion::Firing);
        let differs = differs.or_else(|| (stopped != stretch.stopped).then(|| stop_differs(stretch.stopped)));
        let same = digest == stretch.digest && differs.is_none();
        Ok(Moment { source, occasion: stretch.occasion, number: stretch.number, time_ns: stretch.time_ns, same, differs })
    }

    /// Adds the segment to the fingerprint: events, external inputs, and computed values.
    fn mark(&mut self, source: SourceId, stretch: &Stretch) {
        let of = match stretch.occasion {
            Occasion::Firing => 1,
            Occasion::Script(number) => 2 + number,
            Occasion::Restart => 0,
        };
        let words = [u64::from(source.0), of, stretch.number, stretch.time_ns.cast_unsigned(), stretch.digest];
        let bytes = words.iter().flat_map(|word| word.to_le_bytes()).chain(stretch.answers.iter().copied());
        // FNV-1a.
        self.fingerprint = bytes.fold(self.fingerprint ^ 0xcbf2_9ce4_8422_2325, |of, byte| (of ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3));
    }

    /// Returns the fingerprint of the run so far, which is identical for all records of one run.
    pub fn fingerprint(&self) -> u64 {
        self.fingerprint
    }

    /// Returns the number of firings replayed so far.
    pub fn firings(&self) -> u64 {
        self.firings
    }

    /// Returns the name of a source.
    pub fn name(&self, source: SourceId) -> &str {
        self.sources.get(source.0 as usize).map_or("?", String::as_str)
    }

    /// Returns the values stored by the blocks of a source, in the order in which a firing stores them.
    pub fn stored(&self, source: SourceId) -> Vec<Change> {
        self.host.stored(source)
    }

    /// Returns the SVVs that blocks of a source store, with the stored values, sorted by name.
    pub fn stored_svvs(&mut self, source: SourceId) -> Vec<Svv> {
        let mut found = Vec::new();
        for (name, places) in &mut self.svvs {
            let Some(place) = places.iter_mut().find(|place| place.source == source) else { continue };
            place.cell = place.cell.take().or_else(|| self.reader.find(place.at));
            let Some(cell) = place.cell.as_ref().filter(|cell| self.host.stores(source, cell)) else { continue };
            found.push(Svv { name: name.clone(), type_text: place.type_text.clone(), unit: place.unit.clone(), bytes: cell.load() });
        }
        found.sort_unstable_by(|one, other| one.name.cmp(&other.name));
        found
    }

    /// Returns the names of the SVVs that have occurred in scripts so far.
    pub fn svvs(&self) -> impl Iterator<Item = &str> {
        self.svvs.keys().map(String::as_str)
    }

    /// Returns an SVV with its value, taken from the running block that stores it, if any; `None` if the SVV has not occurred in a script
    /// yet.
    pub fn svv(&mut self, name: &str) -> Option<Svv> {
        let places = self.svvs.get_mut(name)?;
        for place in places.iter_mut().filter(|place| place.cell.is_none()) {
            place.cell = self.reader.find(place.at);
        }
        let known = || places.iter().filter_map(|place| Some((place, place.cell.as_ref()?)));
        let (place, cell) = known().find(|(place, cell)| self.host.stores(place.source, cell)).or_else(|| known().next())?;
        Some(Svv { name: name.to_owned(), type_text: place.type_text.clone(), unit: place.unit.clone(), bytes: cell.load() })
    }
}

/// Maximum size of a device's readings or commands, bytes.
const IMAGE_MAX: usize = 1 << 24;

fn is_sound(channel: &Channel) -> bool {
    let fits = channel.offset.checked_add(channel.len).is_some_and(|end| end <= IMAGE_MAX);
    fits && (channel.direction == Direction::Read || channel.safe.len() == channel.len)
}

fn stop_differs(recorded: bool) -> String {
    match recorded {
        true => "a fault or a used-up time budget stopped the source here during the recording, but does not now".to_owned(),
        false => "a fault stops the source here, but did not during the recording".to_owned(),
    }
}
