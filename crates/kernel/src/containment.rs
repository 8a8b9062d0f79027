// SPDX-License-Identifier: Apache-2.0
//! Rust interface of the containment: a step loop that can be aborted by a signal inside block code, and the alternate stack of its
//! signal handlers.
use crate::charge::Charge;
use crate::hearing::{self, Unheard};
use forks::UnforkedMemory;
use opengpac::abi::Run;
pub use opengpac::bank::Call;
use std::cell::Cell;
use std::ffi::{CStr, c_int, c_void};
use std::ptr;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicI64, AtomicPtr, AtomicU32, Ordering};

/// Containment of one source, in memory that forked children do not inherit. The first fields are shared with `containment.c`; they are
/// followed by the jump buffer, whose size C reports.
#[repr(C)]
struct ContainmentMemory {
    step: AtomicU32,
    armed: AtomicU32,
    started_ns: AtomicI64,
    budget_ns: AtomicI64,
    spent_ns: AtomicI64,
    calls: AtomicPtr<Call>,
    late: AtomicU32,
    lost: AtomicU32,
    heard: AtomicU32,
    forked: AtomicU32,
    charged: AtomicU32,
}

unsafe extern "C" {
    fn opengpac_containment_size() -> usize;
    fn opengpac_containment_run(containment: *mut ContainmentMemory, body: unsafe extern "C" fn(*mut c_void), argument: *mut c_void, started_ns: i64) -> c_int;
    fn opengpac_containment_install(word: *const u32) -> c_int;
    fn opengpac_containment_replaced(by: *mut *const c_void) -> c_int;
    fn opengpac_containment_trust(address: *const c_void);
}

/// Value of `step` while no block runs.
pub const OUTSIDE: u32 = u32::MAX;

/// Size of one source's section of a black box, in bytes. The first four bytes are the running step (`u32::MAX`: none).
pub const BLACK_BOX_LEN: usize = 1024;

/// Abnormal end of a loop.
pub struct Over {
    pub(crate) signal: i32,
    /// Faulting step.
    pub(crate) step: u32,
    /// Step that was aborted; `None` if the loop returned, but exceeded its budget.
    pub(crate) at: Option<u32>,
    /// True if the step was aborted in code of a library that may hold a lock, so that this thread must not call the library again.
    pub is_lost: bool,
}

impl Over {
    /// Returns true if a block has called fork().
    pub fn has_forked(&self) -> bool {
        self.signal == FORKED
    }
}

/// Contains faults of blocks in the step loop of one source. The source's thread runs the loop; the watchdog monitors its age.
pub struct Containment {
    shared: *mut ContainmentMemory,
    /// Memory owned by the containment; `None` if it is in a black box.
    _memory: Option<UnforkedMemory>,
    /// Thread that runs the loop, for the watchdog.
    thread: AtomicPtr<c_void>,
    /// Kernel thread ID of the source's own thread; 0 if it has none.
    own_thread: AtomicI32,
    /// Time charged to the current loop; `None` if the time for which its thread waits for a core also counts.
    charge: Option<Mutex<Charge>>,
    /// Signals that the watchdog has sent during the current loop.
    unheard: Unheard,
    /// Number of watchdog polls since this process announced its exit; 0 if it is not exiting.
    retires: AtomicU32,
}

/// Pseudo signal number for a loop that ran to completion after a block called fork().
const FORKED: i32 = 0x1_0000;

/// Number of watchdog polls, 10 ms apart, for which an exiting process waits for its devices to become safe.
const RETIRE_LOOKS: u32 = 20;

/// Exit status of a process that cannot be trusted: EX_SOFTWARE.
pub const RETIRED: i32 = 70;

static RETIRES: AtomicBool = AtomicBool::new(false);

/// Makes this process exit if a block is aborted in code of a library that may hold a lock. For processes that run only processors: the
/// guard and the supervisor outlive them.
pub fn retire_when_lost() {
    RETIRES.store(true, Ordering::Release);
}

pub fn is_retiring() -> bool {
    RETIRES.load(Ordering::Acquire)
}

/// Terminates this process immediately, without flushing or freeing, because either could wait for a lock that is never released.
pub fn end_process() -> ! {
    // SAFETY: ends the process.
    unsafe { libc::_exit(RETIRED) }
}

// SAFETY: the shared fields are atomic; the jump buffer is touched by the thread that runs the loop alone.
unsafe impl Send for Containment {}
// SAFETY: as for `Send`.
unsafe impl Sync for Containment {}

impl Containment {
    pub fn new(budget_ns: i64) -> Containment {
        // SAFETY: a constant.
        let len = unsafe { opengpac_containment_size() };
        let memory = UnforkedMemory::new(len).expect("there is memory for a page");
        let shared = memory.start().cast::<ContainmentMemory>();
        // SAFETY: all zeroes is a valid `ContainmentMemory`.
        unsafe { &*shared }.budget_ns.store(budget_ns, Ordering::Relaxed);
        Containment::of(shared, Some(memory))
    }

    /// Creates a containment in memory that other processes read after this process has exited: [`BLACK_BOX_LEN`] zeroed bytes at
    /// `memory`, aligned to a cache line, valid for the lifetime of the containment.
    ///
    /// # Safety
    /// No other code may write to this memory.
    pub unsafe fn at(memory: *mut u8, budget_ns: i64) -> Containment {
        // SAFETY: a constant.
        assert!(unsafe { opengpac_containment_size() } <= BLACK_BOX_LEN, "a containment fits into its place in a black box");
        let shared = memory.cast::<ContainmentMemory>();
        // SAFETY: the caller's word; all zeroes is a valid `ContainmentMemory`.
        unsafe { &*shared }.budget_ns.store(budget_ns, Ordering::Relaxed);
        Containment::of(shared, None)
    }

    fn of(shared: *mut ContainmentMemory, memory: Option<UnforkedMemory>) -> Containment {
        Containment {
            shared,
            _memory: memory,
            thread: AtomicPtr::new(ptr::null_mut()),
            own_thread: AtomicI32::new(0),
            charge: None,
            unheard: Unheard::default(),
            retires: AtomicU32::new(0),
        }
    }

    /// Returns the containment with a budget that does not count the time for which its thread only waits for a core.
    #[must_use]
    pub fn without_waits(self) -> Containment {
        self.shared().charged.store(1, Ordering::Relaxed);
        Containment { charge: Some(Mutex::default()), ..self }
    }

    fn shared(&self) -> &ContainmentMemory {
        // SAFETY: it lives as long as the containment.
        unsafe { &*self.shared }
    }

    /// Runs `body(argument)`. Returns `None` if it returned in time and no block called fork(), otherwise its abnormal end.
    ///
    /// # Safety
    /// `body` must not keep anything on its stack that has to be dropped while [`Containment::enter`] has a step set, because a signal jumps over it.
    pub unsafe fn run(&self, body: unsafe extern "C" fn(*mut c_void), argument: *mut c_void, started_ns: i64) -> Option<Over> {
        // SAFETY: an identity.
        self.thread.store(unsafe { libc::pthread_self() } as *mut c_void, Ordering::Relaxed);
        // SAFETY: the caller's word for `body`; the containment is run by one thread at a time.
        let ended_by = unsafe { opengpac_containment_run(self.shared, body, argument, started_ns) };
        let late = self.shared().late.load(Ordering::Relaxed).checked_sub(1);
        let at = (ended_by != 0).then(|| self.shared().step.load(Ordering::Relaxed));
        let is_lost = self.shared().lost.load(Ordering::Relaxed) != 0;
        match (at, late) {
            (None, None) => self.shared().forked.load(Ordering::Relaxed).checked_sub(1).map(|step| Over { signal: FORKED, step, at, is_lost }),
            (None, Some(late)) => Some(Over { signal: budget_signal(), step: late, at, is_lost }),
            // The block ended for exceeding the budget is the one that was running when the budget ran out.
            (Some(step), late) => Some(Over { signal: ended_by, step: late.filter(|_| ended_by == budget_signal()).unwrap_or(step), at, is_lost }),
        }
    }

    /// Returns the word that holds the running step.
    #[inline]
    pub fn step(&self) -> *mut u32 {
        self.shared().step.as_ptr()
    }

    /// Sets the calls of the steps of the loop that is about to run.
    #[inline]
    pub fn set_calls(&self, calls: *const Call) {
        self.shared().calls.store(calls.cast_mut(), Ordering::Relaxed);
    }

    pub(crate) fn set_budget(&self, budget_ns: i64) {
        self.shared().budget_ns.store(budget_ns, Ordering::Relaxed);
    }

    /// Subtracts the time that nested firings used within the loop from the loop's age; does nothing if no loop runs.
    pub fn excuse(&self, ns: i64) {
        let started = &self.shared().started_ns;
        let present = started.load(Ordering::Relaxed);
        if present != 0 {
            started.store(present + ns, Ordering::Relaxed);
        }
    }

    /// Subtracts `late_ns` from the age of a loop that started earlier, because the whole process was suspended for that time, until
    /// `now_ns` of CLOCK_MONOTONIC.
    pub fn forgive(&self, late_ns: i64, now_ns: i64) {
        let started = self.shared().started_ns.load(Ordering::Relaxed);
        // A retiring thread has no age.
        if late_ns > 0 && started > 1 && now_ns - started > late_ns {
            // A thread that has started another loop meanwhile needs no correction.
            let is_same = self.shared().started_ns.compare_exchange(started, started + late_ns, Ordering::Relaxed, Ordering::Relaxed).is_ok();
            if let Some(charge) = self.charge.as_ref().filter(|_| is_same) {
                charge.lock().expect("nobody panics with the lock held").forgive(started, late_ns);
            }
        }
    }

    /// Returns the start of the running loop if it has spent its budget. `now_ns`, `waits`: as for [`Containment::watch`].
    pub fn spent(&self, now_ns: i64, waits: impl Fn(libc::clockid_t) -> bool) -> Option<i64> {
        let (started_ns, thread) = (self.shared().started_ns.load(Ordering::Relaxed), self.thread.load(Ordering::Relaxed));
        let (age_ns, budget_ns) = (now_ns - started_ns, self.shared().budget_ns.load(Ordering::Relaxed));
        if started_ns == 0 || thread.is_null() {
            return None;
        }
        // A retiring thread has no age, and is charged nothing.
        let Some(charge) = self.charge.as_ref().filter(|_| started_ns > 1) else { return (age_ns > budget_ns).then_some(started_ns) };
        // Half of the budget must be charged after the first half has passed, so that only loops that last are looked at.
        if age_ns <= budget_ns / 2 {
            return None;
        }
        let thread = thread as libc::pthread_t;
        let (run_ns, clock) = hearing::run_ns(thread).zip(hearing::clock(thread))?;
        let mut charge = charge.lock().expect("nobody panics with the lock held");
        (charge.add(started_ns, now_ns, run_ns, || waits(clock)) > budget_ns / 2).then_some(started_ns)
    }

    /// Sends the budget signal to the thread of a loop that has spent its budget. `now_ns`: CLOCK_MONOTONIC; `waits`: returns true if the
    /// thread of a clock is merely waiting for a core. Returns true if the thread does not receive the signal.
    pub fn watch(&self, now_ns: i64, waits: impl Fn(libc::clockid_t) -> bool) -> bool {
        let thread = self.thread.load(Ordering::Relaxed);
        if let Some(started) = self.spent(now_ns, &waits) {
            self.shared().spent_ns.store(started, Ordering::Relaxed);
            if self.retires.load(Ordering::Relaxed) > RETIRE_LOOKS {
                end_process();
            }
            if self.retires.load(Ordering::Relaxed) > 0 {
                self.retires.fetch_add(1, Ordering::Relaxed);
                return false;
            }
            // SAFETY: a thread whose loop runs is alive.
            unsafe { libc::pthread_kill(thread as libc::pthread_t, budget_signal()) };
            self.unheard.add(thread as libc::pthread_t);
        }
        if self.shared().started_ns.load(Ordering::Relaxed) == 0 || self.shared().heard.load(Ordering::Relaxed) != 0 {
            self.unheard.clear();
        }
        let is_deaf = self.unheard.is_deaf(thread as libc::pthread_t, waits);
        if is_deaf {
            self.end_when_it_returns();
        }
        is_deaf
    }

    /// Marks an abandoned loop as over its budget, so that its source stops even if the loop eventually returns by itself.
    fn end_when_it_returns(&self) {
        let step = self.shared().step.load(Ordering::Relaxed);
        if step != OUTSIDE {
            let _earlier = self.shared().late.compare_exchange(0, step + 1, Ordering::Relaxed, Ordering::Relaxed);
        }
    }

    /// Binds the calling thread to the source for the rest of the thread's life.
    pub fn bind_thread(&self) {
        // SAFETY: an identity.
        self.own_thread.store(unsafe { libc::gettid() }, Ordering::Release);
    }

    /// Returns true if the source's own thread has exited. A thread that was not asked to close was terminated by the system, for example
    /// because a block dropped a privilege.
    pub fn is_gone(&self) -> bool {
        let thread = self.own_thread.load(Ordering::Acquire);
        thread != 0 && hearing::is_gone(thread)
    }

    /// Removes the real-time priority of the thread: a thread that cannot be aborted must neither starve others on its core nor keep the
    /// program from exiting.
    pub fn demote(&self) {
        let thread = self.thread.load(Ordering::Relaxed);
        let none = libc::sched_param { sched_priority: 0 };
        // SAFETY: a thread whose loop runs is alive.
        unsafe { libc::pthread_setschedparam(thread as libc::pthread_t, libc::SCHED_OTHER, &none) };
    }

    /// Signals that this process will exit soon, so that the black box keeps `step` as the last step that ran, and the watchdog waits
    /// only for a limited time.
    pub(crate) fn retire(&self, step: u32) {
        self.shared().step.store(step, Ordering::Relaxed);
        // Old enough that the watchdog's next poll finds an expired loop.
        self.shared().started_ns.store(1, Ordering::Relaxed);
        self.retires.store(1, Ordering::Relaxed);
    }
}

/// Registers the module that contains this entry as block code, which may be aborted at any instruction. Not for the real-time path.
pub fn trust(run: Run) {
    trust_code(run as *const c_void);
}

/// Registers the module that contains the function `of` as block code.
pub(crate) fn trust_code(of: *const c_void) {
    let _one = ONE_AT_A_TIME.lock().expect("nobody panics with the lock held");
    // SAFETY: one thread at a time; handlers may read what it adds to.
    unsafe { opengpac_containment_trust(of) };
    look_soon();
}

static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// Returns the number of the signal that reports an exceeded budget. Installs the handlers on the first call.
pub(crate) fn budget_signal() -> i32 {
    match BUDGET_SIGNAL.load(Ordering::Relaxed) {
        0 => install(),
        signal => signal,
    }
}

static BUDGET_SIGNAL: AtomicI32 = AtomicI32::new(0);

/// Set if handlers may have been replaced; makes the watchdog check immediately.
static IS_DUE: AtomicBool = AtomicBool::new(false);

/// Makes the watchdog check the signal handlers soon, because a module was loaded or a block has faulted.
pub(crate) fn look_soon() {
    IS_DUE.store(true, Ordering::Release);
}

/// Returns true if a check has been requested since the last one.
pub fn is_look_due() -> bool {
    IS_DUE.swap(false, Ordering::AcqRel)
}

/// Checks that all handlers are in place, and reinstalls them in front of any others if they are not. Returns a description of the
/// handlers that had replaced them. Not for the real-time path.
pub fn restore_handlers() -> Option<String> {
    let mut by = ptr::null();
    // SAFETY: asks for handlers, and writes an address of our own.
    let signal = unsafe { opengpac_containment_replaced(&mut by) };
    if signal == 0 || BUDGET_SIGNAL.load(Ordering::Relaxed) == 0 {
        return None;
    }
    install();
    let by = if by.is_null() { "set to its default, or ignored".to_owned() } else { format!("replaced by code of {}", object_of(by)) };
    let which = if signal == BUDGET_SIGNAL.load(Ordering::Relaxed) { "the signal of used-up time budgets".to_owned() } else { signal_name(signal) };
    let process = std::process::id();
    Some(format!("the handler of {which} in process {process} was {by}: faults of blocks were not contained until now; OpenGPAC's handler is installed again"))
}

fn signal_name(signal: i32) -> String {
    // SAFETY: gives a text that stays, or nothing.
    let name = unsafe { libc::strsignal(signal) };
    // SAFETY: a text that ends in NUL.
    if name.is_null() { format!("signal {signal}") } else { format!("signal {signal} ({})", unsafe { CStr::from_ptr(name) }.to_string_lossy()) }
}

/// Returns the path of the file that contains a function.
fn object_of(function: *const c_void) -> String {
    // SAFETY: all zeroes is a valid value, which the call fills.
    let mut about: libc::Dl_info = unsafe { std::mem::zeroed() };
    // SAFETY: asks about an address.
    if unsafe { libc::dladdr(function, &mut about) } == 0 || about.dli_fname.is_null() {
        return "no file".to_owned();
    }
    // SAFETY: a text that ends in NUL.
    format!("'{}'", unsafe { CStr::from_ptr(about.dli_fname) }.to_string_lossy())
}

/// Installs the handlers in front of existing ones. Called for each new host, because a crash reporter may have been enabled in the
/// meantime.
pub fn install() -> i32 {
    forks::claim_process();
    let _one = ONE_AT_A_TIME.lock().expect("nobody panics with the lock held");
    // SAFETY: one thread at a time; handlers of others are called for what is not ours.
    let signal = unsafe { opengpac_containment_install(forks::word().as_ptr()) };
    assert!(signal > 0, "the fault handlers cannot be installed: no real-time signal is free");
    BUDGET_SIGNAL.store(signal, Ordering::Relaxed);
    signal
}

thread_local! {
    static STACK: Cell<Option<HandlerStack>> = const { Cell::new(None) };
    static PREPARED: Cell<bool> = const { Cell::new(false) };
}

/// Alternate signal stack of this thread.
struct HandlerStack {
    memory: *mut c_void,
}

const STACK_LEN: usize = 64 * 1024;

/// Gives this thread a signal stack large enough for nested handlers, unless it has one. Cheap after the first call.
pub fn prepare_thread() {
    if PREPARED.replace(true) {
        return;
    }
    // SAFETY: asking for and setting this thread's own signal stack, with memory that stays until the thread ends.
    unsafe {
        let mut present: libc::stack_t = std::mem::zeroed();
        libc::sigaltstack(ptr::null(), &mut present);
        // The stack of Rust's standard library has room for one frame and overflows if signals nest.
        if present.ss_flags & libc::SS_DISABLE == 0 && present.ss_size >= STACK_LEN {
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
