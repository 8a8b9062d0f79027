// SPDX-License-Identifier: Apache-2.0
//! Prefetches memory before it is written.

/// Prefetches up to `LINES` cache lines of `words` for writing, without reading, changing or waiting for them. Otherwise, the writer
/// would wait while a line that was last used by a reader on another processor is fetched from there.
#[inline]
pub(crate) fn will_write<T>(words: &[T]) {
    let (start, len) = (words.as_ptr().cast::<u8>(), size_of_val(words));
    for offset in (0..len.min(LINES * LINE)).step_by(LINE) {
        line(start.wrapping_add(offset));
    }
    // The last word may be on a line of its own, since the first is rarely at the start of one.
    line(start.wrapping_add(len.saturating_sub(1).min(LINES * LINE)));
}

/// Maximum number of lines; more would evict data that the steps need in the meantime.
const LINES: usize = 32;
const LINE: usize = 64;

#[inline]
fn line(address: *const u8) {
    #[cfg(all(target_arch = "x86_64", not(miri)))]
    // SAFETY: a hint; it faults at no address.
    unsafe {
        std::arch::asm!("prefetchw [{}]", in(reg) address, options(nostack, preserves_flags, readonly));
    }
    #[cfg(all(target_arch = "aarch64", not(miri)))]
    // SAFETY: a hint; it faults at no address.
    unsafe {
        std::arch::asm!("prfm pstl1keep, [{}]", in(reg) address, options(nostack, preserves_flags, readonly));
    }
    #[cfg(any(miri, not(any(target_arch = "x86_64", target_arch = "aarch64"))))]
    let _ = address;
}
