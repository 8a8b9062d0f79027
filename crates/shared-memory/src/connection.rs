// SPDX-License-Identifier: Apache-2.0
//! An end of a connection comes to its memory: a file of the run's folder, whose byte 0 the writing end has claimed and byte 1 the reading one.
//!
//! The first end makes the memory, the last one removes the file. An end that comes to one that lives, after an end of its own kind was killed, takes over what
//! that one held: the buffer that is neither in the middle nor the living end's. The living end says which is its own after
//! each exchange; between the exchange and the saying both words name the same buffer, so that a newcomer sees that it has to
//! look again. A dead end's word is never believed.
use crate::folder::{self, Folder};
use crate::layout::{self, Layout, MADE};
use crate::locks::{self, Whole};
use crate::mapping::Mapping;
use interconnect::triple::{BACK_AT_FIRST, FRONT_AT_FIRST, MIDDLE_AT_FIRST, in_the_middle};
use interconnect::{ConnectionSpec, EndError, TripleMemory};
use std::fs::{self, File};
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::{Duration, Instant};

/// Which end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Role {
    Writing,
    Reading,
}

impl Role {
    /// The byte of the file that says that there is one.
    fn byte(self) -> u32 {
        self as u32
    }

    fn other(self) -> Role {
        if self == Role::Writing { Role::Reading } else { Role::Writing }
    }

    fn name(self) -> &'static str {
        if self == Role::Writing { "writing" } else { "reading" }
    }
}

/// How long a newcomer looks again: an exchange takes nanoseconds, unless its thread was stopped in it.
const LOOK_MAX: Duration = Duration::from_secs(1);

/// A claim of one end of a connection. Dropped, it gives the end free for another.
pub(crate) struct Connection {
    pub layout: Layout,
    /// The buffer that this end has.
    pub index: u8,
    role: Role,
    file: File,
    path: PathBuf,
    /// The folder stays until the last end has left it.
    _folder: Arc<Folder>,
}

impl Connection {
    /// Claims an end of connection `number`, and makes its memory where no other end lives.
    pub fn enter(folder: &Arc<Folder>, role: Role, number: u64, spec: &ConnectionSpec) -> Result<Self, EndError> {
        let failed = |why: Failure| EndError {
            message: format!(
                "cannot make the {} end of connection {number} (source {} to source {}) in shared memory: {}",
                role.name(),
                spec.writer,
                spec.reader,
                why.text(role, layout::len_of(spec)),
            ),
        };
        let path = folder.file(&format!("c{number}"));
        let file = open_alone(&path).map_err(|error| failed(error.into()))?;
        let (layout, index) = claim(&file, role, spec).map_err(failed)?;
        locks::unlock(&file).map_err(|error| failed(error.into()))?;
        Ok(Connection { layout, index, role, file, path, _folder: folder.clone() })
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        let last = || -> io::Result<bool> {
            locks::lock(&self.file, Whole::Alone)?;
            locks::give_back(&self.file, self.role.byte())?;
            Ok(!locks::is_claimed(&self.file, self.role.byte())? && !locks::is_claimed(&self.file, self.role.other().byte())?)
        };
        // Where a lock cannot be had the file stays until the folder goes.
        if last().unwrap_or(false) {
            fs::remove_file(&self.path).ok();
        }
    }
}

/// Why an end could not be made.
enum Failure {
    System(io::Error),
    Taken,
    OtherLengths([u64; 3], [u64; 3]),
    Stopped,
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        Failure::System(error)
    }
}

impl Failure {
    fn text(&self, role: Role, len: usize) -> String {
        match self {
            Failure::System(error) if error.raw_os_error() == Some(libc::ENOSPC) => format!("no room for {len} bytes in /dev/shm; make it larger"),
            Failure::System(error) => format!("{error}; see who may read and write /dev/shm"),
            Failure::Taken => format!("it has a {} end that lives; drop that one first", role.name()),
            Failure::OtherLengths(ours, theirs) => {
                let lengths = |[group, row, depth]: &[u64; 3]| format!("a group of {group} bytes and {depth} rows of {row}");
                format!("the {} end was made for {}, this one is for {}; make both for the same", role.other().name(), lengths(theirs), lengths(ours))
            }
            Failure::Stopped => format!("the thread of the {} end is stopped inside a publication; resume or end it first", role.other().name()),
        }
    }
}

/// Opens the file and locks it, so that one end comes or goes at a time.
fn open_alone(path: &std::path::Path) -> io::Result<File> {
    loop {
        let file = folder::open(path)?;
        locks::lock(&file, Whole::Alone)?;
        // Else the last end has removed it since.
        if folder::is_at(&file, path) {
            return Ok(file);
        }
    }
}

fn claim(file: &File, role: Role, spec: &ConnectionSpec) -> Result<(Layout, u8), Failure> {
    if !locks::claim(file, role.byte())? {
        return Err(Failure::Taken);
    }
    let ours = [spec.asynchronous_len, spec.queue_row_len, spec.queue_depth].map(|len| len as u64);
    loop {
        if !locks::is_claimed(file, role.other().byte())? {
            // What dead ends left may have any length.
            file.set_len(0)?;
            let layout = Layout::new(Arc::new(Mapping::new(file, layout::len_of(spec))?), spec);
            make(&layout, ours);
            return Ok((layout, if role == Role::Writing { BACK_AT_FIRST } else { FRONT_AT_FIRST }));
        }
        let theirs = lengths_in(file)?;
        if theirs != ours {
            return Err(Failure::OtherLengths(ours, theirs));
        }
        let layout = Layout::new(Arc::new(Mapping::new(file, layout::len_of(spec))?), spec);
        if let Some(index) = left_over(&layout, file, role)? {
            let word = if role == Role::Writing { layout.back() } else { layout.front() };
            word.store(index, Ordering::Release);
            return Ok((layout, index));
        }
    }
}

/// Puts all words where a connection begins.
fn make(layout: &Layout, [asynchronous_len, queue_row_len, queue_depth]: [u64; 3]) {
    layout.clear();
    layout.middle().store(MIDDLE_AT_FIRST, Ordering::Relaxed);
    layout.back().store(BACK_AT_FIRST, Ordering::Relaxed);
    layout.front().store(FRONT_AT_FIRST, Ordering::Relaxed);
    let made = layout.made();
    made.asynchronous_len.store(asynchronous_len, Ordering::Relaxed);
    made.queue_row_len.store(queue_row_len, Ordering::Relaxed);
    made.queue_depth.store(queue_depth, Ordering::Relaxed);
    made.mark.store(MADE, Ordering::Release);
}

/// For which lengths the other end, which lives, has made the memory.
fn lengths_in(file: &File) -> Result<[u64; 3], Failure> {
    let nothing = ConnectionSpec { writer: 0, reader: 0, asynchronous_len: 0, queue_row_len: 0, queue_depth: 0 };
    let layout = Layout::new(Arc::new(Mapping::new(file, layout::len_of(&nothing))?), &nothing);
    let made = layout.made();
    // Whoever lives has made it whole before it gave the file free.
    if made.mark.load(Ordering::Acquire) != MADE {
        return Err(io::Error::other("it was made by another version of this program").into());
    }
    Ok([&made.asynchronous_len, &made.queue_row_len, &made.queue_depth].map(|len| len.load(Ordering::Relaxed)))
}

/// The buffer that is neither in the middle nor the other end's; none where the other end has died meanwhile.
fn left_over(layout: &Layout, file: &File, role: Role) -> Result<Option<u8>, Failure> {
    let theirs: &AtomicU8 = if role == Role::Writing { layout.front() } else { layout.back() };
    let since = Instant::now();
    loop {
        let held = in_the_middle(theirs.load(Ordering::Acquire));
        let middle = in_the_middle(layout.middle().load(Ordering::Acquire));
        if held != middle {
            return Ok(Some(BACK_AT_FIRST + MIDDLE_AT_FIRST + FRONT_AT_FIRST - held - middle));
        }
        if !locks::is_claimed(file, role.other().byte())? {
            return Ok(None);
        }
        if since.elapsed() > LOOK_MAX {
            return Err(Failure::Stopped);
        }
        std::thread::yield_now();
    }
}
