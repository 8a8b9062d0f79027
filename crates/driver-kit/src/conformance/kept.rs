// SPDX-License-Identifier: Apache-2.0
//! Checks of process state on which other code relies: signal handlers, the thread's signals and arithmetic, the working directory of the
//! process.
use super::check::{Check, CheckResult, PassedCheck};
use super::cost::WARM;
use super::rig::Rig;
use super::subject::Subject;
use opengpac::floats::Words;
use std::path::PathBuf;
use std::sync::OnceLock;

pub(super) const CHECKS: &[Check] = &[
    Check { name: "arithmetic-kept", sentence: "no call changes the arithmetic of its thread: rounding, denormal numbers, traps", run: arithmetic },
    Check { name: "signals-kept", sentence: "no call changes a signal handler, or the signal mask of its thread", run: signals },
    Check { name: "folder-kept", sentence: "no call changes the working directory of its process", run: folder },
];

/// Signals for which a program may have a handler.
const SIGNALS: std::ops::Range<i32> = 1..65;

/// State of a process and of its thread that a driver must not change.
struct ProcessState {
    words: Words,
    handlers: Vec<libc::sigaction>,
    masked: libc::sigset_t,
    folder: PathBuf,
}

/// State of the process at the start of the checks.
static AT_FIRST: OnceLock<ProcessState> = OnceLock::new();

/// Records the reference state for the checks; called before any driver code has run.
pub(super) fn remember() {
    AT_FIRST.get_or_init(ProcessState::now);
}

impl ProcessState {
    fn now() -> ProcessState {
        let handler = |signal| {
            // SAFETY: all zeroes is a valid value, which the call fills; nothing is changed.
            unsafe {
                let mut handler: libc::sigaction = std::mem::zeroed();
                libc::sigaction(signal, std::ptr::null(), &raw mut handler);
                handler
            }
        };
        // SAFETY: as above.
        let masked = unsafe {
            let mut masked: libc::sigset_t = std::mem::zeroed();
            libc::pthread_sigmask(libc::SIG_BLOCK, std::ptr::null(), &raw mut masked);
            masked
        };
        let folder = std::env::current_dir().unwrap_or_else(|_| PathBuf::from("a folder that no longer exists"));
        ProcessState { words: Words::present(), handlers: SIGNALS.map(handler).collect(), masked, folder }
    }

    /// Restores the state, because a driver of an earlier check in this process may have changed it.
    fn restore(&self) {
        self.words.set();
        for (signal, handler) in SIGNALS.zip(&self.handlers) {
            // SAFETY: the handler was one of this process; signals that refuse one (SIGKILL) had none.
            unsafe { libc::sigaction(signal, handler, std::ptr::null_mut()) };
        }
        // SAFETY: the signals that this thread had masked.
        unsafe { libc::pthread_sigmask(libc::SIG_SETMASK, &raw const self.masked, std::ptr::null_mut()) };
        // A deleted folder cannot be returned to, and no check needs it.
        let _there = std::env::set_current_dir(&self.folder);
    }

    fn is_masked(&self, signal: i32) -> bool {
        // SAFETY: the set was filled by a call.
        unsafe { libc::sigismember(&raw const self.masked, signal) == 1 }
    }
}

/// A call in the life cycle of a driver.
type Call = fn(&mut Rig) -> Result<(), String>;

/// Makes each call of a life cycle; `changed` returns the change that a call has made.
fn over_a_life(subject: &Subject, changed: impl Fn(&ProcessState, &ProcessState) -> Option<String>) -> CheckResult {
    let before = AT_FIRST.get_or_init(ProcessState::now);
    before.restore();
    let mut rig = subject.rig()?;
    let calls: [(&'static str, Call); 4] = [
        ("open", Rig::open),
        ("the exchange", |rig| rig.cycles(WARM)),
        ("safe_state", |rig| {
            rig.safe_state();
            Ok(())
        }),
        ("close", |rig| {
            rig.driver.close();
            Ok(())
        }),
    ];
    let found = calls.into_iter().find_map(|(name, call)| match call(&mut rig) {
        Err(why) => Some(why),
        Ok(()) => changed(before, &ProcessState::now()).map(|what| format!("{name} {what}")),
    });
    before.restore();
    found.map_or(Ok(PassedCheck::Yes), Err)
}

fn arithmetic(subject: &Subject) -> CheckResult {
    over_a_life(subject, |before, now| (before.words != now.words).then(|| "changes it, which affects every later block on its source".to_owned()))
}

fn signals(subject: &Subject) -> CheckResult {
    over_a_life(subject, |before, now| {
        let handlers = SIGNALS.zip(before.handlers.iter().zip(&now.handlers));
        let other = handlers.into_iter().find(|(_, (before, now))| before.sa_sigaction != now.sa_sigaction).map(|(signal, _)| signal);
        let masked = SIGNALS.into_iter().find(|signal| before.is_masked(*signal) != now.is_masked(*signal));
        let set = other.map(|signal| format!("sets a handler for signal {signal}"));
        let set = set.or_else(|| masked.map(|signal| format!("changes whether its thread receives signal {signal}")));
        set.map(|set| format!("{set}, which only the program may do: a fault of a block may no longer be caught"))
    })
}

fn folder(subject: &Subject) -> CheckResult {
    over_a_life(subject, |before, now| (before.folder != now.folder).then(|| format!("goes from '{}' to '{}'", before.folder.display(), now.folder.display())))
}
