// SPDX-License-Identifier: Apache-2.0
//! What of a host lies elsewhere: which sources, the processes that reach over several places, and what came from there.
use crate::connection::End;
use crate::far::{Far, Nowhere, Reach, Way};
use crate::process::Home;
use crate::relay::Relays;
use crate::*;
use interconnect::{Carrier, ConnectionSpec, EndError, Memory, Receiver, Sender};
use std::collections::{HashMap, VecDeque};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, RwLock, Weak};

/// The sources that lie elsewhere, and what is to be told of them.
#[derive(Default)]
pub(crate) struct Abroad {
    far: RwLock<HashMap<SourceId, Arc<dyn Far>>>,
    is_any: AtomicBool,
    /// Of the connections that reach there.
    last_way: AtomicU64,
    /// Processes with sources there.
    processes: Mutex<HashMap<u64, Weak<Process>>>,
    /// How many of them somebody held when they were looked through last.
    held: AtomicUsize,
    /// What came from there: (order among the events of the host, event).
    told: Mutex<VecDeque<(u64, Event)>>,
    /// What is told before everything else, because it belongs before an event that was taken already.
    first: Mutex<VecDeque<Event>>,
    /// Connections from place to place that go through here.
    pub(crate) relays: Relays,
}

impl Abroad {
    pub(crate) fn is_any(&self) -> bool {
        self.is_any.load(Ordering::Acquire)
    }

    pub(crate) fn pop_first(&self) -> Option<Event> {
        if self.is_any() { locked(&self.first).pop_front() } else { None }
    }

    /// What came from elsewhere before the event `serial` was made here.
    pub(crate) fn take_told(&self, serial: Option<u64>) -> Option<Event> {
        if !self.is_any() {
            return None;
        }
        let mut told = locked(&self.told);
        told.pop_front_if(|(at, _)| serial.is_none_or(|serial| *at < serial)).map(|(_, event)| event)
    }

    pub(crate) fn close(&self) {
        self.relays.close();
        let all: Vec<Arc<dyn Far>> = self.far.read().expect("nobody panics with the lock held").values().cloned().collect();
        all.iter().enumerate().filter(|(index, far)| !all[..*index].iter().any(|other| Arc::ptr_eq(other, far))).for_each(|(_, far)| far.close());
    }

    fn process(&self, id: u64) -> Option<Arc<Process>> {
        locked(&self.processes).get(&id)?.upgrade()
    }
}

/// Below this many processes none is looked for that nobody holds.
const PROCESSES_MIN: usize = 256;

pub(crate) fn locked<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().expect("nobody panics with the lock held")
}

impl Host {
    /// A source that `far` runs: it is called by number like those here.
    pub fn add_far_source(&self, spec: SourceSpec, far: Arc<dyn Far>) -> SourceId {
        let id = self.reserve(spec);
        self.abroad.far.write().expect("nobody panics with the lock held").insert(id, far);
        self.abroad.is_any.store(true, Ordering::Release);
        id
    }

    /// Keeps the number of a source that nobody here needs to reach.
    pub fn skip_source(&self, spec: SourceSpec) -> SourceId {
        self.reserve(spec)
    }

    /// Who runs a source, where that lies elsewhere.
    pub(crate) fn far(&self, source: SourceId) -> Option<Arc<dyn Far>> {
        if !self.abroad.is_any() {
            return None;
        }
        self.abroad.far.read().expect("nobody panics with the lock held").get(&source).cloned()
    }

    /// The epoch of its clock, ns of CLOCK_MONOTONIC.
    pub fn epoch_ns(&self) -> i64 {
        self.epoch_ns
    }

    /// A process with steps in `sources`. See [`Process::new`]. Where they all lie in one place elsewhere its word is there.
    pub fn process(&self, id: u64, created: u64, sources: &[SourceId]) -> Arc<Process> {
        let mut places: Vec<Option<Arc<dyn Far>>> = Vec::new();
        for far in sources.iter().map(|source| self.far(*source)) {
            if !places.iter().any(|place| is_same(place, &far)) {
                places.push(far);
            }
        }
        let home = match places.as_mut_slice() {
            [] | [None] => return Process::new(id, created),
            [place @ Some(_)] => place.take().map_or(Home::Here, Home::There),
            _ => Home::Spread(places.into_iter().flatten().collect()),
        };
        let process = Process::at(id, created, home);
        let mut processes = locked(&self.abroad.processes);
        if processes.len() >= PROCESSES_MIN.max(2 * self.abroad.held.load(Ordering::Relaxed)) {
            processes.retain(|_, process| process.strong_count() > 0);
            self.abroad.held.store(processes.len(), Ordering::Relaxed);
        }
        processes.insert(id, Arc::downgrade(&process));
        process
    }

    /// A connection between two sources, over whatever carries it.
    pub fn connect(&self, spec: &ConnectionSpec) -> (End<dyn Sender>, End<dyn Receiver>) {
        let (writer, reader) = (SourceId(spec.writer), SourceId(spec.reader));
        let (from, to) = (self.far(writer), self.far(reader));
        if from.is_none() && to.is_none() {
            // Within a source nothing is on a way.
            let (sender, receiver) = if writer == reader { Memory.connect(spec) } else { locked(&self.carrier).connect(spec) };
            let Some((trace, tape)) = self.trace().and_then(|trace| Some((trace, self.source(reader).tape.clone()?))) else {
                return (sender.into(), receiver.into());
            };
            let way = Some(Way { number: trace.way(), spec: *spec, reach: Reach::Process });
            return (End { end: sender, way }, End { end: Box::new(crate::trace::Taped::recording(receiver, tape)), way });
        }
        let reach = self.reach(writer, reader);
        let way = Way { number: self.abroad.last_way.fetch_add(1, Ordering::Relaxed) + 1, spec: *spec, reach };
        if let (Some(from), Some(to)) = (&from, &to)
            && from.host().is_some() != to.host().is_some()
        {
            return self.relayed(way, &**from, &**to);
        }
        let sender: Box<dyn Sender> = match (&from, &to) {
            (None, Some(to)) => to.sender(way.number, spec).unwrap_or_else(|why| Box::new(self.unconnected(&way, &why))),
            _ => Box::new(Nowhere::default()),
        };
        let receiver: Box<dyn Receiver> = match (&from, &to) {
            (Some(from), None) => from.receiver(way.number, spec, self.raiser_of(reader)).unwrap_or_else(|why| Box::new(self.unconnected(&way, &why))),
            _ => Box::new(Nowhere::default()),
        };
        (End { end: sender, way: Some(way) }, End { end: receiver, way: Some(way) })
    }

    /// A connection between a process of this host and another host: each has its end of a way to here.
    fn relayed(&self, way: Way, from: &dyn Far, to: &dyn Far) -> (End<dyn Sender>, End<dyn Receiver>) {
        let to_here = |far: &dyn Far| Some(Way { reach: if far.host().is_some() { Reach::Network } else { Reach::Host }, ..way });
        let wanted = self.relay(&way, from, to).inspect_err(|why| drop(self.unconnected(&way, why))).ok();
        let sender = Box::new(Nowhere::relayed(wanted.clone()));
        (End { end: sender, way: to_here(from) }, End { end: Box::new(Nowhere::relayed(wanted)), way: to_here(to) })
    }

    /// How far apart two sources lie.
    pub fn reach(&self, writer: SourceId, reader: SourceId) -> Reach {
        let (from, to) = (self.far(writer), self.far(reader));
        match (&from, &to) {
            _ if is_same(&from, &to) => Reach::Process,
            (from, to) if from.as_ref().and_then(|far| far.host()) == to.as_ref().and_then(|far| far.host()) => Reach::Host,
            _ => Reach::Network,
        }
    }

    /// An end that could not be made says so, and nothing comes over it.
    fn unconnected(&self, way: &Way, why: &EndError) -> Nowhere {
        let (writer, reader) = (SourceId(way.spec.writer), SourceId(way.spec.reader));
        self.tell(Event::Unconnected { writer, reader, message: why.message.clone() });
        Nowhere::of(&way.spec)
    }

    /// What raises a source when a row has come to it from elsewhere; off the real-time path.
    pub fn raiser_of(&self, reader: SourceId) -> Box<dyn Fn() + Send + Sync> {
        let (source, epoch_ns) = (self.source(reader), self.epoch_ns);
        Box::new(move || {
            if source.period_ns().is_none() {
                source.request(clock::monotonic_ns() - epoch_ns);
                source.bell.wake();
            }
        })
    }

    /// Passes the requests of a source that lies elsewhere on: a channel here raises it. A thread of its own waits for them, until the host
    /// is closed.
    ///
    /// # Errors
    /// The thread cannot be made.
    pub fn pass_on(&self, source: SourceId, request: Box<dyn Fn() + Send>) -> std::io::Result<()> {
        let raised = self.source(source);
        let body = move || {
            while !raised.closing.load(Ordering::Acquire) {
                let seen = raised.bell.rings();
                let requests = raised.requests.swap(0, Ordering::SeqCst);
                (0..requests).for_each(|_| request());
                if requests == 0 {
                    raised.bell.sleep(seen, None);
                }
            }
        };
        let thread = std::thread::Builder::new().name("passes-on".into()).spawn(body)?;
        self.keep_thread(thread);
        Ok(())
    }

    /// What came from elsewhere: one of the events, in order.
    pub fn tell(&self, event: Event) {
        let serial = self.shared.serials.fetch_add(1, Ordering::AcqRel);
        self.abroad.is_any.store(true, Ordering::Release);
        locked(&self.abroad.told).push_back((serial, event));
        self.shared.supervisor.ring();
    }

    /// Sets or clears the flag of the emergency stop everywhere else.
    pub fn stop_abroad(&self, set: bool) {
        self.abroad.far.read().expect("nobody panics with the lock held").values().for_each(|far| far.stop(set));
    }

    /// What a script does to processes that reach over several places is told to the others of these.
    pub(crate) fn announce(&self, source: SourceId, script: &Script) {
        if !self.abroad.is_any() {
            return;
        }
        let to = self.far(source);
        for (process, step) in steps(script) {
            let Home::Spread(places) = process.home() else { continue };
            match step {
                Step::Enter(stage, generation) => process.enter(stage, Some(generation)),
                Step::Advance(generation, from, stage) => process.advance(generation, from, stage),
            };
            let (generation, stage) = process.now();
            let others = places.iter().filter(|place| to.as_ref().is_none_or(|to| !Arc::ptr_eq(to, place)));
            others.for_each(|place| place.enter(process.id(), stage, generation));
        }
    }

    /// Serves what no kernel could, conditions of processes that reach over several places; and follows those whose word is elsewhere.
    pub(crate) fn serve(&self, event: Event) -> Event {
        match event {
            Event::Unwatched { source, process: id, generation, block, item, fault, number, time_ns, value } => {
                let Some(process) = self.abroad.process(id).filter(|process| process.is_spread()) else {
                    return Event::Unwatched { source, process: id, generation, block, item, fault, number, time_ns, value };
                };
                let (present, stage) = process.now();
                let watches = process.watches(stage).iter().filter(|watch| watch.matches(block, item));
                let Some(watch) = watches.min_by_key(|watch| std::cmp::Reverse(watch.priority)) else {
                    return Event::Unwatched { source, process: id, generation, block, item, fault, number, time_ns, value };
                };
                let word = process.word();
                let remembers = matches!(watch.response, Response::Remember) && word.remembers() && process.is_of_list(generation);
                if remembers {
                    process.remember(watch.condition);
                }
                // What was reported before a wait of the same list was reached still counts for it.
                let acted = !remembers && process.is_of_list(generation) && word.acts() && process.freeze(word);
                let generation = if acted { present } else { generation };
                let condition = watch.condition;
                let (ended, stage, alone, captured) = (false, None, false, Vec::new());
                Event::Condition {
                    source,
                    process: id,
                    generation,
                    condition,
                    block,
                    item,
                    fault,
                    number,
                    time_ns,
                    alone,
                    acted,
                    ended,
                    stage,
                    value,
                    captured,
                }
            }
            Event::Done { source, script, firing, time_ns, captured } => {
                let found: Vec<Event> = steps(&script).filter_map(|(process, step)| served(process, &step, source, time_ns)).collect();
                let done = Event::Done { source, script, firing, time_ns, captured };
                let mut found = found.into_iter();
                let Some(first) = found.next() else { return done };
                locked(&self.abroad.first).extend(found.chain([done]));
                first
            }
            Event::Condition { process: id, generation, stage, ended, acted: true, .. } => {
                if let Some(process) = self.abroad.process(id).filter(|process| matches!(process.home(), Home::There(_))) {
                    process.follow(generation, stage, ended);
                }
                event
            }
            event => event,
        }
    }
}

/// A script that moved a process has been carried out: what it remembered acts, or its word here follows.
fn served(process: &Process, step: &Step, source: SourceId, time_ns: i64) -> Option<Event> {
    match (process.home(), step) {
        (Home::Spread(_), _) => return serve_remembered(process, source, time_ns),
        (Home::There(_), Step::Enter(stage, generation)) => process.enter(*stage, Some(*generation)),
        (Home::There(_), Step::Advance(generation, from, stage)) => process.advance(*generation, *from, *stage),
        (Home::Here, _) => return None,
    };
    None
}

/// A condition that came before the stage that waits for it acts when that is entered.
fn serve_remembered(process: &Process, source: SourceId, time_ns: i64) -> Option<Event> {
    let word = process.word();
    if !word.acts() {
        return None;
    }
    let watch = process.awaited(word.stage)?;
    process.forget(watch.condition);
    process.freeze(word).then(|| Event::Condition {
        source,
        process: process.id(),
        generation: word.generation,
        condition: watch.condition,
        block: watch.block.unwrap_or(BlockId(u32::MAX)),
        item: watch.item,
        fault: None,
        number: 0,
        time_ns,
        alone: false,
        acted: true,
        ended: false,
        stage: None,
        value: Vec::new(),
        captured: Vec::new(),
    })
}

/// What a script does to the word of a process.
enum Step {
    Enter(u16, u32),
    Advance(u32, u16, u16),
}

fn steps(script: &Script) -> impl Iterator<Item = (&Arc<Process>, Step)> {
    script.ops.iter().filter_map(|op| match op {
        Op::Stage { process, stage, generation: Some(generation) } => Some((process, Step::Enter(*stage, *generation))),
        Op::Advance { process, generation, from, to } => Some((process, Step::Advance(*generation, *from, *to))),
        _ => None,
    })
}

fn is_same(one: &Option<Arc<dyn Far>>, other: &Option<Arc<dyn Far>>) -> bool {
    match (one, other) {
        (Some(one), Some(other)) => Arc::ptr_eq(one, other),
        (None, None) => true,
        _ => false,
    }
}
