// SPDX-License-Identifier: Apache-2.0
//! Scripts: changes between two firings of a source, prepared off the real-time path.
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
    /// Swaps the table. The old one is returned with the acknowledgement, and the supervisor frees it. After the swap, every new outbound
    /// connection publishes its current values, and every new inbound one is latched. Not allowed in reactions.
    Table(Box<Table>),
    /// Stores bytes (ψ values, writes from the PS, safe values).
    Store(Cell, Box<[u8]>),
    /// Appends the current value of a cell to a window of its most recent values, because values stored by scripts count too.
    Append { value: Cell, window: Window },
    /// Sets every value of the window to the current value of the cell.
    Fill { value: Cell, window: Window },
    /// Copies one cell to another (`initial="sensed"`).
    Copy(Cell, Cell),
    /// Restores the initial state: the block's image as installed, except for states declared `keep` and for parameters, presets and
    /// sizes, which keep the values last stored. The invocation number becomes 0.
    Reset(Arc<Block>),
    /// Makes the first block take over the states, outputs and invocation number of the second, which runs the same code. Follows a
    /// reset.
    Keep(Arc<Block>, Arc<Block>),
    /// Switches an activation on, due at firings that are multiples of `every` (1 for a driven one). Does nothing if it is already on
    /// with the same `every`: its instances, state and phase are kept.
    On(Arc<Activation>, u32),
    /// Changes the drivers of an activation; created by [`Activation::follow`]. The previous rule is returned with the acknowledgement.
    /// Not allowed in reactions.
    Follow { activation: Arc<Activation>, due: Box<Due>, had: Box<[u64]> },
    /// Sets the activation's interval to `every` firings, overriding `On`. Takes effect immediately if the activation is on: it is next
    /// due at the first multiple after the last firing, so that no invocation is lost or doubled. 0 restores the interval of `On`, with
    /// effect from the next `On`.
    Tune(Arc<Activation>, u32),
    /// Switches the activation off.
    Off(Arc<Activation>),
    /// `execute`: runs one extra firing immediately, in which exactly these blocks and the active blocks that they drive are due.
    Execute(Vec<Arc<Block>>),
    /// Sets the stage of the process in generation `generation` (`None`: the current one; used by local reactions). Conditions that were
    /// reported but not served and that the stage awaits act immediately. Has no effect for a generation that has passed or is already
    /// under way, because several sources may receive the script.
    Stage { process: Arc<Process>, stage: u16, generation: Option<u32> },
    /// Advances from stage `from` to stage `to` of the same list, if the process acts in `generation` and is in `from`: a wait is reached
    /// when all commands before it have been carried out. Conditions that were reported but not served act immediately.
    Advance { process: Arc<Process>, generation: u32, from: u16, to: u16 },
    /// Forgets the remembered conditions of the process, because it moves to another list. Used in reactions; does nothing in other
    /// scripts.
    Forget,
    /// Serves the conditions that the preceding `Execute`s reported. The rest of this script takes effect only if these conditions did
    /// not move the process, and the process is in this generation and not frozen. A fault of the executed blocks thus prevents the start
    /// that follows. The script is acknowledged in any case.
    While { process: Arc<Process>, generation: u32 },
    /// Starts the running time of the process in this source at 0.
    StartClock(Arc<Process>),
    /// Pauses the running time of the process.
    StopClock(Arc<Process>),
    /// Resumes the running time of the process.
    ResumeClock(Arc<Process>),
    /// Makes the running time of the first process in this source continue that of the second.
    KeepClock(Arc<Process>, Arc<Process>),
    /// Copies cells into the acknowledgement (ω, a read of SVVs), all at the same boundary.
    Capture(Vec<Cell>),
    /// Claims write channels of a device: the values in their cells are written at the end of the firing.
    Engage { device: Arc<Device>, channels: Vec<u16> },
    /// Writes the safe values of write channels of a device immediately (exempt from the slew limit), and frees the channels.
    Safe { device: Arc<Device>, channels: Vec<u16> },
    /// Resumes from the state in which ended sources stopped. Local only: never sent in a parcel. Not allowed in reactions.
    Inherit(Box<dyn Inheritance>),
    /// Checks the latest reading of the device for requests of its channels, so that a new request is detected without a firing.
    Look(Arc<Device>),
    /// Reopens a lost device. Its previous driver is returned with the acknowledgement.
    Renew(Box<dyn Reopening>),
}

impl Op {
    /// Returns true if the operation changes the structure of a source, rather than only the contents of blocks and devices. Allowed in
    /// submitted scripts, never in reactions.
    pub fn swaps(&self) -> bool {
        matches!(self, Op::Table(_) | Op::Follow { .. } | Op::Inherit(_))
    }
}

/// State that a source takes over from ended sources, prepared off the real-time path.
pub trait Inheritance: Send + Sync {
    /// Resumes from the state in which the ended sources stopped.
    ///
    /// # Safety
    /// Must be called only by the kernel of `source`, between two firings, after the previous sources have ended.
    unsafe fn carry_out(&mut self, source: SourceId);
}

/// Another driver for a device, prepared off the real-time path.
pub trait Reopening: Send + Sync {
    /// Returns the device.
    fn device(&self) -> &Arc<Device>;

    /// Returns true if the device is no longer lost after `carry_out`.
    fn is_open(&self) -> bool;

    /// Replaces the driver of the device.
    ///
    /// # Safety
    /// Must be called only by the kernel of the device's source, or while the device has no source.
    unsafe fn carry_out(&self);
}

/// Operations carried out in order and atomically, between two firings of one source.
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
    /// Returns the script of a prepared reaction kept by a process.
    pub fn of(reaction: &dyn Reaction) -> &Script {
        (reaction as &dyn Any).downcast_ref().expect("nothing else is a reaction")
    }

    /// Returns the number of bytes that the script captures.
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
    /// Returns the operation that makes the activation due according to `due`, driven by other activations. State, numbers and phase are
    /// kept. Submit it in the same script as a table that was built after this call. Not for the real-time path.
    pub fn follow(self: &Arc<Self>, due: Due) -> Op {
        self.plan(&due);
        Op::Follow { activation: self.clone(), had: due.had(), due: Box::new(due) }
    }
}

/// A script in transit to a source and, after execution, back. The box also stores its own acknowledgement, so that no acknowledgement
/// can be lost and none is allocated on the real-time path.
pub struct Submission {
    pub script: Box<Script>,
    /// Captured values, with capacity for all of them.
    pub(crate) captured: Vec<u8>,
    pub firing: u64,
    pub(crate) time_ns: i64,
    /// Serial number of the acknowledgement among the events of the host.
    pub(crate) serial: u64,
    /// Number of the submission in a record of the host; 0 if the host is not being recorded.
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

/// Queue of submissions with any number of producers and one consumer, which takes all of them at once.
///
/// | | producer | consumer |
/// |---|---|---|
/// | may block the other | never; a put retries only if another put or a take intervened | never; one swap |
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

    /// Takes all submissions and returns them oldest first.
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
