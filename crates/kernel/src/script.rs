// SPDX-License-Identifier: Apache-2.0
//! Scripts: what changes between two firings of a source, prepared off the real-time path.
use crate::block::Block;
use crate::device::Device;
use crate::memory::Cell;
use crate::process::{Process, Reaction};
use crate::schedule::{Activation, Due};
use crate::source::SourceId;
use crate::table::Table;
use crate::window::Window;
use std::any::Any;
use std::ptr;
use std::sync::Arc;
use std::sync::atomic::{AtomicPtr, Ordering};

/// One operation of a script.
pub enum Op {
    /// Swaps the table. The old one is handed back with the acknowledgement and freed by the supervisor. After the swap every
    /// outbound connection that is new publishes its present values, and every new inbound one is latched. No reaction has it.
    Table(Box<Table>),
    /// Stores bytes (ψ values, writes from the PS, safe values).
    Store(Cell, Box<[u8]>),
    /// Appends the present value of a cell to a window of its last values: what a script stores is a value too.
    Append { value: Cell, window: Window },
    /// Every value of the window is the present one of the cell.
    Fill { value: Cell, window: Window },
    /// Copies one cell to another (`initial="sensed"`).
    Copy(Cell, Cell),
    /// Initial state: the block's image as installed, but for states declared `keep` and for parameters, presets and sizes, which
    /// keep what was stored last; invocation number 0.
    Reset(Arc<Block>),
    /// The first block takes over states, outputs and invocation number of the second, which is of the same code. It stands behind a reset.
    Keep(Arc<Block>, Arc<Block>),
    /// Switches an activation on, due at firings that are multiples of `every` (1 for a driven one). Nothing where it is on
    /// with the same `every` already: instance, state and phase stay.
    On(Arc<Activation>, u32),
    /// Lets it be driven by others; made by [`Activation::follow`]. What drove it goes back with the acknowledgement. No reaction has it.
    Follow { activation: Arc<Activation>, due: Box<Due>, had: Box<[u64]> },
    /// Sets its interval to `every` firings, whatever `On` says, and at once if it is on: next due at the first multiple after the last
    /// firing, so that no invocation is lost or doubled. 0: as `On` says, from the next on.
    Tune(Arc<Activation>, u32),
    /// Switches it off.
    Off(Arc<Activation>),
    /// `execute`: one extra firing at once, in which exactly these blocks are due, and what they drive, where that is on.
    Execute(Vec<Arc<Block>>),
    /// Sets the stage of the process, in generation `generation` (`None`: keep it; used by local reactions).
    /// Conditions that came, unserved, and that the stage waits for act at once. A generation that has passed, or that is under
    /// way already (several sources may be told), changes nothing.
    Stage { process: Arc<Process>, stage: u16, generation: Option<u32> },
    /// Advances from stage `from` to stage `to` of the same list, if the process acts in `generation` and is in `from`: a wait is
    /// reached when all commands before it have been carried out. Conditions that came, unserved, act at once.
    Advance { process: Arc<Process>, generation: u32, from: u16, to: u16 },
    /// Forgets what the process remembers (it goes to another list), in a reaction. Nothing in other scripts.
    Forget,
    /// Serves what the `Execute`s before it reported; the rest of this script acts only if that moved the process nowhere, and it
    /// is in this generation and not frozen: what a fault of the executed blocks ended is not started after all. The script is
    /// acknowledged as always.
    While { process: Arc<Process>, generation: u32 },
    /// Running time of the process in this source: starts at 0.
    StartClock(Arc<Process>),
    /// Stops the running time of the process.
    StopClock(Arc<Process>),
    /// Lets the running time of the process go on.
    ResumeClock(Arc<Process>),
    /// The running time of the first process in this source is that of the second.
    KeepClock(Arc<Process>, Arc<Process>),
    /// Copies cells into the acknowledgement (ω, a read of SVVs): all of one boundary.
    Capture(Vec<Cell>),
    /// Claims write channels of a device: what their cells hold goes out at the end of the firing.
    Engage { device: Arc<Device>, channels: Vec<u16> },
    /// Write channels of a device go to their safe values at once (exempt from the slew limit), and are free.
    Safe { device: Arc<Device>, channels: Vec<u16> },
    /// Goes on where sources that have ended stopped. Stays where it was made: no parcel carries it. No reaction has it.
    Inherit(Box<dyn Inheritance>),
    /// Looks at the last reading of the device for what its channels ask, so that a request made since is known without a firing.
    Look(Arc<Device>),
    /// A lost device is opened again. What it had goes back with the acknowledgement.
    Renew(Box<dyn Reopening>),
}

impl Op {
    /// Returns true if it changes what a source has, beyond what blocks and devices hold: only a script that is submitted may, never a reaction.
    pub fn swaps(&self) -> bool {
        matches!(self, Op::Table(_) | Op::Follow { .. } | Op::Inherit(_))
    }
}

/// State that a source takes over from sources that have ended, prepared off the real-time path.
pub trait Inheritance: Send + Sync {
    /// Goes on where those before stopped.
    ///
    /// # Safety
    /// Called by the kernel of `source` alone, between two firings, when the sources before have ended.
    unsafe fn carry_out(&mut self, source: SourceId);
}

/// Another driver for a device, prepared off the real-time path.
pub trait Reopening: Send + Sync {
    /// Returns the device.
    fn device(&self) -> &Arc<Device>;

    /// Returns true if the device is no longer lost after it has been carried out.
    fn is_open(&self) -> bool;

    /// Puts the driver in the place of the one that the device has.
    ///
    /// # Safety
    /// Called by the kernel of the device's source alone, or where it has none.
    unsafe fn carry_out(&self);
}

/// Operations carried out in order between two firings of one source, as one.
pub struct Script {
    /// Number for the acknowledgement.
    pub id: u64,
    /// Operations, in order.
    pub ops: Vec<Op>,
}

impl std::fmt::Debug for Script {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Script {{ id: {}, {} ops }}", self.id, self.ops.len())
    }
}

impl Script {
    /// Returns the script that a process keeps as a prepared answer.
    pub fn of(reaction: &dyn Reaction) -> &Script {
        (reaction as &dyn Any).downcast_ref().expect("nothing else is a reaction")
    }

    /// Bytes that its captures take.
    pub fn captured_len(&self) -> usize {
        self.ops.iter().map(|op| if let Op::Capture(cells) = op { cells.iter().map(Cell::len).sum() } else { 0 }).sum()
    }
}

impl Reaction for Script {
    fn captured_len(&self) -> usize {
        Script::captured_len(self)
    }

    fn swaps(&self) -> bool {
        self.ops.iter().any(Op::swaps)
    }
}

impl Activation {
    /// Returns the operation that makes it due by `due`: others drive it. State, numbers and phase stay. It goes to its source in
    /// one script with a table that was built after this call. Not for the real-time path.
    pub fn follow(self: &Arc<Self>, due: Due) -> Op {
        self.plan(&due);
        Op::Follow { activation: self.clone(), had: due.had(), due: Box::new(due) }
    }
}

/// A script under way: to a source, and, carried out, back. The box is the place of its own acknowledgement, so that none can
/// be lost and none is allocated on the real-time path.
pub struct Submission {
    pub script: Box<Script>,
    /// Captured values, with room for all.
    pub(crate) captured: Vec<u8>,
    pub firing: u64,
    pub(crate) time_ns: i64,
    /// Order among the events of the host.
    pub(crate) serial: u64,
    /// Its number in a record of the host; 0 where none is made.
    pub recorded: u64,
    next: *mut Submission,
}

// SAFETY: `next` is used only by the stack that the submission is in.
unsafe impl Send for Submission {}

impl Submission {
    pub fn new(script: Box<Script>) -> Box<Submission> {
        let captured = Vec::with_capacity(script.captured_len());
        Box::new(Submission { script, captured, firing: 0, time_ns: 0, serial: 0, recorded: 0, next: ptr::null_mut() })
    }
}

/// Submissions under way: any number put, one takes all of them at once.
///
/// | | who puts | who takes |
/// |---|---|---|
/// | may block the other | never; a put retries only when another put or a take came between | never; one swap |
#[derive(Default)]
pub struct Mailbox(AtomicPtr<Submission>);

impl Mailbox {
    pub fn put(&self, submission: Box<Submission>) {
        let submission = Box::into_raw(submission);
        let mut head = self.0.load(Ordering::Relaxed);
        loop {
            // SAFETY: it is ours until it is in.
            unsafe { (*submission).next = head };
            match self.0.compare_exchange_weak(head, submission, Ordering::SeqCst, Ordering::Relaxed) {
                Ok(_) => return,
                Err(now) => head = now,
            }
        }
    }

    #[inline]
    pub fn is_empty(&self) -> bool {
        self.0.load(Ordering::Acquire).is_null()
    }

    /// Returns everything that was put, oldest first.
    pub fn take(&self) -> Submissions {
        let mut newest = self.0.swap(ptr::null_mut(), Ordering::SeqCst);
        let mut oldest = ptr::null_mut();
        while !newest.is_null() {
            // SAFETY: the swap made the whole list ours.
            let next = std::mem::replace(unsafe { &mut (*newest).next }, oldest);
            oldest = newest;
            newest = next;
        }
        Submissions(oldest)
    }
}

impl Drop for Mailbox {
    fn drop(&mut self) {
        drop(self.take());
    }
}

/// Submissions that were taken, oldest first.
pub struct Submissions(*mut Submission);

impl Iterator for Submissions {
    type Item = Box<Submission>;

    fn next(&mut self) -> Option<Box<Submission>> {
        if self.0.is_null() {
            return None;
        }
        // SAFETY: the list is ours, each member was a box.
        let mut first = unsafe { Box::from_raw(self.0) };
        self.0 = std::mem::replace(&mut first.next, ptr::null_mut());
        Some(first)
    }
}

impl Drop for Submissions {
    fn drop(&mut self) {
        self.for_each(drop);
    }
}
