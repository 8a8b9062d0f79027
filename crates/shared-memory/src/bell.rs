// SPDX-License-Identifier: Apache-2.0
//! Bells with which a writer wakes the process of its reader. All bells of a run are in a single shared memory; each process that reads
//! rows claims one of them.
//!
//! Any process of the run may overwrite this memory, so correctness does not depend on it: a sleeper checks again after at most
//! [`SLEEP_MAX`], even if its bell was not rung.
use crate::folder::Folder;
use crate::locks;
use crate::offer::{Offer, offered, offering, remove_left};
use crate::sealed::{LINE, SealedMemory};
use std::fs;
use std::io;
use std::os::fd::{AsFd, AsRawFd};
use std::os::unix::process::parent_id;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};

/// Maximum number of processes with reading ends in one run.
const BELLS: u32 = 1024;
const LEN: usize = BELLS as usize * LINE;
/// Prefix of the name under which a member offers the bells that it uses; the member's unique suffix follows it.
const NAME: &str = "bells";
/// Pseudo connection number that no connection has. A process claims it to exclude others while it searches for the bells.
const AT: u64 = u64::MAX;
/// Maximum delay caused by a lost ring, for example after another process overwrote a word, ns.
const SLEEP_MAX: i64 = 100_000_000;

/// All bells of a run.
pub(crate) struct Bells {
    /// Offer of the memory; withdrawn before the memory is released.
    _offer: Offer,
    memory: SealedMemory,
}

struct Bell {
    /// Number of rings (wraps around).
    rings: AtomicU32,
    /// 1 while the bell's listener sleeps or is about to sleep.
    asleep: AtomicU32,
}

/// Number of a bell in the memory of a connection; 0 if there is none.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) struct BellNumber(pub u32);

impl Bells {
    /// Opens the bells offered by a member of the run, or creates new ones.
    pub fn open(folder: &Folder) -> io::Result<Self> {
        let _alone = folder.alone(AT)?;
        let memory = Bells::present(folder).map_or_else(|| SealedMemory::new(LEN), Ok)?;
        let name = format!("{NAME}-{}-{}", std::process::id(), memory.as_fd().as_raw_fd());
        Ok(Bells { _offer: Offer::new(folder.file(&name), memory.as_fd())?, memory })
    }

    /// Returns the bells of this process, or else those of its parent, or else those of any process; skips memory that does not contain
    /// bells. Removes names left behind by killed processes.
    fn present(folder: &Folder) -> Option<SealedMemory> {
        let known = [std::process::id(), parent_id()];
        let far = |path: &Path| fs::read_link(path).ok().and_then(|to| offering(&to)).map(|of| known.iter().position(|one| *one == of).unwrap_or(2));
        let is_one = |path: &Path| path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(NAME.as_bytes()));
        let mut offers: Vec<_> = folder.files().filter(|path| is_one(path)).collect();
        offers.iter().for_each(|path| remove_left(path));
        offers.sort_by_key(|path| far(path).unwrap_or(usize::MAX));
        offers.iter().find_map(|path| offered(path).ok().flatten().and_then(|(memory, _)| SealedMemory::received(memory, LEN).ok()))
    }

    /// Claims a bell that is not claimed by any living process, until `self` is dropped; returns `None` if all bells are taken.
    pub fn claim(&self) -> io::Result<Option<BellNumber>> {
        for index in 0..BELLS {
            if locks::claim(&self.memory, index.into())? {
                return Ok(Some(BellNumber(index + 1)));
            }
        }
        Ok(None)
    }

    /// Rings a bell, so that its listener checks its rows. Takes one atomic addition and one load, and one non-blocking wake if the
    /// listener sleeps. Real-time safe.
    #[inline]
    pub fn ring(&self, number: BellNumber) {
        let Some(bell) = self.bell(number) else { return };
        bell.rings.fetch_add(1, Ordering::SeqCst);
        // Together with `wait`, no ring is lost: either this load sees the sleeper, or the sleeper sees the ring. The ringer does not
        // clear the flag: a sleeper that had noticed this ring but is not asleep yet would then sleep through the next one.
        if bell.asleep.load(Ordering::SeqCst) == 1 {
            wake(bell);
        }
    }

    /// Wakes the thread that sleeps on a bell of this process, whatever the bell's words contain.
    pub fn rouse(&self, number: BellNumber) {
        if let Some(bell) = self.bell(number) {
            bell.rings.fetch_add(1, Ordering::SeqCst);
            wake(bell);
        }
    }

    /// Returns the number of rings.
    pub fn rings(&self, number: BellNumber) -> u32 {
        self.bell(number).map_or(0, |bell| bell.rings.load(Ordering::SeqCst))
    }

    /// Sleeps until the bell has been rung more than `heard` times, but only for a limited time; may return earlier. Not on the real-time
    /// path.
    pub fn wait(&self, number: BellNumber, heard: u32) {
        let Some(bell) = self.bell(number) else { return };
        bell.asleep.store(1, Ordering::SeqCst);
        let limit = libc::timespec { tv_sec: 0, tv_nsec: SLEEP_MAX };
        // SAFETY: sleeps on a word that lives through the call; the system compares the word before it puts the thread to sleep.
        unsafe { libc::syscall(libc::SYS_futex, bell.rings.as_ptr(), libc::FUTEX_WAIT, heard, &raw const limit) };
        bell.asleep.store(0, Ordering::SeqCst);
    }

    fn bell(&self, number: BellNumber) -> Option<&Bell> {
        let index = number.0.checked_sub(1).filter(|index| *index < BELLS)?;
        // SAFETY: a line of the mapping, made of atomic words only, of which any bytes are a value.
        Some(unsafe { self.memory.at(index as usize * LINE).cast().as_ref() })
    }
}

fn wake(bell: &Bell) {
    // SAFETY: wakes who sleeps on a word that lives through the call.
    unsafe { libc::syscall(libc::SYS_futex, bell.rings.as_ptr(), libc::FUTEX_WAKE, 1) };
}
