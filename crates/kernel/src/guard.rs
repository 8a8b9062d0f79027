// SPDX-License-Identifier: Apache-2.0
//! The guard's face: a step loop that a signal inside block code ends, and the stack that its handlers run on.
use std::cell::Cell;
use std::ffi::{c_int, c_void};
use std::ptr;
use std::sync::Mutex;
use std::sync::atomic::{AtomicI32, AtomicI64, AtomicPtr, AtomicU32, Ordering};

/// One source's guard. The first fields are shared with `guard.c`; the jump buffer follows, in memory of C's size.
#[repr(C)]
struct Shared {
    step: AtomicU32,
    armed: AtomicU32,
    started_ns: AtomicI64,
    budget_ns: AtomicI64,
}

unsafe extern "C" {
    fn opengpac_guard_size() -> usize;
    fn opengpac_guard_run(guard: *mut Shared, body: unsafe extern "C" fn(*mut c_void), argument: *mut c_void, started_ns: i64) -> c_int;
    fn opengpac_guard_install() -> c_int;
}

/// `step` while no block runs.
pub const OUTSIDE: u32 = u32::MAX;

/// Bytes of one source in a black box. The first four are the step that runs (`u32::MAX`: none).
pub const BLACK_BOX_LEN: usize = 1024;

/// Guards the step loop of one source. Its thread runs it; the watchdog reads how old the loop is.
pub(crate) struct Guard {
    shared: *mut Shared,
    /// Of memory of its own; none where it lies in a black box.
    words: Option<usize>,
    /// The thread that runs the loop, for the watchdog.
    thread: AtomicPtr<c_void>,
}

// SAFETY: the shared fields are atomic; the jump buffer is touched by the thread that runs the loop alone.
unsafe impl Send for Guard {}
// SAFETY: as for `Send`.
unsafe impl Sync for Guard {}

impl Guard {
    pub(crate) fn new(budget_ns: i64) -> Guard {
        // SAFETY: a constant.
        let words = unsafe { opengpac_guard_size() }.div_ceil(size_of::<u128>());
        let shared = Box::leak(vec![0u128; words].into_boxed_slice()).as_mut_ptr().cast::<Shared>();
        // SAFETY: all zeroes is a valid `Shared`.
        unsafe { &*shared }.budget_ns.store(budget_ns, Ordering::Relaxed);
        Guard { shared, words: Some(words), thread: AtomicPtr::new(ptr::null_mut()) }
    }

    /// The same in memory that others read when this process is gone: [`BLACK_BOX_LEN`] bytes at `memory`, on a cache line, zero, for as long as the
    /// guard lives.
    ///
    /// # Safety
    /// Nobody else writes there.
    pub(crate) unsafe fn at(memory: *mut u8, budget_ns: i64) -> Guard {
        // SAFETY: a constant.
        assert!(unsafe { opengpac_guard_size() } <= BLACK_BOX_LEN, "a guard fits into its place in a black box");
        let shared = memory.cast::<Shared>();
        // SAFETY: the caller's word; all zeroes is a valid `Shared`.
        unsafe { &*shared }.budget_ns.store(budget_ns, Ordering::Relaxed);
        Guard { shared, words: None, thread: AtomicPtr::new(ptr::null_mut()) }
    }

    fn shared(&self) -> &Shared {
        // SAFETY: it lives as long as the guard.
        unsafe { &*self.shared }
    }

    /// Runs `body(argument)`. `None` if it returned, else the signal that ended it and the step in which it did.
    ///
    /// # Safety
    /// `body` keeps nothing on its stack that must be dropped while [`Guard::enter`] has a step set: a signal jumps over it.
    pub(crate) unsafe fn run(&self, body: unsafe extern "C" fn(*mut c_void), argument: *mut c_void, started_ns: i64) -> Option<(i32, u32)> {
        // SAFETY: an identity.
        self.thread.store(unsafe { libc::pthread_self() } as *mut c_void, Ordering::Relaxed);
        // SAFETY: the caller's word for `body`; the guard is run by one thread at a time.
        let ended_by = unsafe { opengpac_guard_run(self.shared, body, argument, started_ns) };
        (ended_by != 0).then(|| (ended_by, self.shared().step.load(Ordering::Relaxed)))
    }

    /// The word that says which step runs.
    #[inline]
    pub(crate) fn step(&self) -> *mut u32 {
        self.shared().step.as_ptr()
    }

    pub(crate) fn set_budget(&self, budget_ns: i64) {
        self.shared().budget_ns.store(budget_ns, Ordering::Relaxed);
    }

    /// Takes time that others used within the loop off its age; nothing where no loop runs.
    pub(crate) fn excuse(&self, ns: i64) {
        let started = &self.shared().started_ns;
        let present = started.load(Ordering::Relaxed);
        if present != 0 {
            started.store(present + ns, Ordering::Relaxed);
        }
    }

    /// Sends the budget signal to the thread of a loop that is too old. `now_ns` of CLOCK_MONOTONIC.
    pub(crate) fn watch(&self, now_ns: i64) {
        let started = self.shared().started_ns.load(Ordering::Relaxed);
        let thread = self.thread.load(Ordering::Relaxed);
        if started != 0 && !thread.is_null() && now_ns - started > self.shared().budget_ns.load(Ordering::Relaxed) {
            // SAFETY: a thread whose loop runs is alive.
            unsafe { libc::pthread_kill(thread as libc::pthread_t, budget_signal()) };
        }
    }
}

impl Drop for Guard {
    fn drop(&mut self) {
        if let Some(words) = self.words {
            // SAFETY: leaked in `new` with the same length.
            drop(unsafe { Box::from_raw(ptr::slice_from_raw_parts_mut(self.shared.cast::<u128>(), words)) });
        }
    }
}

/// The signal of a spent budget. Installs the handlers when called for the first time.
pub(crate) fn budget_signal() -> i32 {
    match BUDGET_SIGNAL.load(Ordering::Relaxed) {
        0 => install(),
        signal => signal,
    }
}

static BUDGET_SIGNAL: AtomicI32 = AtomicI32::new(0);

/// Puts the handlers in front of those that are there: for each host that is made, because a crash reporter may have been
/// switched on since the last.
pub(crate) fn install() -> i32 {
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    let _one = ONE_AT_A_TIME.lock().expect("nobody panics with the lock held");
    // SAFETY: one thread at a time; handlers of others are called for what is not ours.
    let signal = unsafe { opengpac_guard_install() };
    assert!(signal > 0, "the fault handlers cannot be installed: no real-time signal is free");
    BUDGET_SIGNAL.store(signal, Ordering::Relaxed);
    signal
}

thread_local! {
    static STACK: Cell<Option<HandlerStack>> = const { Cell::new(None) };
    static PREPARED: Cell<bool> = const { Cell::new(false) };
}

/// A stack for the handlers of this thread.
struct HandlerStack {
    memory: *mut c_void,
}

const STACK_LEN: usize = 64 * 1024;

/// Gives this thread a stack for its handlers, where it has none. Cheap after the first time.
pub(crate) fn prepare_thread() {
    if PREPARED.replace(true) {
        return;
    }
    // SAFETY: asking for and setting this thread's own signal stack, with memory that stays until the thread ends.
    unsafe {
        let mut present: libc::stack_t = std::mem::zeroed();
        libc::sigaltstack(ptr::null(), &mut present);
        if present.ss_flags & libc::SS_DISABLE == 0 {
            return;
        }
        let memory = libc::mmap(ptr::null_mut(), STACK_LEN, libc::PROT_READ | libc::PROT_WRITE, libc::MAP_PRIVATE | libc::MAP_ANONYMOUS, -1, 0);
        if memory == libc::MAP_FAILED {
            return;
        }
        let stack = libc::stack_t { ss_sp: memory, ss_flags: 0, ss_size: STACK_LEN };
        libc::sigaltstack(&stack, ptr::null_mut());
        STACK.set(Some(HandlerStack { memory }));
    }
}

impl Drop for HandlerStack {
    fn drop(&mut self) {
        // SAFETY: the stack is this thread's own, disabled before its memory goes.
        unsafe {
            let none = libc::stack_t { ss_sp: ptr::null_mut(), ss_flags: libc::SS_DISABLE, ss_size: 0 };
            libc::sigaltstack(&none, ptr::null_mut());
            libc::munmap(self.memory, STACK_LEN);
        }
    }
}
