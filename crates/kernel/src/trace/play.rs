// SPDX-License-Identifier: Apache-2.0
//! Running a record again: a host under the virtual clock whose sources do what is recorded of them, stretch by stretch.
use crate::tape::{Occasion, Stretch};
use crate::trace::Taped;
use crate::{Block, Host, Script, SourceId, Way};
use interconnect::{Full, Receiver, Sender};
use opengpac::abi;
use std::ffi::CStr;

/// How a stretch went the second time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Played {
    /// Digest of everything that the source's blocks had stored when it was over.
    pub digest: u64,
    /// A fault stopped the source in it.
    pub stopped: bool,
    /// What the source asked for and the record has not, or the other way round: it went another way.
    pub differs: Option<String>,
}

/// An output of a block, or a device channel that it writes, with what it holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// Label of the block, with its instance.
    pub block: String,
    /// Name of the port.
    pub port: String,
    /// Its C type.
    pub type_text: String,
    /// What is stored.
    pub bytes: Vec<u8>,
}

impl Host {
    /// The reading end, of a source of this host, of a connection that the record has: it gives what is recorded.
    pub fn played(&self, way: &Way) -> Box<dyn Receiver> {
        match self.source(SourceId(way.spec.reader)).tape.clone() {
            Some(tape) => Box::new(Taped::playing(&way.spec, tape)),
            None => Box::new(crate::far::Nowhere::of(&way.spec)),
        }
    }

    /// The writing end of a connection that the record has: whoever reads it gets what is recorded.
    pub fn played_sender(&self, way: &Way) -> Box<dyn Sender> {
        Box::new(Unread(vec![0; way.spec.asynchronous_len], vec![0; way.spec.queue_row_len]))
    }

    /// Does again what a stretch of `source` says. `script`: the one that it carries out. Of a host that plays ([`Host::playing`]).
    pub fn play(&self, source: SourceId, stretch: &Stretch, script: Option<Box<Script>>) -> Played {
        self.set_now(stretch.time_ns);
        let script = script.map(|mut script| {
            self.prepare(source, &mut script);
            script
        });
        crate::guard::prepare_thread();
        self.with_kernel(source, |kernel| kernel.play(stretch, script))
    }

    /// True where a block in the table of `source` stores to `cell`.
    pub fn stores(&self, source: SourceId, cell: &crate::Cell) -> bool {
        self.with_kernel(source, |kernel| kernel.table.steps.iter().filter_map(|step| step.block.as_ref()).any(|block| block.writes(cell)))
    }

    /// What the blocks of `source` have stored, in the order of a firing.
    pub fn stored(&self, source: SourceId) -> Vec<Change> {
        self.with_kernel(source, |kernel| kernel.table.steps.iter().filter_map(|step| step.block.as_ref()).flat_map(|block| block.stored()).collect())
    }
}

/// A writing end whose reader has the record.
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

impl crate::firing::Kernel {
    fn play(&mut self, stretch: &Stretch, script: Option<Box<Script>>) -> Played {
        let Some(tape) = self.source.tape.clone() else {
            return Played { digest: 0, stopped: false, differs: Some("this host does not play".to_owned()) };
        };
        tape.load(&stretch.answers);
        match (stretch.occasion, script) {
            (Occasion::Firing, _) => self.fire(stretch.number, stretch.time_ns, crate::clock::monotonic_ns(), &crate::preempt::Never),
            (Occasion::Script(_), Some(script)) => {
                self.firing = stretch.number;
                self.carry_out(crate::script::Submission::new(script), stretch.time_ns);
            }
            (Occasion::Script(number), None) => {
                return Played { digest: 0, stopped: false, differs: Some(format!("the record does not have script {number}")) };
            }
            (Occasion::Restart, _) => self.restart(),
        }
        Played { digest: self.digest(), stopped: self.stopped, differs: tape.differs() }
    }
}

impl Block {
    /// What its outputs and device channels hold.
    fn stored(&self) -> Vec<Change> {
        let change = |(item, cell): (&abi::Item, &crate::Cell)| Change {
            block: self.name().to_owned(),
            port: text(item.name),
            type_text: text(item.type_text),
            bytes: cell.load(),
        };
        self.stores().map(change).collect()
    }
}

fn text(of: *const std::ffi::c_char) -> String {
    if of.is_null() {
        return String::new();
    }
    // SAFETY: a descriptor's texts end in NUL and live as long as its module, which the block holds.
    unsafe { CStr::from_ptr(of) }.to_string_lossy().into_owned()
}
