// SPDX-License-Identifier: Apache-2.0
//! Checks the scheduling relations: every synchronous or ratio input must have exactly one active writer, at the right rate.
use super::Draft;
use super::activity::Activity;
use super::bind::cells_of;
use crate::configuration::{Rate, Writer};
use crate::cycles::{cycle_refusal, modes_of_first};
use crate::flatten::Port;
use crate::interface::{Kind, Mode};
use crate::order;
use crate::plan::{CellIndex, CellKind};
use crate::quantity::duration_text;
use crate::refusal::{Class, Refusal, Refusals, Where};

/// Relation between an input and the invocations of its writer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Relation {
    pub item: usize,
    pub cell: CellIndex,
    /// Mode: synchronous or ratio.
    pub mode: Mode,
}

/// Relations of all blocks.
#[derive(Debug, Default)]
pub(crate) struct Relations {
    pub of: Vec<Vec<Relation>>,
    /// Blocks in an order in which drivers precede the blocks they drive.
    pub order: Vec<usize>,
}

/// Rate of a block in a stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Beat<'a> {
    Interval(u64),
    Trigger(&'a str, u32),
    Once,
    /// Active, but not driven in this stage.
    Idle,
}

impl<'a> Beat<'a> {
    fn divided(self, n: u32) -> Beat<'a> {
        match self {
            Beat::Interval(ns) => Beat::Interval(ns.saturating_mul(u64::from(n))),
            Beat::Trigger(source, every) => Beat::Trigger(source, every.saturating_mul(n)),
            other => other,
        }
    }

    fn text(self) -> String {
        match self {
            Beat::Interval(ns) => format!("every {}", duration_text(ns)),
            Beat::Trigger(source, 1) => format!("at each firing of '{source}'"),
            Beat::Trigger(source, n) => format!("once in {n} firings of '{source}'"),
            Beat::Once => "when it is executed".into(),
            Beat::Idle => "never".into(),
        }
    }

    pub fn rate(self) -> Option<Rate> {
        match self {
            Beat::Interval(period_ns) => Some(Rate::Interval { period_ns }),
            Beat::Trigger(source, every) => Some(Rate::Trigger { source: source.to_owned(), every }),
            Beat::Once => Some(Rate::Once),
            Beat::Idle => None,
        }
    }
}

fn beat(rate: &Rate) -> Beat<'_> {
    match rate {
        Rate::Interval { period_ns } => Beat::Interval(*period_ns),
        Rate::Trigger { source, every } => Beat::Trigger(source, *every),
        Rate::Once => Beat::Once,
    }
}

impl<'a> Draft<'a> {
    /// Returns the relations, and an order of the blocks in which drivers precede the blocks that they drive.
    pub fn relations(&mut self) -> Result<Relations, Refusals> {
        let mut of: Vec<Vec<Relation>> = Vec::with_capacity(self.blocks.len());
        let mut edges = Vec::new();
        for (at, block) in self.blocks.iter().enumerate() {
            let mut relations = Vec::new();
            for bound in &block.bindings {
                if bound.mode == Mode::Asynchronous || self.kind((at, bound.item)) != Kind::Input {
                    continue;
                }
                for &cell in cells_of(&bound.binding) {
                    relations.push(Relation { item: bound.item, cell, mode: bound.mode });
                    edges.extend(self.cells[cell].writers.iter().filter(|_| bound.mode == Mode::Synchronous).map(|w| (w.0, at)));
                }
            }
            of.push(relations);
        }
        match order::sort(self.blocks.len(), &edges, &[]) {
            Ok(sorted) => Ok(Relations { of, order: sorted.order }),
            Err(cycle) => {
                let labels: Vec<&str> = cycle.iter().map(|&block| self.blocks[block].label.as_str()).collect();
                Err(vec![cycle_refusal(&labels, &modes_of_first(&self.checked.blocks, &labels), &self.checked.place)])
            }
        }
    }

    /// Returns the writers of a cell among the installed instances.
    pub fn external_writers(&self, cell: CellIndex) -> &'a [Writer] {
        match &self.cells[cell].kind {
            CellKind::Svv { name, .. } => self.configuration.writers.get(name).map_or(&[], Vec::as_slice),
            _ => &[],
        }
    }

    /// Computes the rate of every block in each stage in which it is active, and refuses relations that do not hold.
    pub fn relate(&mut self, activity: &Activity, relations: &Relations) -> Vec<Vec<Beat<'a>>> {
        let mut beats: Vec<Vec<Beat<'a>>> = vec![Vec::new(); self.blocks.len()];
        for &block in &relations.order {
            beats[block] = self.beats(block, activity, relations, &beats);
        }
        for block in 0..self.blocks.len() {
            for relation in relations.of[block].iter().filter(|r| matches!(r.mode, Mode::Ratio(_))) {
                self.check_ratio((block, relation.item), relation, activity, &beats);
            }
        }
        beats
    }

    fn beats(&mut self, block: usize, activity: &Activity, relations: &Relations, beats: &[Vec<Beat<'a>>]) -> Vec<Beat<'a>> {
        let on = &activity.on[block];
        let drivers: Vec<&Relation> = relations.of[block].iter().filter(|r| r.mode == Mode::Synchronous).collect();
        if drivers.is_empty() {
            return on.iter().map(|on| on.every_ns.map_or_else(|| self.trigger_of(block), Beat::Interval)).collect();
        }
        let mut own: Vec<Option<(Beat<'a>, usize)>> = vec![None; on.len()];
        let mut reported = false;
        for relation in drivers {
            let updates = self.updates(relation, block, activity, beats);
            let lists_driven: Vec<usize> = self.lists_driven(relation, activity, &updates, on);
            for (at, on) in on.iter().enumerate() {
                if reported {
                    break;
                }
                let update = updates[at];
                if update.is_none() && !lists_driven.contains(&activity.list_of[on.stage as usize]) {
                    self.nobody_drives((block, relation.item), relation, activity.list_of[on.stage as usize]);
                    reported = true;
                } else if let (Some(update), Some((other, item))) = (update, own[at]) {
                    if update != other {
                        self.rates_differ((block, item), other, (block, relation.item), update);
                        reported = true;
                    }
                } else if let Some(update) = update {
                    own[at] = Some((update, relation.item));
                }
            }
        }
        own.into_iter().map(|beat| beat.map_or(Beat::Idle, |(beat, _)| beat)).collect()
    }

    fn trigger_of(&self, block: usize) -> Beat<'a> {
        match self.configuration.sources.get_key_value(&self.blocks[block].source) {
            Some((name, _)) => Beat::Trigger(name, 1),
            None => Beat::Idle,
        }
    }

    /// Returns the rate at which the writer of a relation updates, for each stage in which the reader is active.
    fn updates(&mut self, relation: &Relation, reader: usize, activity: &Activity, beats: &[Vec<Beat<'a>>]) -> Vec<Option<Beat<'a>>> {
        let on = &activity.on[reader];
        let writers = &self.cells[relation.cell].writers;
        if writers.is_empty() {
            let external = if on.is_empty() { None } else { self.external_beat(relation, reader) };
            return vec![external; on.len()];
        }
        let mut updates = vec![None; on.len()];
        for &(writer, item) in writers {
            let n = match self.flat(writer).mode(item) {
                Mode::Ratio(n) => n,
                _ => 1,
            };
            let theirs = &activity.on[writer];
            let mut at_theirs = 0;
            for (at, on) in on.iter().enumerate() {
                while theirs.get(at_theirs).is_some_and(|t| t.stage < on.stage) {
                    at_theirs += 1;
                }
                if theirs.get(at_theirs).is_some_and(|t| t.stage == on.stage) {
                    updates[at] = Some(beats[writer][at_theirs].divided(n));
                }
            }
        }
        updates
    }

    /// Returns the lists in which the reader is driven at some point. It is not an error if it is not driven in a stage before the writer
    /// is activated.
    fn lists_driven(&self, relation: &Relation, activity: &Activity, updates: &[Option<Beat<'a>>], on: &[super::activity::On]) -> Vec<usize> {
        if updates.iter().all(Option::is_some) {
            return Vec::new();
        }
        let stages = on.iter().zip(updates).filter(|(_, update)| update.is_some());
        let mut lists: Vec<usize> = stages.map(|(on, _)| activity.list_of[on.stage as usize]).collect();
        for writer in &self.cells[relation.cell].writers {
            lists.extend(&activity.executed[writer.0]);
        }
        lists
    }

    /// Returns the rate of the only external instance that writes an SVV.
    fn external_beat(&mut self, relation: &Relation, reader: usize) -> Option<Beat<'a>> {
        let writers = self.external_writers(relation.cell);
        let mut found: Vec<(Beat<'a>, &Writer)> = Vec::new();
        for writer in writers {
            let periodic = writer.rates.iter().map(beat).filter(|b| *b != Beat::Once);
            let n = if let Mode::Ratio(n) = writer.mode { n } else { 1 };
            for beat in periodic.map(|b| b.divided(n)) {
                if found.iter().all(|(known, _)| *known != beat) {
                    found.push((beat, writer));
                }
            }
        }
        if found.len() > 1 {
            let described = self.described((reader, relation.item));
            let rates: Vec<String> = found.iter().map(|(b, w)| format!("'{}.{}' {}", w.instance, w.port, b.text())).collect();
            let message = format!("{described} is synchronous, and its writers update at different rates: {}", rates.join(", "));
            let remedy = self.relax_remedy((reader, relation.item));
            let place = self.flat(reader).place.clone();
            self.refuse(Class::SchedulingError, message, &remedy, &place);
        }
        found.first().map(|(beat, _)| *beat).or_else(|| (!writers.is_empty()).then_some(Beat::Once))
    }

    fn check_ratio(&mut self, reader: Port, relation: &Relation, activity: &Activity, beats: &[Vec<Beat<'a>>]) {
        let Mode::Ratio(n) = relation.mode else { return };
        let updates = self.updates(relation, reader.0, activity, beats);
        for (at, update) in updates.iter().enumerate() {
            let own = beats[reader.0][at];
            let list = activity.list_of[activity.on[reader.0][at].stage as usize];
            match update {
                None => return self.nobody_drives(reader, relation, list),
                Some(Beat::Once | Beat::Idle) => {}
                Some(update) if *update == own.divided(n) => {}
                Some(update) => {
                    let (described, writer) = (self.described(reader), self.writer_text(relation.cell));
                    let message = format!(
                        "{described} has ratio {n} and runs {}, but {writer} updates {}: it would have to update {}",
                        own.text(),
                        update.text(),
                        own.divided(n).text()
                    );
                    let remedy = format!("change one of the intervals, or relax the input with modes={{'{}': 'asynchronous'}}", self.port_name(reader));
                    return self.refuse_at(Class::SchedulingError, message, &remedy, &self.flat(reader.0).place.clone(), [self.drawn(reader), self.list(list)]);
                }
            }
        }
    }

    fn nobody_drives(&mut self, reader: Port, relation: &Relation, list: usize) {
        let described = self.described(reader);
        let about = [self.drawn(reader), self.list(list)];
        let list = &self.checked.lists[list].name;
        let mode = relation.mode.name();
        let cell = self.cell_text(relation.cell);
        let refusal = Refusal::new(
            Class::SchedulingError,
            format!("nothing drives {described}: it is {mode}, and no active block writes {cell} in command list '{list}'"),
        );
        let refusal = refusal.remedy(format!("bind a writer to {cell} and activate it, or {}", self.relax_remedy(reader)));
        let place = &self.flat(reader.0).place;
        self.refusals.push(refusal.end(described, place).at(place).at(&self.checked.lists[0].place).about(about));
    }

    /// Returns the location of a command list in the drawing.
    fn list(&self, list: usize) -> Where {
        Where::List { list: self.checked.lists[list].name.clone() }
    }

    fn rates_differ(&mut self, first: Port, other: Beat<'_>, second: Port, update: Beat<'_>) {
        let (a, b) = (self.described(first), self.described(second));
        let message = format!("{a} is driven {}, but {b} {}: synchronous inputs of a block must update at the same rate", other.text(), update.text());
        let remedy = self.relax_remedy(second);
        let place = self.flat(first.0).place.clone();
        self.refuse_at(Class::SchedulingError, message, &remedy, &place, [self.drawn(second), self.drawn(first)]);
    }

    /// Returns the name of a cell for messages.
    pub fn cell_text(&self, cell: CellIndex) -> String {
        match &self.cells[cell].kind {
            CellKind::Svv { name, .. } => format!("SVV '{name}'"),
            CellKind::Private { name } | CellKind::Constant { name } => format!("cell '{name}'"),
            CellKind::Channel { device, channel, .. } => {
                let name = self.configuration.devices.get(device).and_then(|d| d.channels.get(*channel)).map_or("", |c| &c.name);
                format!("channel '{device}.{name}'")
            }
        }
    }

    fn writer_text(&self, cell: CellIndex) -> String {
        match (self.cells[cell].writers.first(), self.external_writers(cell).first()) {
            (Some(port), _) => self.described(*port),
            (None, Some(writer)) => format!("'{}.{}'", writer.instance, writer.port),
            (None, None) => self.cell_text(cell),
        }
    }

    pub fn port_name(&self, port: Port) -> String {
        format!("{}.{}", self.flat(port.0).label, self.flat(port.0).kind.item(port.1).name)
    }

    pub fn relax_remedy(&self, reader: Port) -> String {
        format!("relax it with modes={{'{}': 'asynchronous'}}", self.port_name(reader))
    }

    /// Checks that no two blocks that are active at the same time write the same cell.
    pub fn one_writer(&mut self, activity: &Activity) {
        for cell in 0..self.cells.len() {
            let writers = self.cells[cell].writers.clone();
            for (at, first) in writers.iter().enumerate() {
                for second in &writers[at + 1..] {
                    self.check_writers(cell, *first, *second, activity);
                }
            }
        }
    }

    fn check_writers(&mut self, cell: CellIndex, first: Port, second: Port, activity: &Activity) {
        let both = |on: &&super::activity::On| activity.on[second.0].binary_search_by_key(&on.stage, |on| on.stage).is_ok();
        let together = activity.on[first.0].iter().find(both).map(|on| activity.list_of[on.stage as usize]);
        let same_block = first.0 == second.0;
        if together.is_none() && !same_block {
            return;
        }
        let (a, b) = (self.described(first), self.described(second));
        let about = [self.drawn(second), self.drawn(first)].into_iter().chain(together.map(|list| self.list(list)));
        let about: Vec<Where> = about.collect();
        let list = together.map(|list| format!(" in command list '{}'", self.checked.lists[list].name)).unwrap_or_default();
        let message = format!("{} has two active writers{list}: {a} and {b}", self.cell_text(cell));
        let refusal = Refusal::new(Class::SecondWriter, message).remedy("give one of them its own cell, or deactivate it first");
        let refusal = refusal.end(a, &self.flat(first.0).place).end(b, &self.flat(second.0).place);
        self.refusals.push(refusal.at(&self.flat(second.0).place).at(&self.checked.place).about(about));
    }
}
