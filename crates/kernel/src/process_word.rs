// SPDX-License-Identifier: Apache-2.0
//! The word of a process, which the kernel, the supervisor and the programming system race to change.

/// Word of a process: generation 32 | stage 16 | flags 16.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Word {
    pub generation: u32,
    pub stage: u16,
    pub(crate) flags: u16,
}

/// Flag: no condition takes effect until an `Op::Stage`.
pub(crate) const FROZEN: u16 = 1;
/// Flag: frozen by `claim`, which moved the process to the next generation; steps that still run belong to the previous one.
pub(crate) const CLAIMED: u16 = 2;
/// Flag: ended by a reaction.
pub(crate) const ENDED: u16 = 4;

impl Word {
    pub(crate) fn pack(self) -> u64 {
        u64::from(self.generation) << 32 | u64::from(self.stage) << 16 | u64::from(self.flags)
    }

    pub(crate) fn unpack(word: u64) -> Word {
        Word { generation: (word >> 32) as u32, stage: (word >> 16) as u16, flags: word as u16 }
    }

    /// Returns true while conditions take effect.
    pub fn acts(self) -> bool {
        self.flags == 0
    }

    /// Returns true while a reported condition counts for the waits of the current list, including while the supervisor has taken the
    /// process to continue it. Remembered conditions are forgotten when the process moves to another list.
    pub fn remembers(self) -> bool {
        self.flags & ENDED == 0
    }

    /// Returns the generation to which running steps belong.
    pub(crate) fn running_generation(self) -> u32 {
        self.generation - u32::from(self.flags & CLAIMED != 0 && self.generation > 0)
    }
}
