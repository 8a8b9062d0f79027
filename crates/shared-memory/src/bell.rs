// SPDX-License-Identifier: Apache-2.0
//! Bells: how a writer wakes the process of its reader. One memory of a run has them all; each process that reads rows claims one.
//!
//! Any process of the run may write any of it, so nothing hangs on it: who sleeps looks again after [`SLEEP_MAX`] at the latest, rung or not.
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

/// Processes with reading ends, in one run.
const BELLS: u32 = 1024;
const LEN: usize = BELLS as usize * LINE;
/// Each member offers the bells that it uses under this and what tells it apart.
const NAME: &str = "bells";
/// No connection has this number: who looks for the bells is alone under it.
const AT: u64 = u64::MAX;
/// A ring that got lost, as where another process wrote over a word, is late by this and no more, ns.
const SLEEP_MAX: i64 = 100_000_000;

/// All bells of a run.
pub(crate) struct Bells {
    /// Taken back before the memory goes.
    _offer: Offer,
    memory: SealedMemory,
}

struct Bell {
    /// Number of rings (wraps).
    rings: AtomicU32,
    /// 1 while its listener sleeps, or is about to.
    asleep: AtomicU32,
}

/// Names a bell in a connection's memory: 0 is none.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) struct BellNumber(pub u32);

impl Bells {
    /// Those that a member of the run offers, or new ones.
    pub fn open(folder: &Folder) -> io::Result<Self> {
        let _alone = folder.alone(AT)?;
        let memory = Bells::present(folder).map_or_else(|| SealedMemory::new(LEN), Ok)?;
        let name = format!("{NAME}-{}-{}", std::process::id(), memory.as_fd().as_raw_fd());
        Ok(Bells { _offer: Offer::new(folder.file(&name), memory.as_fd())?, memory })
    }

    /// Those of this process, else of the one that started it, else of any: what is no memory of bells is passed over. Names that killed processes
    /// left are removed.
    fn present(folder: &Folder) -> Option<SealedMemory> {
        let known = [std::process::id(), parent_id()];
        let far = |path: &Path| fs::read_link(path).ok().and_then(|to| offering(&to)).map(|of| known.iter().position(|one| *one == of).unwrap_or(2));
        let is_one = |path: &Path| path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(NAME.as_bytes()));
        let mut offers: Vec<_> = folder.files().filter(|path| is_one(path)).collect();
        offers.iter().for_each(|path| remove_left(path));
        offers.sort_by_key(|path| far(path).unwrap_or(usize::MAX));
        offers.iter().find_map(|path| offered(path).ok().flatten().and_then(|(memory, _)| SealedMemory::received(memory, LEN).ok()))
    }

    /// Claims a bell that no living process has, until `self` is dropped; none where all are taken.
    pub fn claim(&self) -> io::Result<Option<BellNumber>> {
        for index in 0..BELLS {
            if locks::claim(&self.memory, index.into())? {
                return Ok(Some(BellNumber(index + 1)));
            }
        }
        Ok(None)
    }

    /// Rings a bell: its listener looks at its rows. One atomic addition and one load, and where the listener sleeps one wake, which waits
    /// for nothing. Real-time safe.
    #[inline]
    pub fn ring(&self, number: BellNumber) {
        let Some(bell) = self.bell(number) else { return };
        bell.rings.fetch_add(1, Ordering::SeqCst);
        // Together with `wait` no ring is lost: either this load sees the sleeper, or the sleeper sees the ring. Who rings does not clear
        // the flag: a sleeper that had heard this ring and is not asleep yet would then sleep through the next one.
        if bell.asleep.load(Ordering::SeqCst) == 1 {
            wake(bell);
        }
    }

    /// Wakes who sleeps at a bell of this process, whatever stands there.
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

    /// Sleeps until the bell has been rung more often than `heard`, but not for long; it may also return earlier. Not on the real-time path.
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
