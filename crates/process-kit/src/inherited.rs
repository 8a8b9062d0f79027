// SPDX-License-Identifier: Apache-2.0
//! Descriptors that a process inherits. One environment variable contains their names and numbers.
use std::fmt;
use std::os::fd::{FromRawFd, OwnedFd, RawFd};
use std::sync::{Mutex, PoisonError};

/// Environment variable that contains `name=number` for each descriptor, separated by commas.
pub const DESCRIPTORS: &str = "OPENGPAC_DESCRIPTORS";

/// Descriptor numbers that have been taken, because a descriptor has only one owner.
static TAKEN: Mutex<Vec<RawFd>> = Mutex::new(Vec::new());

/// Takes the descriptor that this process inherited as `name`, once. Processes started by this one do not inherit it.
///
/// # Errors
/// [`NotInherited`], which contains the requested name and the inherited ones.
pub fn inherited(name: &str) -> Result<OwnedFd, NotInherited> {
    let given = std::env::var(DESCRIPTORS).unwrap_or_default();
    let refuse = |problem: &str| NotInherited { name: name.to_owned(), given: given.clone(), problem: problem.to_owned() };
    let number = number_of(&given, name).ok_or_else(|| refuse("it was not passed"))?;
    let mut taken = TAKEN.lock().unwrap_or_else(PoisonError::into_inner);
    if taken.contains(&number) {
        return Err(refuse("it was already taken"));
    }
    // SAFETY: sets a flag of a descriptor; a number that is none is refused by the operating system.
    if unsafe { libc::fcntl(number, libc::F_SETFD, libc::FD_CLOEXEC) } != 0 {
        return Err(refuse("it is not open"));
    }
    taken.push(number);
    // SAFETY: it is open, was passed to this process to be taken by name, and is taken once.
    Ok(unsafe { OwnedFd::from_raw_fd(number) })
}

fn number_of(given: &str, name: &str) -> Option<RawFd> {
    let number = given.split(',').find_map(|one| one.strip_prefix(name)?.strip_prefix('='))?;
    // 0 to 2 are the process's standard streams.
    number.parse().ok().filter(|number| *number > 2)
}

/// Error: an inherited descriptor is missing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NotInherited {
    /// Requested name.
    pub name: String,
    /// Value of the environment variable.
    pub given: String,
    /// Human-readable description of the problem.
    pub problem: String,
}

impl fmt::Display for NotInherited {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let NotInherited { name, given, problem } = self;
        write!(f, "there is no descriptor '{name}': {problem} ({DESCRIPTORS}='{given}'); let OpenGPAC start this process: it cannot be started by hand")
    }
}

impl std::error::Error for NotInherited {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_descriptor_is_found_by_its_whole_name() {
        assert_eq!(number_of("link=3,heartbeat=4", "heartbeat"), Some(4));
        assert_eq!(number_of("link=3,heartbeat=4", "heart"), None);
        assert_eq!(number_of("link=0", "link"), None);
        assert_eq!(number_of("link=x", "link"), None);
        assert_eq!(number_of("", "link"), None);
    }

    #[test]
    fn what_was_not_passed_is_refused_by_name() {
        let refused = inherited("nothing of this name").expect_err("it was not passed");
        assert!(refused.to_string().contains("'nothing of this name': it was not passed"), "{refused}");
    }
}
