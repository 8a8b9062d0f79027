// SPDX-License-Identifier: Apache-2.0
//! Processes: owners of steps, with the responses to their conditions.
use crate::block::BlockId;
use crate::process_word::{CLAIMED, ENDED, FROZEN, Word};
use crate::running_time::{RunningTime, RunningTimes};
use crate::source::SourceId;
use std::any::Any;
use std::cmp::Reverse;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

/// Maximum number of bytes that a reaction may capture.
pub const CAPTURED_MAX: usize = 128 * 1024;

/// Response of the kernel to a watched condition.
pub enum Response {
    /// A prepared local reaction: runs the script in the same firing, after publication, and moves the process to `next` (`None`: the
    /// process has ended; further conditions are only recorded). Reported to the supervisor by `Event::Condition`.
    React { script: Arc<dyn Reaction>, next: Option<u16> },
    /// The process is frozen in its stage, so that no further condition takes effect, and the supervisor takes over.
    Tell,
    /// The condition is remembered, so that a later stage whose `awaits` names it continues immediately; it is reported to the
    /// supervisor.
    Remember,
}

/// A prepared reaction to a condition: a script, which the kernel carries out in the firing that reported the condition.
pub trait Reaction: Any + Send + Sync {
    /// Returns the number of bytes captured by the reaction.
    fn captured_len(&self) -> usize;
    /// Returns true if the reaction changes the structure of a source, rather than only the contents of blocks and devices; this is not
    /// allowed.
    fn swaps(&self) -> bool;
}

/// One line of a stage's watch table.
pub struct Watch {
    /// Block that reports the condition; `None` with `item` FAULT matches a fault of any block of the process.
    pub block: Option<BlockId>,
    /// Item index of the condition, or [`Watch::FAULT`].
    pub item: u8,
    /// Index of the verb's termination condition that the watch represents, reported in the event; below 64 if it is remembered.
    pub condition: u16,
    /// Priority: larger values are served first; watches of equal priority are served in the order of this table.
    pub priority: i32,
    /// Response to the condition.
    pub response: Response,
}

impl Watch {
    /// Item index that represents a fault of the block.
    pub const FAULT: u8 = 255;

    pub fn matches(&self, block: BlockId, item: u8) -> bool {
        self.item == item && (self.block == Some(block) || (self.block.is_none() && item == Watch::FAULT))
    }
}

/// Section of a command list between two waits, with the conditions watched in the meantime.
pub struct Stage {
    /// Watches, in order of declaration.
    pub watches: Vec<Watch>,
}

/// A verb instance as the kernels see it. It may have steps in several sources. Kernel, supervisor and PS race to change one word
/// (generation, stage, moved), and only the first one to move the process acts.
pub struct Process {
    id: u64,
    created: u64,
    home: Home,
    word: AtomicU64,
    pub stages: OnceLock<Vec<Stage>>,
    /// Bits of the conditions that were reported but not served in this generation.
    remembered: AtomicU64,
    /// Generation in which the current list began.
    list: AtomicU32,
    /// Running times of the process, one per source.
    times: RunningTimes,
}

/// Location of a process's word.
pub enum Home {
    /// All sources of the process are on this host.
    Here,
    /// All sources of the process are remote, in the same processor process: the local word only mirrors the remote one.
    There(Arc<dyn RemoteWord>),
    /// The word is local, although the sources are in several locations; their kernels only report conditions.
    Spread,
}

/// Access to the word of a process whose sources are all remote.
pub trait RemoteWord: Send + Sync {
    /// Carries out [`Process::take`] remotely. Returns `None` if there is no answer.
    fn take(&self, process: u64, generation: u32, insist: bool) -> Option<TakeResult>;
}

/// Result of [`Process::take`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum TakeResult {
    /// The process was in this stage.
    From(u16),
    /// The process had not yet entered a stage in that generation.
    Before,
    /// A kernel was faster; its event reports it.
    Late,
}

impl Process {
    /// Creates a process. `created`: order of creation, which determines the order in which conditions of one firing are served. The
    /// stages may be set once, later, because scripts refer to the process. The process starts in generation 0, stage 0, frozen until an
    /// `Op::Stage`.
    pub fn new(id: u64, created: u64) -> Arc<Process> {
        Process::at(id, created, Home::Here)
    }

    /// Creates a process some or all of whose sources are remote.
    pub fn at(id: u64, created: u64, home: Home) -> Arc<Process> {
        let word = AtomicU64::new(Word { generation: 0, stage: 0, flags: FROZEN }.pack());
        Arc::new(Process {
            id,
            created,
            home,
            word,
            stages: OnceLock::new(),
            remembered: AtomicU64::new(0),
            list: AtomicU32::new(0),
            times: RunningTimes::default(),
        })
    }

    /// Sets the stages, once. Panics on a second call, if a reaction swaps a table, or if a remembered condition's index is 64 or more.
    pub fn set_stages(&self, stages: Vec<Stage>) {
        for watch in stages.iter().flat_map(|stage| &stage.watches) {
            match &watch.response {
                Response::React { script, .. } => {
                    assert!(!script.swaps(), "a reaction cannot swap a table; switch activations instead");
                    assert!(script.captured_len() <= CAPTURED_MAX, "a reaction can capture {CAPTURED_MAX} bytes, not {}", script.captured_len());
                }
                Response::Remember => assert!(watch.condition < 64, "at most 64 conditions of a process can be remembered"),
                Response::Tell => {}
            }
        }
        assert!(self.stages.set(stages).is_ok(), "the stages of process {} were already set", self.id);
    }

    /// Returns the process's identifier in events.
    pub fn id(&self) -> u64 {
        self.id
    }

    /// Returns the current generation and stage.
    pub fn now(&self) -> (u32, u16) {
        let word = self.word();
        (word.generation, word.stage)
    }

    /// Takes the process from the kernels for the supervisor: moves it past `generation` and freezes it until an `Op::Stage` of a later
    /// generation. Pending stages of `generation` have no effect. Changes nothing if a kernel was faster and ended the process in
    /// `generation` or, unless `insist`, froze it; the kernel's event reports this.
    pub fn take(&self, generation: u32, insist: bool) -> TakeResult {
        let Home::There(remote) = &self.home else { return self.take_here(generation, insist, None) };
        match remote.take(self.id, generation, insist) {
            Some(TakeResult::Late) => TakeResult::Late,
            Some(taken) => {
                // The move to this stage may not have been reported yet: the process was taken in this stage.
                let stage = if let TakeResult::From(stage) = taken { Some(stage) } else { None };
                self.take_here(generation, true, stage);
                taken
            }
            // No remote kernel moves it any longer.
            None => match self.take_here(generation, true, None) {
                TakeResult::Late => TakeResult::From(self.word().stage),
                taken => taken,
            },
        }
    }

    /// Takes the process locally. `stage`: its stage, if the local word does not contain it.
    fn take_here(&self, generation: u32, insist: bool, stage: Option<u16>) -> TakeResult {
        let taken = self.change(|word| {
            let late = word.generation > generation || (word.generation == generation && (word.flags & ENDED != 0 || (word.flags == FROZEN && !insist)));
            (!late).then_some(Word { generation: generation + 1, stage: stage.unwrap_or(word.stage), flags: FROZEN | CLAIMED })
        });
        match taken {
            None => TakeResult::Late,
            Some(before) if before.generation < generation => TakeResult::Before,
            Some(before) => TakeResult::From(before.stage),
        }
    }

    /// Carries out `Op::Advance`; returns true if it took effect.
    pub fn advance(&self, generation: u32, from: u16, to: u16) -> bool {
        self.change(|word| (word.acts() && word.generation == generation && word.stage == from).then_some(Word { stage: to, ..word })).is_some()
    }

    /// Moves the process from generation `from` to the next on behalf of the supervisor, and freezes it until an `Op::Stage`. Returns
    /// false if a kernel was faster and froze or ended the process; the kernel's event reports this.
    pub fn claim(&self, from: u32) -> bool {
        self.change(|word| (word.generation == from && word.acts()).then_some(Word { generation: from + 1, stage: word.stage, flags: FROZEN | CLAIMED }))
            .is_some()
    }

    /// Returns true if the process's sources are in several locations, so that only the supervisor answers its conditions.
    pub fn is_spread(&self) -> bool {
        matches!(self.home, Home::Spread)
    }

    /// Stores the stage of a process whose word is remote; subsequent reports refer to it.
    pub fn at_stage(&self, stage: u16, generation: u32) {
        self.change(|word| (word.generation <= generation).then_some(Word { generation, stage, flags: 0 }));
    }

    pub fn home(&self) -> &Home {
        &self.home
    }

    /// Stores a change that the remote kernel made to a process whose word is remote.
    pub fn follow(&self, generation: u32, stage: Option<u16>, ended: bool) {
        self.change(|word| {
            let flags = if ended { ENDED } else { u16::from(stage.is_none()) * FROZEN };
            (word.generation == generation).then_some(Word { stage: stage.unwrap_or(word.stage), flags, ..word })
        });
    }

    pub fn created(&self) -> u64 {
        self.created
    }

    pub fn word(&self) -> Word {
        Word::unpack(self.word.load(Ordering::Acquire))
    }

    pub fn watches(&self, stage: u16) -> &[Watch] {
        self.stages.get().and_then(|stages| stages.get(usize::from(stage))).map_or(&[], |stage| &stage.watches)
    }

    /// Returns the first watch of `stage`, in serving order, for a condition, with its index.
    pub fn watch_of(&self, stage: u16, block: BlockId, item: u8) -> Option<(usize, &Watch)> {
        let lines = self.watches(stage).iter().enumerate().filter(|(_, watch)| watch.matches(block, item));
        lines.min_by_key(|(line, watch)| (Reverse(watch.priority), *line))
    }

    /// Freezes the process for the supervisor, unless its word has changed.
    pub fn freeze(&self, seen: Word) -> bool {
        self.exchange(seen, Word { flags: FROZEN, ..seen })
    }

    /// Moves the process to the next stage of a reaction, or ends it, unless its word has changed.
    pub(crate) fn react(&self, seen: Word, next: Option<u16>) -> bool {
        self.exchange(seen, Word { stage: next.unwrap_or(seen.stage), flags: if next.is_some() { 0 } else { ENDED }, ..seen })
    }

    /// Carries out `Op::Stage`; returns true if it took effect. A new generation forgets the remembered conditions, unless the supervisor
    /// had taken the process and continues in the generation that started then. Stages of an older generation, or of one that is already
    /// under way, have no effect.
    pub fn enter(&self, stage: u16, generation: Option<u32>) -> bool {
        let entered = self.change(|word| match generation {
            None => word.acts().then_some(Word { stage, ..word }),
            Some(generation) if word.generation < generation || (word.generation == generation && !word.acts()) => Some(Word { generation, stage, flags: 0 }),
            Some(_) => None,
        });
        if let (Some(before), Some(generation)) = (entered, generation)
            && before.generation != generation
        {
            self.list.store(generation, Ordering::Release);
            self.remembered.store(0, Ordering::Release);
        }
        entered.is_some()
    }

    /// Returns true if a report of `generation` belongs to the current list.
    pub fn is_of_list(&self, generation: u32) -> bool {
        generation >= self.list.load(Ordering::Acquire)
    }

    pub fn remember(&self, condition: u16) {
        self.remembered.fetch_or(1 << condition, Ordering::AcqRel);
    }

    /// Returns the first watch of `stage`, in serving order, whose condition was reported before the stage was entered.
    pub fn awaited(&self, stage: u16) -> Option<&Watch> {
        self.awaited_of(stage, self.remembered())
    }

    /// Returns the conditions that were reported but not served, one bit per condition.
    pub fn remembered(&self) -> u64 {
        self.remembered.load(Ordering::Acquire)
    }

    /// Returns the watch of `stage` for a condition among `remembered`.
    pub(crate) fn awaited_of(&self, stage: u16, remembered: u64) -> Option<&Watch> {
        let came = |condition: u16| condition < 64 && remembered & (1 << condition) != 0;
        let waits = |watch: &&Watch| came(watch.condition) && !matches!(watch.response, Response::Remember);
        self.watches(stage).iter().filter(waits).min_by_key(|watch| Reverse(watch.priority))
    }

    pub(crate) fn forget_all(&self) {
        self.remembered.store(0, Ordering::Release);
    }

    pub fn forget(&self, condition: u16) {
        self.remembered.fetch_and(!(1 << condition), Ordering::AcqRel);
    }

    /// Returns the process's running time in `source`; creates it if it is missing. Not on the real-time path.
    pub fn prepare_time(&self, source: SourceId) -> &RunningTime {
        self.times.prepare(source)
    }

    /// Returns the process's running time in `source`, if it was prepared.
    pub fn time(&self, source: SourceId) -> Option<&RunningTime> {
        self.times.find(source)
    }

    fn exchange(&self, seen: Word, next: Word) -> bool {
        self.word.compare_exchange(seen.pack(), next.pack(), Ordering::AcqRel, Ordering::Acquire).is_ok()
    }

    /// Changes the word. Returns the previous word, or `None` if `next` refused the change.
    fn change(&self, next: impl Fn(Word) -> Option<Word>) -> Option<Word> {
        self.word.fetch_update(Ordering::AcqRel, Ordering::Acquire, |word| next(Word::unpack(word)).map(Word::pack)).ok().map(Word::unpack)
    }
}
