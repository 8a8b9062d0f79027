// SPDX-License-Identifier: Apache-2.0
//! Floating-point control words of a thread: rounding, flushing to zero, unmasked traps, precision. A value must not depend on settings
//! made by another block, a module's constructor or a program, so blocks compute with the standard words.

/// Control words of the calling thread, as bits, without the sticky exception flags: MXCSR and the x87 control word on x86-64, FPCR on
/// aarch64.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Words(u64);

impl Words {
    /// Standard words: round to nearest, subnormals preserved, no traps, extended precision.
    pub const STANDARD: Words = Words(words::STANDARD);

    /// Returns the words of the calling thread. Takes a few ns; allowed on the real-time path.
    #[inline]
    pub fn present() -> Words {
        Words(words::present())
    }

    /// Sets the words of the calling thread, and empties its x87 stack.
    #[cold]
    pub fn set(self) {
        words::set(self.0);
    }

    /// Sets the standard words unless they are already set. Returns true if it changed them.
    #[inline]
    pub fn standardise() -> bool {
        let is_other = Words::present() != Words::STANDARD;
        if is_other {
            Words::STANDARD.set();
        }
        is_other
    }
}

/// Guard that sets the standard words on a caller's thread, and restores the previous ones when dropped.
pub struct Standard {
    found: Words,
}

impl Standard {
    /// Sets the standard words until the returned guard is dropped.
    #[must_use]
    pub fn enter() -> Standard {
        let found = Words::present();
        if found != Words::STANDARD {
            Words::STANDARD.set();
        }
        Standard { found }
    }
}

impl Drop for Standard {
    fn drop(&mut self) {
        if Words::present() != self.found {
            self.found.set();
        }
    }
}

/// Empties the x87 stack, on which MMX code or a wrong function declaration may have left values. Does nothing on other architectures.
#[inline]
pub fn empty_stack() {
    words::empty_stack();
}

#[cfg(target_arch = "x86_64")]
mod words {
    use core::arch::asm;

    /// MXCSR bits except the sticky flags.
    const MXCSR: u32 = !0x3f;
    /// Masks, precision and rounding of the x87 control word.
    const X87: u16 = 0x0f3f;
    /// Bits of the x87 control word that are always set.
    const X87_FIXED: u16 = 0x40;
    /// Direction flag: if set, copies run backwards.
    const BACKWARDS: u64 = 0x400;
    pub const STANDARD: u64 = 0x1f80 | 0x033f << 32;

    #[inline]
    pub fn present() -> u64 {
        let (mut mxcsr, mut control, flags) = (0_u32, 0_u16, flags());
        // SAFETY: stores two words to where they are told; neither instruction waits for a pending exception.
        unsafe {
            asm!("stmxcsr [{mxcsr}]", "fnstcw [{control}]", mxcsr = in(reg) &raw mut mxcsr, control = in(reg) &raw mut control, options(nostack, preserves_flags));
        }
        u64::from(mxcsr & MXCSR) | u64::from(control & X87) << 32 | (flags & BACKWARDS) << 48
    }

    #[inline]
    fn flags() -> u64 {
        let flags;
        // SAFETY: reads the flags by way of the stack.
        unsafe { asm!("pushfq", "pop {}", out(reg) flags, options(nomem, preserves_flags)) };
        flags
    }

    pub fn set(words: u64) {
        // SAFETY: what calls leave clear is cleared; compiled code must never find it set.
        unsafe { asm!("cld", options(nostack, nomem)) };
        let (mxcsr, control) = (words as u32 & MXCSR, (words >> 32) as u16 & X87 | X87_FIXED);
        // SAFETY: loads words that `present` gave, or the standard ones; `fninit` drops pending exceptions, which `fldcw` would raise.
        unsafe {
            asm!("ldmxcsr [{mxcsr}]", "fninit", "fldcw [{control}]", mxcsr = in(reg) &raw const mxcsr, control = in(reg) &raw const control,
                out("st(0)") _, out("st(1)") _, out("st(2)") _, out("st(3)") _, out("st(4)") _, out("st(5)") _, out("st(6)") _, out("st(7)") _,
                options(nostack, preserves_flags));
        }
    }

    #[inline]
    pub fn empty_stack() {
        // SAFETY: between two calls nothing is on that stack.
        unsafe {
            asm!("emms", out("st(0)") _, out("st(1)") _, out("st(2)") _, out("st(3)") _, out("st(4)") _, out("st(5)") _, out("st(6)") _, out("st(7)") _,
                options(nostack, nomem, preserves_flags));
        }
    }
}

#[cfg(target_arch = "aarch64")]
mod words {
    use core::arch::asm;

    pub const STANDARD: u64 = 0;

    #[inline]
    pub fn present() -> u64 {
        let words: u64;
        // SAFETY: reads a register of this thread.
        unsafe { asm!("mrs {}, fpcr", out(reg) words, options(nostack, nomem, preserves_flags)) };
        words
    }

    pub fn set(words: u64) {
        // SAFETY: sets a register of this thread to what `present` gave, or to the standard.
        unsafe { asm!("msr fpcr, {}", in(reg) words, options(nostack, nomem, preserves_flags)) };
    }

    #[inline]
    pub fn empty_stack() {}
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
mod words {
    pub const STANDARD: u64 = 0;

    pub fn present() -> u64 {
        STANDARD
    }

    pub fn set(_: u64) {}

    pub fn empty_stack() {}
}

#[cfg(test)]
#[cfg(target_arch = "x86_64")]
mod tests {
    use super::*;

    #[test]
    fn who_found_other_words_gets_them_back() {
        let upward = Words(words::STANDARD | 0x4000);
        let single_and_upward = Words(words::STANDARD & !(0x300 << 32) | 0x800 << 32);
        for found in [upward, single_and_upward, Words::STANDARD] {
            found.set();
            let standard = Standard::enter();
            assert_eq!(Words::present(), Words::STANDARD);
            drop(standard);
            assert_eq!(Words::present(), found);
            assert_eq!(Words::standardise(), found != Words::STANDARD);
            assert_eq!(Words::present(), Words::STANDARD);
        }
    }
}
