// SPDX-License-Identifier: Apache-2.0
//! Exit of a process, with its description.
use std::fmt;

/// Exit of a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// The process exited with this status.
    Exited(i32),
    /// The process was killed by a signal.
    Killed {
        /// Number of the signal.
        signal: i32,
        /// True if a core dump was written.
        core: bool,
    },
    /// The process has exited; its status is known only to its parent, which is not this process.
    Ended,
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Status::Exited(0) => f.write_str("ended by itself"),
            Status::Exited(status) => write!(f, "ended by itself with status {status}"),
            Status::Killed { signal, core } => {
                match signal_words(*signal) {
                    Some((name, meaning)) => write!(f, "was ended by {name} ({meaning})")?,
                    None => write!(f, "was ended by signal {signal}")?,
                }
                f.write_str(if *core { "; a core dump was written" } else { "" })
            }
            Status::Ended => f.write_str("has ended"),
        }
    }
}

/// Returns the name and meaning of a signal that terminates processes.
fn signal_words(signal: i32) -> Option<(&'static str, &'static str)> {
    Some(match signal {
        libc::SIGKILL => ("SIGKILL", "it was killed, or memory ran out"),
        libc::SIGSEGV => ("SIGSEGV", "an invalid memory access"),
        libc::SIGBUS => ("SIGBUS", "an access to memory that does not exist"),
        libc::SIGFPE => ("SIGFPE", "an arithmetic error"),
        libc::SIGILL => ("SIGILL", "an illegal instruction"),
        libc::SIGABRT => ("SIGABRT", "it aborted"),
        libc::SIGTERM => ("SIGTERM", "it was asked to end"),
        libc::SIGINT => ("SIGINT", "it was interrupted"),
        libc::SIGHUP => ("SIGHUP", "its terminal was closed"),
        libc::SIGQUIT => ("SIGQUIT", "it was asked to quit"),
        libc::SIGPIPE => ("SIGPIPE", "it wrote to a pipe without a reader"),
        libc::SIGALRM => ("SIGALRM", "an alarm"),
        libc::SIGTRAP => ("SIGTRAP", "a trap"),
        libc::SIGSYS => ("SIGSYS", "a forbidden system call"),
        libc::SIGXCPU => ("SIGXCPU", "its limit of processor time was reached"),
        libc::SIGXFSZ => ("SIGXFSZ", "its limit of file size was reached"),
        libc::SIGUSR1 => ("SIGUSR1", "a signal of a user"),
        libc::SIGUSR2 => ("SIGUSR2", "a signal of a user"),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_end_is_said_in_words() {
        let said = |status: Status| status.to_string();
        assert_eq!(said(Status::Exited(0)), "ended by itself");
        assert_eq!(said(Status::Exited(3)), "ended by itself with status 3");
        assert_eq!(said(Status::Killed { signal: libc::SIGSEGV, core: true }), "was ended by SIGSEGV (an invalid memory access); a core dump was written");
        assert_eq!(said(Status::Killed { signal: 64, core: false }), "was ended by signal 64");
    }
}
