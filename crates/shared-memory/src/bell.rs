// SPDX-License-Identifier: Apache-2.0
//! Bells: how a writer wakes the process of its reader. One file of a run has them all; each process that reads rows claims one.
use crate::folder::{self, Folder};
use crate::locks;
use crate::mapping::{LINE, Mapping};
use std::fs::File;
use std::io;
use std::sync::atomic::{AtomicU32, Ordering};

/// Processes with reading ends, in one run.
const BELLS: u32 = 1024;
const FILE: &str = "bells";

/// All bells of a run.
pub(crate) struct Bells {
    mapping: Mapping,
    file: File,
}

struct Bell {
    /// How often it was rung (wraps).
    rings: AtomicU32,
    /// 1 while its listener sleeps, or is about to.
    asleep: AtomicU32,
}

/// Names a bell in a connection's memory: 0 is none.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) struct BellNumber(pub u32);

impl Bells {
    pub fn open(folder: &Folder) -> io::Result<Self> {
        let file = folder::open(&folder.file(FILE))?;
        Ok(Bells { mapping: Mapping::new(&file, BELLS as usize * LINE)?, file })
    }

    /// Claims a bell that no living process has, until `self` is dropped; none where all are taken.
    pub fn claim(&self) -> io::Result<Option<BellNumber>> {
        for index in 0..BELLS {
            if locks::claim(&self.file, index)? {
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
            // SAFETY: wakes who sleeps on a word that lives through the call.
            unsafe { libc::syscall(libc::SYS_futex, bell.rings.as_ptr(), libc::FUTEX_WAKE, 1) };
        }
    }

    /// How often it has been rung.
    pub fn rings(&self, number: BellNumber) -> u32 {
        self.bell(number).map_or(0, |bell| bell.rings.load(Ordering::SeqCst))
    }

    /// Sleeps until the bell has been rung more often than `heard`; it may also return earlier. Not on the real-time path.
    pub fn wait(&self, number: BellNumber, heard: u32) {
        let Some(bell) = self.bell(number) else { return };
        bell.asleep.store(1, Ordering::SeqCst);
        // SAFETY: sleeps on a word that lives through the call; the system compares the word before it puts the thread to sleep.
        unsafe { libc::syscall(libc::SYS_futex, bell.rings.as_ptr(), libc::FUTEX_WAIT, heard, std::ptr::null::<libc::timespec>()) };
        bell.asleep.store(0, Ordering::SeqCst);
    }

    fn bell(&self, number: BellNumber) -> Option<&Bell> {
        let index = number.0.checked_sub(1).filter(|index| *index < BELLS)?;
        // SAFETY: a line of the mapping, made of atomic words only, of which any bytes are a value.
        Some(unsafe { self.mapping.at(index as usize * LINE).cast().as_ref() })
    }
}
