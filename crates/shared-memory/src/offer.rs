// SPDX-License-Identifier: Apache-2.0
//! Offers, by which one process finds the memory of another. An offer is a link in the run's folder to a descriptor of the offering
//! process.
//!
//! A file in the folder is merely a name: it is never mapped, because any process that may open such a file may truncate it, and an
//! access beyond its end kills the process. The memory itself has no name, and its size is sealed; other processes verify the seals
//! before they map it. The link dangles once the offering process has exited.
use std::fs::{self, File, OpenOptions};
use std::io;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, OwnedFd};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt, symlink};
use std::path::{Path, PathBuf};

/// A link to a descriptor of this process, removed when dropped.
pub(crate) struct Offer(PathBuf);

impl Offer {
    /// Offers the memory of a descriptor under `path`, replacing the offer of another process. The descriptor must stay open as long as
    /// the offer exists.
    pub fn new(path: PathBuf, memory: BorrowedFd<'_>) -> io::Result<Offer> {
        match fs::remove_file(&path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        symlink(format!("/proc/{}/fd/{}", std::process::id(), memory.as_raw_fd()), &path)?;
        Ok(Offer(path))
    }
}

impl Drop for Offer {
    fn drop(&mut self) {
        // It may already have been removed with the folder.
        let _removed = fs::remove_file(&self.0);
    }
}

/// Returns the memory offered under `path`, and the process that offers it; `None` if there is no offer, or that process has exited.
///
/// # Errors
/// Fails, with a message that names the process, if the path is not an offer, or this process may not open it.
pub(crate) fn offered(path: &Path) -> io::Result<Option<(OwnedFd, u32)>> {
    let leads_to = match fs::read_link(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        leads_to => leads_to?,
    };
    let Some(process) = offering(&leads_to) else {
        return Err(io::Error::other(format!("'{}' leads to '{}', which is not the memory of a process", path.display(), leads_to.display())));
    };
    // First only resolved (`O_PATH`): opening some files has side effects, and opening others blocks.
    let found = match OpenOptions::new().read(true).custom_flags(libc::O_PATH).open(&leads_to) {
        Err(error) if matches!(error.raw_os_error(), Some(libc::ENOENT | libc::ESRCH)) => return Ok(None),
        Err(error) if error.kind() == io::ErrorKind::PermissionDenied && is_gone(process) => return Ok(None),
        Err(error) => {
            let text = format!("process {process} does not let this one open its memory ({error}); start both as the same user, with the same privileges");
            return Err(io::Error::new(error.kind(), text));
        }
        Ok(found) => found,
    };
    let kind = found.metadata()?.file_type();
    if !kind.is_file() || kind.is_fifo() {
        return Err(io::Error::other(format!("process {process} offers something that is not memory")));
    }
    let through = format!("/proc/self/fd/{}", found.as_fd().as_raw_fd());
    let memory: File = OpenOptions::new().read(true).write(true).custom_flags(libc::O_NONBLOCK | libc::O_NOCTTY).open(through)?;
    Ok(Some((memory.into(), process)))
}

/// Removes an offer left under `path` by a process that has exited. The caller must exclude concurrent offers.
pub(crate) fn remove_left(path: &Path) {
    if is_left(path) {
        // It may have been removed meanwhile.
        let _removed = fs::remove_file(path);
    }
}

/// Returns true if the offer under `path` belongs to a process that has exited.
pub(crate) fn is_left(path: &Path) -> bool {
    fs::read_link(path).ok().and_then(|leads_to| offering(&leads_to)).is_some_and(is_gone)
}

/// Returns the process to which a link refers.
pub(crate) fn offering(leads_to: &Path) -> Option<u32> {
    let (process, descriptor) = leads_to.to_str()?.strip_prefix("/proc/")?.split_once("/fd/")?;
    let _number: u32 = descriptor.parse().ok()?;
    process.parse().ok()
}

/// Returns true if a process has exited. Includes zombies, which no longer have descriptors.
fn is_gone(process: u32) -> bool {
    let about = fs::read_to_string(format!("/proc/{process}/stat"));
    about.map_or(true, |about| about.rsplit_once(')').is_some_and(|(_, rest)| matches!(rest.trim_start().chars().next(), Some('Z' | 'X'))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_descriptors_of_processes_are_followed() {
        assert_eq!(offering(Path::new("/proc/12/fd/3")), Some(12));
        for other in ["/etc/passwd", "/proc/self/fd/3", "/proc/12/fd/../mem", "/proc/12/mem", "/proc/12/fd/", "proc/12/fd/3", "/proc//fd/3"] {
            assert_eq!(offering(Path::new(other)), None, "{other}");
        }
    }

    #[test]
    fn what_a_living_process_offers_stays_and_that_of_a_dead_one_goes() {
        let mut child = std::process::Command::new("sleep").arg("600").spawn().expect("there is sleep");
        let path = std::env::temp_dir().join(format!("opengpac-offer-{}", std::process::id()));
        let _absent = fs::remove_file(&path);
        symlink(format!("/proc/{}/fd/0", child.id()), &path).expect("a name");
        remove_left(&path);
        assert!(path.is_symlink());
        child.kill().expect("it is our child");
        // A process that has not been waited for has ended too.
        while !is_left(&path) {
            std::hint::spin_loop();
        }
        child.wait().expect("it is our child");
        remove_left(&path);
        assert!(!path.is_symlink());
    }
}
