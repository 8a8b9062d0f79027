// SPDX-License-Identifier: Apache-2.0
//! Access to the memory of a connection by one of its ends. Locks on bytes 0 and 1 of the memory represent the claims of the writing and
//! the reading end.
//!
//! The first end creates the memory; each living end offers it under its name in the run's folder (`offer`), so that it exists as long as
//! either end does. After an end was killed, its successor joins the living end and takes over the buffer of its predecessor: the one
//! that is neither in the middle nor the living end's. The living end declares its own buffer after each exchange; between exchange and
//! declaration, both words contain the same index, so a newcomer sees that it must retry. The word of a dead end is never trusted.
use crate::fate::Fate;
use crate::folder::Folder;
use crate::layout::{self, Layout, MADE};
use crate::locks;
use crate::offer::{Offer, is_left, offered, remove_left};
use crate::sealed::{LINE, SealedMemory};
use interconnect::triple::{BACK_AT_FIRST, FRONT_AT_FIRST, MIDDLE_AT_FIRST, in_the_middle};
use interconnect::{ConnectionSpec, EndError, TripleMemory};
use std::io;
use std::os::fd::{AsFd, OwnedFd};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::{Duration, Instant};

/// End of a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Role {
    Writing,
    Reading,
}

impl Role {
    /// Returns the byte of the memory whose lock claims this end.
    fn byte(self) -> u64 {
        self as u64
    }

    /// Returns the name of this end of a connection in the folder.
    fn file(self, number: u64) -> String {
        format!("c{number}-{}", self.name())
    }

    fn other(self) -> Role {
        if self == Role::Writing { Role::Reading } else { Role::Writing }
    }

    fn name(self) -> &'static str {
        if self == Role::Writing { "writing" } else { "reading" }
    }
}

/// Maximum time for which a newcomer retries. An exchange takes nanoseconds, unless its thread was stopped in the middle of it.
const LOOK_MAX: Duration = Duration::from_secs(1);

/// Claim of one end of a connection; dropping it releases the end.
pub(crate) struct Connection {
    pub layout: Layout,
    /// Index of the buffer that this end holds.
    pub index: u8,
    /// Loss state of the connection, with the cause.
    pub fate: Arc<Fate>,
    role: Role,
    number: u64,
    /// Offer of the memory; `None` after it has been withdrawn.
    offer: Option<Offer>,
    /// Folder of the run, which exists until the last end has left it.
    folder: Arc<Folder>,
}

impl Connection {
    /// Claims an end of connection `number`, and creates its memory if the other end does not exist.
    pub fn enter(folder: &Arc<Folder>, role: Role, number: u64, spec: &ConnectionSpec) -> Result<Self, EndError> {
        Connection::entered(folder, role, number, spec).map_err(|why| EndError {
            message: format!(
                "cannot create the {} end of connection {number} (source {} to source {}) in shared memory: {}",
                role.name(),
                spec.writer,
                spec.reader,
                why.text(role, layout::len_of(spec)),
            ),
        })
    }

    /// Removes the names of ends whose processes were killed, because their successors may have other numbers.
    pub fn sweep(folder: &Folder) {
        for path in folder.files().filter(|path| is_left(path)) {
            let Some(number) = number_of(&path) else { continue };
            // A process that joins this connection at the moment replaces the name itself.
            let Ok(_alone) = folder.alone(number) else { continue };
            remove_left(&path);
        }
    }

    fn entered(folder: &Arc<Folder>, role: Role, number: u64, spec: &ConnectionSpec) -> Result<Self, Failure> {
        let _alone = folder.alone(number)?;
        let (own, others) = (folder.file(&role.file(number)), folder.file(&role.other().file(number)));
        let key = [folder.run(), number];
        if let Some(present) = Present::find(&own, key)?
            && locks::is_claimed(&present.memory, role.byte())?
        {
            return Err(Failure::Taken);
        }
        let joined = match Present::find(&others, key)? {
            Some(present) if locks::is_claimed(&present.memory, role.other().byte())? => present.join(role, number, spec)?,
            _ => None,
        };
        let (layout, fate, index) = joined.map_or_else(|| make(role, key, spec), Ok)?;
        let offer = Some(Offer::new(own, layout.memory().as_fd())?);
        Ok(Connection { layout, index, fate, role, number, offer, folder: folder.clone() })
    }
}

/// Returns the connection to which a name in the folder belongs.
fn number_of(path: &Path) -> Option<u64> {
    let (number, _) = path.file_name()?.to_str()?.strip_prefix('c')?.split_once('-')?;
    number.parse().ok()
}

impl Drop for Connection {
    fn drop(&mut self) {
        // If others cannot be excluded, a process that joins now may find the end taken, which does no harm.
        let _alone = self.folder.alone(self.number);
        // It cannot fail for memory that was claimed before.
        let _given = locks::give_back(self.layout.memory(), self.role.byte());
        self.offer = None;
    }
}

/// Reason why an end could not be created.
enum Failure {
    System(io::Error),
    Taken,
    OtherLengths([u64; 3], [u64; 3]),
    Stopped,
    /// The memory offered by this process contains words that no end would write.
    Spoilt(u32),
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        Failure::System(error)
    }
}

impl Failure {
    fn text(&self, role: Role, len: usize) -> String {
        match self {
            Failure::System(error) if matches!(error.raw_os_error(), Some(libc::ENOSPC | libc::ENOMEM)) => {
                format!("not enough memory for {len} bytes; close other programs")
            }
            Failure::System(error) => error.to_string(),
            Failure::Taken => format!("its {} end already exists; drop that one first", role.name()),
            Failure::OtherLengths(ours, theirs) => {
                let lengths = |[group, row, depth]: &[u64; 3]| format!("a group of {group} bytes and {depth} rows of {row}");
                format!("the {} end was created for {}, but this one is for {}; create both for the same", role.other().name(), lengths(theirs), lengths(ours))
            }
            Failure::Stopped => format!("the thread of the {} end is stopped inside a publication; resume or end it first", role.other().name()),
            Failure::Spoilt(process) => {
                let other = role.other().name();
                format!(
                    "the memory that process {process} offers for the {other} end was overwritten; find the process at fault and end it, then reset its processor"
                )
            }
        }
    }
}

/// Memory offered by an end.
struct Present {
    memory: OwnedFd,
    process: u32,
}

impl Present {
    /// Returns the memory offered under a path for this run and connection; `None` if there is none, or if the descriptor has been reused
    /// for something else.
    fn find(path: &std::path::Path, [run, number]: [u64; 2]) -> Result<Option<Present>, Failure> {
        let Some((memory, process)) = offered(path)? else { return Ok(None) };
        let by = |error: io::Error| Failure::System(io::Error::new(error.kind(), format!("{error} (process {process} offers it)")));
        let first = SealedMemory::beginning(memory.try_clone()?, LINE).map_err(by)?;
        let made = Layout::made_in(&first);
        let is_it = made.mark.load(Ordering::Acquire) == MADE && made.run.load(Ordering::Relaxed) == run && made.number.load(Ordering::Relaxed) == number;
        Ok(is_it.then_some(Present { memory, process }))
    }

    /// Joins the connection offered by a live end; returns `None` if that end has died in the meantime.
    fn join(self, role: Role, number: u64, spec: &ConnectionSpec) -> Result<Option<(Layout, Arc<Fate>, u8)>, Failure> {
        let Present { memory, process } = self;
        let first = SealedMemory::beginning(memory.try_clone()?, LINE)?;
        let (ours, theirs) = (lengths(spec), Layout::made_in(&first).lengths());
        if theirs != ours {
            return Err(Failure::OtherLengths(ours, theirs));
        }
        let memory = SealedMemory::received(memory, layout::len_of(spec)).map_err(|_| Failure::Spoilt(process))?;
        if !locks::claim(&memory, role.byte())? {
            return Err(Failure::Taken);
        }
        let fate = Arc::new(Fate::new(number, spec, Some(process)));
        let layout = Layout::new(Arc::new(memory), fate.clone(), spec);
        let Some(index) = left_over(&layout, role, process)? else { return Ok(None) };
        let word = if role == Role::Writing { layout.back() } else { layout.front() };
        word.store(index, Ordering::Release);
        Ok(Some((layout, fate, index)))
    }
}

fn lengths(spec: &ConnectionSpec) -> [u64; 3] {
    [spec.asynchronous_len, spec.queue_row_len, spec.queue_depth].map(|len| len as u64)
}

/// Creates new memory, with all words initialised for a new connection.
fn make(role: Role, [run, number]: [u64; 2], spec: &ConnectionSpec) -> Result<(Layout, Arc<Fate>, u8), Failure> {
    let memory = SealedMemory::new(layout::len_of(spec))?;
    if !locks::claim(&memory, role.byte())? {
        return Err(Failure::Taken);
    }
    let fate = Arc::new(Fate::new(number, spec, None));
    let layout = Layout::new(Arc::new(memory), fate.clone(), spec);
    layout.middle().store(MIDDLE_AT_FIRST, Ordering::Relaxed);
    layout.back().store(BACK_AT_FIRST, Ordering::Relaxed);
    layout.front().store(FRONT_AT_FIRST, Ordering::Relaxed);
    layout.made().set(run, number, lengths(spec));
    Ok((layout, fate, if role == Role::Writing { BACK_AT_FIRST } else { FRONT_AT_FIRST }))
}

/// Returns the buffer that is neither in the middle nor the other end's; `None` if the other end has died in the meantime.
fn left_over(layout: &Layout, role: Role, process: u32) -> Result<Option<u8>, Failure> {
    let theirs: &AtomicU8 = if role == Role::Writing { layout.front() } else { layout.back() };
    let since = Instant::now();
    loop {
        let held = theirs.load(Ordering::Acquire);
        let middle = in_the_middle(layout.middle().load(Ordering::Acquire));
        if held > FRONT_AT_FIRST || middle > FRONT_AT_FIRST {
            return Err(Failure::Spoilt(process));
        }
        if held != middle {
            return Ok(Some(BACK_AT_FIRST + MIDDLE_AT_FIRST + FRONT_AT_FIRST - held - middle));
        }
        if !locks::is_claimed(layout.memory(), role.other().byte())? {
            return Ok(None);
        }
        if since.elapsed() > LOOK_MAX {
            return Err(Failure::Stopped);
        }
        std::thread::yield_now();
    }
}
