// SPDX-License-Identifier: Apache-2.0
//! Replay of a record: a host under the virtual clock whose sources repeat what was recorded, segment by segment.
use crate::host::Host;
use crate::trace::TapedReceiver;
use crate::trace::tape::{SourceTape, Stretch};
use interconnect::{Full, Receiver, Sender};
use kernel::clock::monotonic_ns;
use kernel::containment::prepare_thread;
use kernel::preempt::Never;
use kernel::script::Submission;
use kernel::state::Kernel;
use kernel::tape::Occasion;
use kernel::{Block, Cell, Nowhere, Script, SourceId, Way};
use opengpac::abi;
use std::ffi::CStr;

/// Result of a replayed segment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlayedSegment {
    /// Digest of all values that the source's blocks had stored at the end of the segment.
    pub digest: u64,
    /// True if a fault stopped the source in the segment.
    pub stopped: bool,
    /// Difference between the queries of the source and the record, if the replay diverged.
    pub differs: Option<String>,
}

/// An output of a block, or a device channel that it writes, with the stored value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// Label of the block, including its instance.
    pub block: String,
    /// Name of the port.
    pub port: String,
    /// C type of the port.
    pub type_text: String,
    /// Stored bytes.
    pub bytes: Vec<u8>,
}

impl Host {
    /// Returns the reading end of a recorded connection, for a source of this host; the end delivers the recorded values.
    pub fn played(&self, way: &Way) -> Box<dyn Receiver> {
        // A damaged record may name a source that it has not made.
        match self.tape(SourceId(way.spec.reader)) {
            Some(tape) => Box::new(TapedReceiver::playing(&way.spec, tape)),
            None => Box::new(Nowhere::of(&way.spec)),
        }
    }

    /// Returns the writing end of a recorded connection, whose reader receives the recorded values.
    pub fn played_sender(&self, way: &Way) -> Box<dyn Sender> {
        Box::new(Unread(vec![0; way.spec.asynchronous_len], vec![0; way.spec.queue_row_len]))
    }

    /// Replays a segment of `source`. `script`: the script carried out in it. May be called only on a host created by [`Host::playing`].
    pub fn play(&self, source: SourceId, stretch: &Stretch, script: Option<Box<Script>>) -> PlayedSegment {
        self.set_now(stretch.time_ns);
        let script = script.map(|mut script| {
            self.prepare(source, &mut script);
            script
        });
        prepare_thread();
        let tape = self.tape(source);
        self.with_kernel(source, |kernel| play(kernel, tape.as_deref(), stretch, script))
    }

    /// Returns true if a block in the table of `source` stores to `cell`.
    pub fn stores(&self, source: SourceId, cell: &Cell) -> bool {
        self.with_kernel(source, |kernel| kernel.table.steps.iter().filter_map(|step| step.block.as_ref()).any(|block| block.writes(cell)))
    }

    /// Returns the values stored by the blocks of `source`, in the order in which a firing runs the blocks.
    pub fn stored(&self, source: SourceId) -> Vec<Change> {
        self.with_kernel(source, |kernel| kernel.table.steps.iter().filter_map(|step| step.block.as_ref()).flat_map(|block| stored(block)).collect())
    }
}

/// Writing end whose values are discarded, because its reader is fed from the record.
struct Unread(Vec<u8>, Vec<u8>);

impl Sender for Unread {
    fn group(&mut self) -> &mut [u8] {
        &mut self.0
    }

    fn publish(&mut self, _number: u64, _now_ns: i64) {}

    fn push(&mut self, _number: u64, _now_ns: i64, fill: &mut dyn FnMut(&mut [u8])) -> Result<(), Full> {
        fill(&mut self.1);
        Ok(())
    }

    fn arrived(&self) -> bool {
        false
    }
}

/// Runs the segment `stretch`, with the script to which it refers.
fn play(kernel: &mut Kernel, tape: Option<&SourceTape>, stretch: &Stretch, script: Option<Box<Script>>) -> PlayedSegment {
    let Some(tape) = tape else {
        return PlayedSegment { digest: 0, stopped: false, differs: Some("this host does not play".to_owned()) };
    };
    tape.load(&stretch.answers);
    match (stretch.occasion, script) {
        (Occasion::Firing, _) => kernel.fire(stretch.number, stretch.time_ns, monotonic_ns(), &Never),
        (Occasion::Script(_), Some(script)) => {
            kernel.firing = stretch.number;
            kernel.carry_out(Submission::new(script), stretch.time_ns);
        }
        (Occasion::Script(number), None) => {
            return PlayedSegment { digest: 0, stopped: false, differs: Some(format!("the record does not contain script {number}")) };
        }
        (Occasion::Restart, _) => kernel.restart(),
    }
    PlayedSegment { digest: kernel.digest(), stopped: kernel.stopped, differs: tape.differs() }
}

/// Returns the values of the outputs and device channels of a block.
fn stored(block: &Block) -> impl Iterator<Item = Change> {
    let change = |(item, cell): (&abi::Item, &Cell)| Change {
        block: block.name().to_owned(),
        port: text(item.name),
        type_text: text(item.type_text),
        bytes: cell.load(),
    };
    block.stores().map(change)
}

fn text(of: *const std::ffi::c_char) -> String {
    if of.is_null() {
        return String::new();
    }
    // SAFETY: a descriptor's texts end in NUL and live as long as its module, which the block holds.
    unsafe { CStr::from_ptr(of) }.to_string_lossy().into_owned()
}
