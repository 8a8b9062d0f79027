// SPDX-License-Identifier: Apache-2.0
//! Processes: whose step a step is, its running time, and what answers its conditions.
use crate::far::Far;
use crate::firing::CAPTURED_MAX;
use crate::{BlockId, Op, Script, SourceId};
use opengpac::abi::Invocation;
use std::cell::UnsafeCell;
use std::cmp::Reverse;
use std::ptr;
use std::sync::atomic::{AtomicPtr, AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

/// What the kernel does when a watched condition comes.
pub enum Response {
    /// A prepared local answer: runs the script in the same firing, after publication, and goes to `next` (`None`: the process
    /// has ended; further conditions are only recorded). Told to the supervisor by `Event::Condition`.
    React { script: Arc<Script>, next: Option<u16> },
    /// The process is frozen in its stage (nothing further acts) and the supervisor carries on.
    Tell,
    /// Remembered, so that a later stage whose `awaits` names it goes on at once; told to the supervisor.
    Remember,
}

/// One line of a stage's watch table.
pub struct Watch {
    /// Whose condition; `None` with `item` FAULT: a fault of any block of the process.
    pub block: Option<BlockId>,
    /// Item index of the condition, or [`Watch::FAULT`].
    pub item: u8,
    /// The verb's termination condition it stands for (index), for the event; below 64 where it is remembered.
    pub condition: u16,
    /// Larger first; then order in this table.
    pub priority: i32,
    /// What happens.
    pub response: Response,
}

impl Watch {
    /// Stands for a fault of the block.
    pub const FAULT: u8 = 255;

    pub(crate) fn matches(&self, block: BlockId, item: u8) -> bool {
        self.item == item && (self.block == Some(block) || (self.block.is_none() && item == Watch::FAULT))
    }
}

/// A stretch of a command list between two waits: what is watched meanwhile.
pub struct Stage {
    /// In order of declaration.
    pub watches: Vec<Watch>,
}

/// A verb instance as the kernels know it. It may have steps in several sources. One word, (generation, stage, moved), is what
/// kernel, supervisor and PS race on: whoever moves it first acts.
pub struct Process {
    id: u64,
    created: u64,
    home: Home,
    word: AtomicU64,
    pub(crate) stages: OnceLock<Vec<Stage>>,
    /// One bit a condition that came, unserved, in this generation.
    remembered: AtomicU64,
    /// The generation in which the present list began.
    list: AtomicU32,
    /// Its running times, one a source: a list that only grows.
    times: AtomicPtr<RunningTime>,
}

/// Where the word of a process is.
pub(crate) enum Home {
    /// All of its sources lie here.
    Here,
    /// All of its sources lie in that one place: the word here only follows.
    There(Arc<dyn Far>),
    /// Here; kernels in these places tell what comes, and know which stage it belongs to.
    Spread(Vec<Arc<dyn Far>>),
}

/// Running time of a process in one source, and what its blocks are told.
pub(crate) struct RunningTime {
    source: SourceId,
    next: *mut RunningTime,
    state: UnsafeCell<TimeState>,
}

/// What the kernel of that source alone touches.
#[derive(Default)]
pub(crate) struct TimeState {
    pub(crate) invocation: Invocation,
    /// Clock time at which the running time was 0, while it runs; else the running time itself.
    base_ns: i64,
    runs: bool,
    /// The serving pass in which a condition of the process acted last.
    pub(crate) moved: u64,
}

// SAFETY: the word and the list are atomic; each running time is touched by the kernel of its source alone.
unsafe impl Send for Process {}
// SAFETY: as for `Send`.
unsafe impl Sync for Process {}

/// What [`Process::take`] found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Taken {
    /// It was in this stage.
    From(u16),
    /// It had not entered a stage in that generation yet.
    Before,
    /// A kernel was faster; its event tells.
    Late,
}

/// The process's word: generation 32 | stage 16 | flags 16.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) struct Word {
    pub(crate) generation: u32,
    pub(crate) stage: u16,
    pub(crate) flags: u16,
}

/// Nothing acts until an `Op::Stage`.
const FROZEN: u16 = 1;
/// Frozen by `claim`, which moved it to the next generation; what still runs belongs to the one before.
const CLAIMED: u16 = 2;
/// Ended by a reaction.
const ENDED: u16 = 4;

impl Word {
    pub(crate) fn pack(self) -> u64 {
        u64::from(self.generation) << 32 | u64::from(self.stage) << 16 | u64::from(self.flags)
    }

    pub(crate) fn unpack(word: u64) -> Word {
        Word { generation: (word >> 32) as u32, stage: (word >> 16) as u16, flags: word as u16 }
    }

    /// True while conditions act.
    pub(crate) fn acts(self) -> bool {
        self.flags == 0
    }

    /// True while a condition that comes counts for the waits of the present list: also while the supervisor has taken it to carry it on.
    /// Where it goes to another list, what was remembered is forgotten.
    pub(crate) fn remembers(self) -> bool {
        self.flags & ENDED == 0
    }

    /// The generation that what runs now belongs to.
    pub(crate) fn running_generation(self) -> u32 {
        self.generation - u32::from(self.flags & CLAIMED != 0 && self.generation > 0)
    }
}

impl Process {
    /// `created`: creation order, for serving conditions of one firing. Stages may be given once, later (scripts refer to the
    /// process). It is in generation 0, stage 0, frozen until an `Op::Stage`.
    pub fn new(id: u64, created: u64) -> Arc<Process> {
        Process::at(id, created, Home::Here)
    }

    /// The same where its sources, or some of them, lie elsewhere: see `Host::process`.
    pub(crate) fn at(id: u64, created: u64, home: Home) -> Arc<Process> {
        let word = AtomicU64::new(Word { generation: 0, stage: 0, flags: FROZEN }.pack());
        Arc::new(Process {
            id,
            created,
            home,
            word,
            stages: OnceLock::new(),
            remembered: AtomicU64::new(0),
            list: AtomicU32::new(0),
            times: AtomicPtr::new(ptr::null_mut()),
        })
    }

    /// Gives the stages; once. Panics the second time, where a reaction swaps a table, or where a remembered condition's index
    /// is 64 or more.
    pub fn set_stages(&self, stages: Vec<Stage>) {
        for watch in stages.iter().flat_map(|stage| &stage.watches) {
            match &watch.response {
                Response::React { script, .. } => {
                    assert!(!script.ops.iter().any(Op::swaps), "a reaction cannot swap a table; switch activations instead");
                    assert!(script.captured_len() <= CAPTURED_MAX, "a reaction can capture {CAPTURED_MAX} bytes, not {}", script.captured_len());
                }
                Response::Remember => assert!(watch.condition < 64, "at most 64 conditions of a process can be remembered"),
                Response::Tell => {}
            }
        }
        assert!(self.stages.set(stages).is_ok(), "the stages of process {} were given before", self.id);
    }

    /// Its name in events.
    pub fn id(&self) -> u64 {
        self.id
    }

    /// Generation and stage now.
    pub fn now(&self) -> (u32, u16) {
        let word = self.word();
        (word.generation, word.stage)
    }

    /// Supervisor: takes it from the kernels, past `generation`: frozen until an `Op::Stage` of the next one or later, and stages of
    /// `generation` that are still on their way change nothing. A kernel that ended it in `generation` was faster, and, unless
    /// `insist`, one that froze it: then nothing changes, its event tells.
    pub fn take(&self, generation: u32, insist: bool) -> Taken {
        let Home::There(far) = &self.home else { return self.take_here(generation, insist, None) };
        match far.take(self.id, generation, insist) {
            Some(Taken::Late) => Taken::Late,
            Some(taken) => {
                // What moved it there may not have been told yet: its stage is the one in which it was taken.
                let stage = if let Taken::From(stage) = taken { Some(stage) } else { None };
                self.take_here(generation, true, stage);
                taken
            }
            // Nobody there moves it any more.
            None => match self.take_here(generation, true, None) {
                Taken::Late => Taken::From(self.word().stage),
                taken => taken,
            },
        }
    }

    /// `stage`: in which it is, where its word here does not know.
    fn take_here(&self, generation: u32, insist: bool, stage: Option<u16>) -> Taken {
        let taken = self.change(|word| {
            let late = word.generation > generation || (word.generation == generation && (word.flags & ENDED != 0 || (word.flags == FROZEN && !insist)));
            (!late).then_some(Word { generation: generation + 1, stage: stage.unwrap_or(word.stage), flags: FROZEN | CLAIMED })
        });
        match taken {
            None => Taken::Late,
            Some(before) if before.generation < generation => Taken::Before,
            Some(before) => Taken::From(before.stage),
        }
    }

    /// `Op::Advance`: true if it is in force.
    pub(crate) fn advance(&self, generation: u32, from: u16, to: u16) -> bool {
        self.change(|word| (word.acts() && word.generation == generation && word.stage == from).then_some(Word { stage: to, ..word })).is_some()
    }

    /// Supervisor: moves it from generation `from` to the next, frozen until an `Op::Stage`. False if a kernel was faster (it
    /// froze or ended it): its event tells.
    pub fn claim(&self, from: u32) -> bool {
        self.change(|word| (word.generation == from && word.acts()).then_some(Word { generation: from + 1, stage: word.stage, flags: FROZEN | CLAIMED }))
            .is_some()
    }

    /// True where its sources lie in several places: nothing answers its conditions but the supervisor.
    pub fn is_spread(&self) -> bool {
        matches!(self.home, Home::Spread(_))
    }

    /// Of one whose word is elsewhere: what is reported from now on belongs to this stage.
    pub fn at_stage(&self, stage: u16, generation: u32) {
        self.change(|word| (word.generation <= generation).then_some(Word { generation, stage, flags: 0 }));
    }

    pub(crate) fn home(&self) -> &Home {
        &self.home
    }

    /// What the kernel there did with a process whose word is there.
    pub(crate) fn follow(&self, generation: u32, stage: Option<u16>, ended: bool) {
        self.change(|word| {
            let flags = if ended { ENDED } else { u16::from(stage.is_none()) * FROZEN };
            (word.generation == generation).then_some(Word { stage: stage.unwrap_or(word.stage), flags, ..word })
        });
    }

    pub(crate) fn created(&self) -> u64 {
        self.created
    }

    pub(crate) fn word(&self) -> Word {
        Word::unpack(self.word.load(Ordering::Acquire))
    }

    pub(crate) fn watches(&self, stage: u16) -> &[Watch] {
        self.stages.get().and_then(|stages| stages.get(usize::from(stage))).map_or(&[], |stage| &stage.watches)
    }

    /// Freezes it for the supervisor, if nobody was faster.
    pub(crate) fn freeze(&self, seen: Word) -> bool {
        self.exchange(seen, Word { flags: FROZEN, ..seen })
    }

    /// Moves it to the next stage of a reaction, or ends it, if nobody was faster.
    pub(crate) fn react(&self, seen: Word, next: Option<u16>) -> bool {
        self.exchange(seen, Word { stage: next.unwrap_or(seen.stage), flags: if next.is_some() { 0 } else { ENDED }, ..seen })
    }

    /// `Op::Stage`: true if it is in force. What is remembered is forgotten in a new generation, but not where the supervisor has
    /// taken it and goes on in the generation that this gave. A stage of an older generation, or of one that is under way already, is not.
    pub(crate) fn enter(&self, stage: u16, generation: Option<u32>) -> bool {
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

    /// True where what was reported in `generation` was so in the present list.
    pub(crate) fn is_of_list(&self, generation: u32) -> bool {
        generation >= self.list.load(Ordering::Acquire)
    }

    pub(crate) fn remember(&self, condition: u16) {
        self.remembered.fetch_or(1 << condition, Ordering::AcqRel);
    }

    /// What waits in `stage` for a condition that came before it was entered: the one to serve first.
    pub(crate) fn awaited(&self, stage: u16) -> Option<&Watch> {
        self.awaited_of(stage, self.remembered())
    }

    /// What came, unserved: one bit a condition.
    pub(crate) fn remembered(&self) -> u64 {
        self.remembered.load(Ordering::Acquire)
    }

    /// The same where `remembered` came.
    pub(crate) fn awaited_of(&self, stage: u16, remembered: u64) -> Option<&Watch> {
        let came = |condition: u16| condition < 64 && remembered & (1 << condition) != 0;
        let waits = |watch: &&Watch| came(watch.condition) && !matches!(watch.response, Response::Remember);
        self.watches(stage).iter().filter(waits).min_by_key(|watch| Reverse(watch.priority))
    }

    pub(crate) fn forget_all(&self) {
        self.remembered.store(0, Ordering::Release);
    }

    pub(crate) fn forget(&self, condition: u16) {
        self.remembered.fetch_and(!(1 << condition), Ordering::AcqRel);
    }

    /// Its running time in `source`, made where there is none. Not on the real-time path.
    pub(crate) fn prepare_time(&self, source: SourceId) -> &RunningTime {
        let mut made: *mut RunningTime = ptr::null_mut();
        loop {
            let head = self.times.load(Ordering::Acquire);
            if let Some(found) = find(head, source) {
                if !made.is_null() {
                    // SAFETY: made below and never published.
                    drop(unsafe { Box::from_raw(made) });
                }
                return found;
            }
            if made.is_null() {
                made = Box::into_raw(Box::new(RunningTime { source, next: head, state: UnsafeCell::new(TimeState::default()) }));
            }
            // SAFETY: not published yet.
            unsafe { (*made).next = head };
            if self.times.compare_exchange(head, made, Ordering::AcqRel, Ordering::Acquire).is_ok() {
                // SAFETY: it stays until the process goes.
                return unsafe { &*made };
            }
        }
    }

    /// Its running time in `source`, if it was prepared.
    pub(crate) fn time(&self, source: SourceId) -> Option<&RunningTime> {
        find(self.times.load(Ordering::Acquire), source)
    }

    fn exchange(&self, seen: Word, next: Word) -> bool {
        self.word.compare_exchange(seen.pack(), next.pack(), Ordering::AcqRel, Ordering::Acquire).is_ok()
    }

    /// Changes the word; gives the one before, or none where `next` refused.
    fn change(&self, next: impl Fn(Word) -> Option<Word>) -> Option<Word> {
        self.word.fetch_update(Ordering::AcqRel, Ordering::Acquire, |word| next(Word::unpack(word)).map(Word::pack)).ok().map(Word::unpack)
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let mut time = *self.times.get_mut();
        while !time.is_null() {
            // SAFETY: the list owns its members, and nobody else holds the process.
            time = unsafe { Box::from_raw(time) }.next;
        }
    }
}

fn find<'a>(mut time: *mut RunningTime, source: SourceId) -> Option<&'a RunningTime> {
    while !time.is_null() {
        // SAFETY: members of the list stay until the process goes.
        let found = unsafe { &*time };
        if found.source == source {
            return Some(found);
        }
        time = found.next;
    }
    None
}

impl RunningTime {
    /// What the kernel of its source touches, and nobody else.
    pub(crate) fn state(&self) -> *mut TimeState {
        self.state.get()
    }
}

impl TimeState {
    /// Tells the blocks of the process what time it is.
    #[inline]
    pub(crate) fn tell(&mut self, now_ns: i64) {
        self.invocation.now_ns = now_ns;
        self.invocation.time_ns = if self.runs { now_ns - self.base_ns } else { self.base_ns };
    }

    /// Starts at 0.
    pub(crate) fn start(&mut self, now_ns: i64) {
        self.base_ns = now_ns;
        self.runs = true;
    }

    /// Runs as another does whose clock is ahead by `ahead_ns`: by nothing, where it is of the same host.
    pub(crate) fn keep(&mut self, other: &TimeState, ahead_ns: i64) {
        (self.base_ns, self.runs) = (if other.runs { other.base_ns - ahead_ns } else { other.base_ns }, other.runs);
    }

    /// Stands still.
    pub(crate) fn stop(&mut self, now_ns: i64) {
        if self.runs {
            self.base_ns = now_ns - self.base_ns;
            self.runs = false;
        }
    }

    /// Goes on.
    pub(crate) fn resume(&mut self, now_ns: i64) {
        if !self.runs {
            self.base_ns = now_ns - self.base_ns;
            self.runs = true;
        }
    }
}
