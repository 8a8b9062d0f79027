// SPDX-License-Identifier: Apache-2.0
//! Unix sockets by which processes of one user find one another, in folders that only this user can enter.
use crate::UnixLink;
use std::io;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, FromRawFd, OwnedFd};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Waits for links at a path, which is removed when the listener is dropped.
#[derive(Debug)]
pub struct Listener {
    socket: UnixListener,
    path: PathBuf,
}

/// Maximum number of pending connections.
const WAITING_MAX: i32 = 16;
/// Maximum time for which [`connect`] waits for space in the queue of pending connections, and the time between two attempts.
const CONNECT_MAX: Duration = Duration::from_secs(5);
const TRY_AGAIN: Duration = Duration::from_millis(5);

impl Listener {
    /// Listens at `path`, with mode 0600, replacing a socket left behind by a dead process.
    ///
    /// # Errors
    /// `AddrInUse` if a process listens there; otherwise the error of the operating system, for example if the path is longer than 107
    /// bytes.
    pub fn listen(path: &Path) -> io::Result<Listener> {
        let socket = match bind(path) {
            Err(error) if error.kind() == io::ErrorKind::AddrInUse && is_abandoned(path) => {
                std::fs::remove_file(path)?;
                bind(path)?
            }
            other => other?,
        };
        socket.set_nonblocking(true)?;
        Ok(Listener { socket, path: path.to_owned() })
    }

    /// Returns the next pending link, if any; rejects processes of other users.
    ///
    /// # Errors
    /// Fails if no descriptors are left.
    pub fn accept(&self) -> io::Result<Option<UnixLink>> {
        loop {
            let link = match self.socket.accept() {
                Ok((socket, _)) => UnixLink::of(socket)?,
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(None),
                Err(error) if matches!(error.kind(), io::ErrorKind::Interrupted | io::ErrorKind::ConnectionAborted) => continue,
                Err(error) => return Err(error),
            };
            if link.peer().is_ok_and(|(user, _)| user == user_id()) {
                return Ok(Some(link));
            }
        }
    }

    /// Waits for at most `limit` until a link is pending; returns true if one is.
    pub fn wait(&self, limit: Duration) -> bool {
        let mut poll = libc::pollfd { fd: self.socket.as_raw_fd(), events: libc::POLLIN, revents: 0 };
        // SAFETY: one entry of our own.
        unsafe { libc::poll(&mut poll, 1, i32::try_from(limit.as_millis()).unwrap_or(i32::MAX)) > 0 }
    }

    /// Returns the path of the socket.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl AsFd for Listener {
    /// Returns the socket, so that it can be polled with others.
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        // It may have been removed already.
        let _removed = std::fs::remove_file(&self.path);
    }
}

/// Connects to the process that listens at `path`.
///
/// # Errors
/// `NotFound` or `ConnectionRefused` if no process listens there; `TimedOut` if one does, but has not accepted earlier connections for several seconds.
pub fn connect(path: &Path) -> io::Result<UnixLink> {
    connect_within(path, CONNECT_MAX)
}

/// Connects as [`connect`] does, and waits for at most `limit` until the queue of pending connections has space. A stopped process
/// accepts no connections.
///
/// # Errors
/// Same as for [`connect`].
pub fn connect_within(path: &Path, limit: Duration) -> io::Result<UnixLink> {
    let begun = Instant::now();
    loop {
        match try_to_connect(path) {
            Err(error) if error.kind() == io::ErrorKind::WouldBlock && begun.elapsed() < limit => std::thread::sleep(TRY_AGAIN),
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                let (path, limit) = (path.display(), limit.as_secs_f64());
                let message = format!("the process that listens at '{path}' has not taken a connection for {limit} s; resume it or end it");
                return Err(io::Error::new(io::ErrorKind::TimedOut, message));
            }
            other => return UnixLink::of(other?),
        }
    }
}

/// Returns true if no process listens at the socket `path`, because the process was killed.
pub fn is_abandoned(path: &Path) -> bool {
    matches!(try_to_connect(path), Err(error) if error.kind() == io::ErrorKind::ConnectionRefused)
}

/// Connects to a listening process, without waiting. Fails with `WouldBlock` if the process has not accepted earlier connections.
fn try_to_connect(path: &Path) -> io::Result<UnixStream> {
    let (socket, (address, len)) = (socket()?, address(path)?);
    let stream = UnixStream::from(socket);
    stream.set_nonblocking(true)?;
    // SAFETY: the address has the length given; the descriptor is our own.
    if unsafe { libc::connect(stream.as_raw_fd(), (&raw const address).cast(), len) } != 0 {
        return Err(io::Error::last_os_error());
    }
    stream.set_nonblocking(false)?;
    Ok(stream)
}

fn socket() -> io::Result<OwnedFd> {
    // SAFETY: makes a socket, which is owned at once.
    unsafe {
        match libc::socket(libc::AF_UNIX, libc::SOCK_STREAM | libc::SOCK_CLOEXEC, 0) {
            made if made >= 0 => Ok(OwnedFd::from_raw_fd(made)),
            _ => Err(io::Error::last_os_error()),
        }
    }
}

/// Returns the address of a socket at `path`, and its length.
fn address(path: &Path) -> io::Result<(libc::sockaddr_un, libc::socklen_t)> {
    // SAFETY: all zeroes is an address without a name.
    let mut address: libc::sockaddr_un = unsafe { std::mem::zeroed() };
    let name = path.as_os_str().as_bytes();
    if name.is_empty() || name.len() >= address.sun_path.len() || name.contains(&0) {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, format!("'{}' cannot be the path of a socket: at most 107 bytes", path.display())));
    }
    address.sun_family = libc::AF_UNIX as libc::sa_family_t;
    for (place, byte) in address.sun_path.iter_mut().zip(name) {
        *place = *byte as libc::c_char;
    }
    let len = (std::mem::offset_of!(libc::sockaddr_un, sun_path) + name.len() + 1) as libc::socklen_t;
    Ok((address, len))
}

/// Creates a listening socket whose mode is set before its name becomes visible.
fn bind(path: &Path) -> io::Result<UnixListener> {
    let (socket, (address, len)) = (socket()?, address(path)?);
    // SAFETY: the address has the length given; the descriptor is our own.
    let listens = unsafe {
        libc::fchmod(socket.as_raw_fd(), 0o600) == 0
            && libc::bind(socket.as_raw_fd(), (&raw const address).cast(), len) == 0
            && libc::listen(socket.as_raw_fd(), WAITING_MAX) == 0
    };
    if listens { Ok(UnixListener::from(socket)) } else { Err(io::Error::last_os_error()) }
}

fn user_id() -> u32 {
    // SAFETY: always succeeds.
    unsafe { libc::geteuid() }
}

/// Returns the folder of this user's sockets: `opengpac` in `XDG_RUNTIME_DIR` or, if that is not set, `opengpac-USER` in the temporary
/// folder. Creates it with mode 0700 if necessary.
///
/// # Errors
/// `PermissionDenied` if it was created by another user, or other users may enter it.
pub fn run_folder() -> io::Result<PathBuf> {
    let folder = match std::env::var_os("XDG_RUNTIME_DIR") {
        Some(folder) if Path::new(&folder).is_dir() => Path::new(&folder).join("opengpac"),
        _ => std::env::temp_dir().join(format!("opengpac-{}", user_id())),
    };
    match std::fs::DirBuilder::new().mode(0o700).create(&folder) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(error),
        _ => {}
    }
    let about = std::fs::symlink_metadata(&folder)?;
    if !about.is_dir() || about.uid() != user_id() || about.mode() & 0o077 != 0 {
        let message = format!("'{}' is not a folder of this user alone; remove it", folder.display());
        return Err(io::Error::new(io::ErrorKind::PermissionDenied, message));
    }
    Ok(folder)
}

/// Creates a new folder in [`run_folder`], with mode 0700. The caller must remove it.
///
/// # Errors
/// Same as for [`run_folder`].
pub fn fresh_folder() -> io::Result<PathBuf> {
    let folder = run_folder()?;
    let process = std::process::id();
    let mut number = crate::now_ns();
    loop {
        let fresh = folder.join(format!("{process:x}-{number:x}"));
        match std::fs::DirBuilder::new().mode(0o700).create(&fresh) {
            Ok(()) => return Ok(fresh),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => number += 1,
            Err(error) => return Err(error),
        }
    }
}
