// SPDX-License-Identifier: Apache-2.0
//! Connections between processes of one host: the triple buffer and the queue of `interconnect` in memory that both processes map, and a
//! bell that wakes the reader's process.
//!
//! | | writing end | reading end |
//! |---|---|---|
//! | may block the other | never | never |
//! | publication, latch | one swap and one store | one load if there is no new group, else one load, one swap and one store |
//! | row pushed, taken | one store, one addition, two loads; if the reader's process sleeps, one swap and one system call that wakes it | one store; one load if the remembered count indicates empty |
//! | buffers | three for the group, as within a process; `queue_depth` rows | the same |
//! | allocates, locks, makes system calls | when made and dropped; for the wake | when made and dropped |
//! | if the other is preempted, stopped or killed at any point | continues; rows until the queue is full | continues with the last complete publication and the complete rows |
//! | if it is killed itself and made again | continues after the waiting rows, in the free buffer | receives the newest publication and the waiting rows as new |
//!
//! The memory has no name, and its size cannot be changed ([`SealedMemory`]); the folder of a run contains only links to it. The process
//! at the other end may write any word of it at any time: an impossible value ends the connection, with a reason that [`Ends::lost`]
//! returns. Waits for other processes are limited in time.
//!
//! Living processes are recognised by file locks, which the operating system releases when a process is killed ([`locks`]). Deaths
//! therefore need no notification, and the remains of dead processes are found and removed (`folder`).
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

/// Ends of connections in memory shared by the processes of one run of a system. May be dropped before its ends.
///
/// Each end is unique: a second end with the same number and kind is refused while the first lives, here or in another process. A
/// connection lives as long as one of its ends; after both have ended, its number can be reused for a new connection.
pub struct SharedMemory {
    /// Listener, started with the first reading end of a connection with a queue.
    listener: Option<Arc<Listener>>,
    bells: Arc<Bells>,
    folder: Arc<Folder>,
    /// Loss states of the ends created here.
    fates: Vec<Weak<Fate>>,
}

impl SharedMemory {
    /// Enters the shared memory of run `run` of a system, and removes the remains of dead processes of this and any other run. All
    /// processes to be connected must pass the same name and run ([`new_run`], passed on by the process that starts them).
    ///
    /// # Errors
    /// Fails if there is no permission to use `/dev/shm`, or no space in it.
    pub fn new(system: &str, run: u64) -> Result<Self, EndError> {
        let failed = |error: io::Error| EndError {
            message: format!("cannot open the shared memory of system '{system}': {error}; check the permissions and the free space of /dev/shm"),
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
                        "cannot create the reading end of connection {number} (source {} to source {}) in shared memory: its rows have no listener: {error}; end processes of this system that are not needed",
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

/// Returns a number that no other run has, for the process that starts a system.
pub fn new_run() -> u64 {
    // Keyed by random numbers of the system, different for each thread and incremented with each call.
    RandomState::new().hash_one(std::process::id())
}

/// Removes the remains of killed processes from shared memory if no process of their run is alive; returns the number of such runs.
/// [`SharedMemory::new`] and its drop do the same.
pub fn clean() -> usize {
    folder::sweep()
}
