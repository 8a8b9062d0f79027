// SPDX-License-Identifier: Apache-2.0
//! Connections between processes of one host: the triple buffer and the queue of `interconnect` in memory that both processes map, and a bell that
//! wakes the reader's process.
//!
//! | | writing end | reading end |
//! |---|---|---|
//! | may block the other | never | never |
//! | publication, latch | one swap and one store | one load where there is no news, else one load, one swap and one store |
//! | row pushed, taken | one store, one addition, two loads; where the reader's process sleeps one swap and one system call that wakes it | one store; one load where the remembered count says empty |
//! | buffers | three of the group, as in a process; `queue_depth` of rows | the same |
//! | allocates, locks, calls the system | when it is made and dropped; the wake | when it is made and dropped |
//! | if the other is preempted, stopped or killed anywhere | goes on; rows until the queue is full | goes on, with the last complete publication and the rows that were pushed whole |
//! | if it is killed itself and made again | goes on behind the rows that wait, in the buffer that is free | the newest publication is news for it, and the rows that wait are |
//!
//! Memory has no name and a size that nobody can change ([`SealedMemory`]): the folder of a run has names only, that lead to it. The process at the other end may
//! write any word of it at any time: a word that no end writes loses the connection, with a reason that [`Ends::lost`] tells; nobody waits for
//! another longer than a moment.
//!
//! The system knows who lives by locks on files, which it takes away from a process that is killed ([`locks`]); so nothing here
//! has to be told of a death, and what a dead process left is found and removed (`folder`).
//!
//! ```
//! use interconnect::{ConnectionSpec, Ends};
//! use shared_memory::{SharedMemory, new_run};
//!
//! let run = new_run();
//! let (mut here, mut there) = (SharedMemory::new("cell", run)?, SharedMemory::new("cell", run)?);
//! let spec = ConnectionSpec { writer: 0, reader: 1, asynchronous_len: 8, queue_row_len: 0, queue_depth: 0 };
//! let mut sender = here.sender(7, &spec)?;
//! // in another process
//! let mut receiver = there.receiver(7, &spec, Box::new(|| ()))?;
//! sender.group().copy_from_slice(&1.5f64.to_ne_bytes());
//! sender.publish(1, 1_000_000);
//! assert_eq!(receiver.latch(0).map(|header| header.number), Some(1));
//! assert_eq!(receiver.group(), 1.5f64.to_ne_bytes());
//! # Ok::<(), interconnect::EndError>(())
//! ```
mod bell;
mod connection;
mod fate;
mod folder;
mod layout;
mod listener;
mod locks;
mod offer;
mod receiver;
mod sealed;
mod sender;

pub use sealed::SealedMemory;

use bell::Bells;
use connection::{Connection, Role};
use fate::Fate;
use folder::Folder;
use interconnect::{ConnectionSpec, EndError, Ends, LostConnection, Receiver, Sender};
use listener::Listener;
use receiver::{SharedReceiver, Watch};
use sender::SharedSender;
use std::hash::{BuildHasher, RandomState};
use std::io;
use std::sync::{Arc, Weak};

/// Ends of connections in memory that the processes of one run of a system share. It may be dropped before its ends.
///
/// An end exists once: a second one with its number and kind is refused while the first lives, here or in another process. A connection lives as long as
/// one of its ends; when both are gone, its number begins afresh.
pub struct SharedMemory {
    /// Started with the first reading end that has a queue.
    listener: Option<Arc<Listener>>,
    bells: Arc<Bells>,
    folder: Arc<Folder>,
    /// Of the ends that it made.
    fates: Vec<Weak<Fate>>,
}

impl SharedMemory {
    /// Enters the shared memory of run `run` of a system, and removes what dead processes of any run, and of this one, left. All processes that are to be
    /// connected give the same name and the same run ([`new_run`], passed on by the process that starts them); others never meet.
    ///
    /// # Errors
    /// No rights or no room in `/dev/shm`.
    pub fn new(system: &str, run: u64) -> Result<Self, EndError> {
        let failed = |error: io::Error| EndError {
            message: format!("cannot enter the shared memory of system '{system}': {error}; see who may read and write /dev/shm, and how full it is"),
        };
        folder::sweep();
        let folder = Folder::enter(system, run).map_err(failed)?;
        Connection::sweep(&folder);
        let bells = Bells::open(&folder).map_err(failed)?;
        Ok(SharedMemory { listener: None, bells: Arc::new(bells), folder: Arc::new(folder), fates: Vec::new() })
    }

    fn enter(&mut self, role: Role, number: u64, spec: &ConnectionSpec) -> Result<Connection, EndError> {
        let connection = Connection::enter(&self.folder, role, number, spec)?;
        self.fates.retain(|fate| fate.strong_count() > 0);
        self.fates.push(Arc::downgrade(&connection.fate));
        Ok(connection)
    }

    fn listener(&mut self) -> io::Result<Arc<Listener>> {
        if self.listener.is_none() {
            self.listener = Some(Arc::new(Listener::start(self.bells.clone())?));
        }
        Ok(self.listener.clone().expect("it was put there above"))
    }
}

impl Ends for SharedMemory {
    fn sender(&mut self, number: u64, spec: &ConnectionSpec) -> Result<Box<dyn Sender>, EndError> {
        let connection = self.enter(Role::Writing, number, spec)?;
        Ok(Box::new(SharedSender::new(connection, self.bells.clone(), spec)))
    }

    fn receiver(&mut self, number: u64, spec: &ConnectionSpec, raise: Box<dyn Fn() + Send + Sync>) -> Result<Box<dyn Receiver>, EndError> {
        let connection = self.enter(Role::Reading, number, spec)?;
        let watched = match spec.queue_depth {
            0 => None,
            _ => {
                let listener = self.listener().map_err(|error| EndError {
                    message: format!(
                        "cannot make the reading end of connection {number} (source {} to source {}) in shared memory: its rows have no listener: {error}; end processes of this system that are not needed",
                        spec.writer, spec.reader
                    ),
                })?;
                let key = listener.watch(connection.layout.clone(), raise);
                Some(Watch { listener, key })
            }
        };
        Ok(Box::new(SharedReceiver::new(connection, watched, spec)))
    }

    fn lost(&mut self) -> Vec<LostConnection> {
        self.fates.iter().filter_map(|fate| fate.upgrade()?.news()).collect()
    }
}

impl Drop for SharedMemory {
    fn drop(&mut self) {
        folder::sweep();
    }
}

/// A number that no other run has: for the process that starts a system.
pub fn new_run() -> u64 {
    // Keyed by the system's random numbers, anew for each thread and counted up for each call.
    RandomState::new().hash_one(std::process::id())
}

/// Removes what processes that were killed left in shared memory, where nobody of their run lives; returns how many runs that
/// were. [`SharedMemory::new`] and its drop do so too.
pub fn clean() -> usize {
    folder::sweep()
}
