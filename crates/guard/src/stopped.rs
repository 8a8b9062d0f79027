// SPDX-License-Identifier: Apache-2.0
//! Detection of stopped processes. The operating system reports this state, and a stopped process does nothing, whatever the load of the
//! machine.
use process_kit::pid_of;
use std::fs::File;
use std::io::Read;
use std::os::fd::BorrowedFd;

/// Buffer for the relevant part of the line: number, name (at most 64 bytes), state.
const LINE: usize = 256;

/// State file of one process.
#[derive(Clone, Debug)]
pub(crate) struct Stops(Option<String>);

impl Stops {
    pub fn of(process: BorrowedFd<'_>) -> Stops {
        // A process that has ended has no state.
        Stops(pid_of(process).ok().filter(|pid| *pid > 0).map(|pid| format!("/proc/{pid}/stat")))
    }

    /// Returns true if the process is currently stopped, by a signal or by a debugger.
    pub fn now(&self) -> bool {
        let mut line = [0; LINE];
        let read = self.0.as_ref().and_then(|path| File::open(path).and_then(|mut file| file.read(&mut line)).ok());
        read.is_some_and(|len| is_stopped(&line[..len]))
    }
}

/// Returns true if the line `1234 (name) T …` describes a stopped process. The name may contain any characters; only numbers follow the
/// state.
fn is_stopped(line: &[u8]) -> bool {
    let name_end = line.iter().rposition(|byte| *byte == b')');
    name_end.and_then(|end| line.get(end + 2)).is_some_and(|state| matches!(state, b'T' | b't'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_state_is_found_behind_any_name() {
        assert!(is_stopped(b"12 (python) T 1 12 12 0 -1 4194304 "));
        assert!(is_stopped(b"12 (a) S (b) t 1 12 12 0 "));
        assert!(!is_stopped(b"12 (a) T (b) S 1 12 12 0 "));
        assert!(!is_stopped(b"12 (T) R 1 12 12 0 "));
        assert!(!is_stopped(b"") && !is_stopped(b"12 (T)"));
    }

    #[test]
    fn this_process_is_not_stopped() {
        use std::os::fd::AsFd;
        let this = process_kit::this_process().unwrap();
        assert!(Stops::of(this.as_fd()).0.is_some() && !Stops::of(this.as_fd()).now());
    }
}
