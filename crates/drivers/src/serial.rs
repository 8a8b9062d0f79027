// SPDX-License-Identifier: Apache-2.0
//! A serial line: opened raw and exclusively, read with a deadline. A pseudo terminal is also a serial line, so that all layers above can
//! be tested without a cable.
//!
//! No function here allocates after [`SerialLine::open`]. Each wait is bounded by the caller's deadline.
use forks::Device;
use serde::Deserialize;
use std::fs::{File, OpenOptions};
use std::io::{Error, ErrorKind, Read, Result, Write};
use std::os::fd::{AsFd, AsRawFd, BorrowedFd};
use std::os::unix::fs::OpenOptionsExt;
use std::time::{Duration, Instant};

/// Parity bit of each byte.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Parity {
    #[default]
    None,
    Even,
    Odd,
}

/// Settings of a line with 8 data bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Settings {
    /// Baud rate: any rate that the interface can generate, not only standard ones.
    pub baud: u32,
    pub parity: Parity,
    /// 1 or 2.
    pub stop_bits: u8,
}

impl Default for Settings {
    fn default() -> Self {
        Settings { baud: 115_200, parity: Parity::None, stop_bits: 1 }
    }
}

impl Settings {
    /// Returns the transmission time of one byte: start bit, 8 data bits, parity and stop bits.
    pub(crate) fn byte_time(&self) -> Duration {
        let bits = 9 + u32::from(self.parity != Parity::None) + u32::from(self.stop_bits);
        Duration::from_nanos(u64::from(bits) * 1_000_000_000 / u64::from(self.baud.max(1)))
    }
}

/// An open line.
#[derive(Debug)]
pub(crate) struct SerialLine {
    file: Device<File>,
}

/// Claims a line for this program: the lock signals this to programs that check it, and the terminal's exclusive flag keeps out the
/// others.
fn claim(file: &File) -> Result<()> {
    // SAFETY: the descriptor is open.
    if unsafe { libc::flock(file.as_raw_fd(), libc::LOCK_EX | libc::LOCK_NB) } != 0 {
        let why = Error::last_os_error();
        let busy = why.kind() == ErrorKind::WouldBlock;
        return Err(if busy { Error::new(ErrorKind::ResourceBusy, "another program uses it") } else { why });
    }
    // SAFETY: the descriptor is open, and the request has no argument.
    check(unsafe { libc::ioctl(file.as_raw_fd(), libc::TIOCEXCL) })
}

impl SerialLine {
    /// Opens `path` raw (no echo, no line editing, no flow control) and exclusively, and discards bytes received earlier.
    ///
    /// # Errors
    /// Fails if the path does not exist, is not a terminal, cannot be configured, or is in use by another program
    /// ([`ErrorKind::ResourceBusy`]).
    pub(crate) fn open(path: &str, settings: &Settings) -> Result<SerialLine> {
        // Non-blocking, so that neither a missing carrier nor a full buffer blocks the caller; `poll` waits.
        let file = OpenOptions::new().read(true).write(true).custom_flags(libc::O_NOCTTY | libc::O_NONBLOCK | libc::O_CLOEXEC).open(path)?;
        claim(&file)?;
        let line = SerialLine { file: Device::new(file) };
        line.set(settings)?;
        line.drain_input()?;
        Ok(line)
    }

    fn set(&self, settings: &Settings) -> Result<()> {
        // SAFETY: all zeros is a valid value of this struct of numbers.
        let mut terminal: libc::termios2 = unsafe { std::mem::zeroed() };
        // SAFETY: the descriptor is open, and the request writes one `termios2`.
        check(unsafe { libc::ioctl(self.raw(), libc::TCGETS2, &raw mut terminal) })?;
        terminal.c_iflag = libc::IGNBRK | if settings.parity == Parity::None { 0 } else { libc::INPCK | libc::IGNPAR };
        terminal.c_oflag = 0;
        terminal.c_lflag = 0;
        terminal.c_cflag = libc::CS8 | libc::CREAD | libc::CLOCAL | libc::BOTHER;
        terminal.c_cflag |= match settings.parity {
            Parity::None => 0,
            Parity::Even => libc::PARENB,
            Parity::Odd => libc::PARENB | libc::PARODD,
        };
        if settings.stop_bits == 2 {
            terminal.c_cflag |= libc::CSTOPB;
        }
        (terminal.c_ispeed, terminal.c_ospeed) = (settings.baud, settings.baud);
        // With 0 a read without data would look like the end of the line.
        (terminal.c_cc[libc::VMIN], terminal.c_cc[libc::VTIME]) = (1, 0);
        // SAFETY: the descriptor is open, and the request reads one `termios2`.
        check(unsafe { libc::ioctl(self.raw(), libc::TCSETS2, &raw const terminal) })
    }

    /// Reads the available bytes, at least one; returns `Ok(0)` if none had arrived by the deadline. After the deadline it does not
    /// block, and more than [`OVERTIME`] after it, it reads nothing.
    ///
    /// # Errors
    /// Fails if the line is lost: its adapter was unplugged, or the other end of the pseudo terminal was closed.
    pub(crate) fn read(&self, buffer: &mut [u8], deadline: Instant) -> Result<usize> {
        if is_overtime(deadline) {
            return Ok(0);
        }
        loop {
            match (&*self.file).read(buffer) {
                // A terminal without data would return `WouldBlock`, so this is its end.
                Ok(0) => return Err(Error::new(ErrorKind::UnexpectedEof, "the serial line has disappeared")),
                Err(why) if why.kind() == ErrorKind::WouldBlock => {}
                Err(why) if why.kind() == ErrorKind::Interrupted => continue,
                other => return other,
            }
            if !wait(self.as_fd(), libc::POLLIN, deadline)? {
                return Ok(0);
            }
        }
    }

    /// Writes all bytes to the line; their transmission may still be in progress on return.
    ///
    /// # Errors
    /// Fails if the line is lost, or has not accepted them by the deadline ([`ErrorKind::TimedOut`]).
    pub(crate) fn write_all(&self, mut bytes: &[u8], deadline: Instant) -> Result<()> {
        while !bytes.is_empty() {
            match (&*self.file).write(bytes) {
                Ok(taken) => bytes = &bytes[taken..],
                Err(why) if why.kind() == ErrorKind::Interrupted => {}
                Err(why) if why.kind() == ErrorKind::WouldBlock => {
                    if !wait(self.as_fd(), libc::POLLOUT, deadline)? {
                        return Err(Error::new(ErrorKind::TimedOut, "the serial line accepts no data"));
                    }
                }
                Err(why) => return Err(why),
            }
        }
        Ok(())
    }

    /// Discards received bytes that were not read.
    ///
    /// # Errors
    /// Fails if the line is lost.
    pub(crate) fn drain_input(&self) -> Result<()> {
        // SAFETY: the descriptor is open.
        check(unsafe { libc::tcflush(self.raw(), libc::TCIFLUSH) })
    }

    fn raw(&self) -> i32 {
        self.file.as_raw_fd()
    }
}

impl Drop for SerialLine {
    fn drop(&mut self) {
        // SAFETY: the descriptor is open, and the request has no argument. The flag is cleared because a pseudo terminal outlives this
        // end and would keep it.
        let _ = unsafe { libc::ioctl(self.raw(), libc::TIOCNXCL) };
        // SAFETY: the descriptor is open. The guard may have a copy of it, which would keep the lock: a lost device could not be opened
        // again.
        let _ = unsafe { libc::flock(self.raw(), libc::LOCK_UN) };
    }
}

impl AsFd for SerialLine {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.file.as_fd()
    }
}

/// Time after a deadline for which data is still read, because it may have arrived before the deadline while this thread was not
/// scheduled. After that, a loop that reads until no more data arrives ends, even if the other side never stops sending.
pub(crate) const OVERTIME: Duration = Duration::from_secs(2);

/// Returns true if a deadline has been exceeded by more than [`OVERTIME`].
pub(crate) fn is_overtime(deadline: Instant) -> bool {
    Instant::now() > deadline + OVERTIME
}

/// Waits until a descriptor is ready (`POLLIN`, `POLLOUT`) or has failed; returns false if the deadline is reached first, or has been
/// exceeded by [`OVERTIME`].
pub(crate) fn wait(of: BorrowedFd<'_>, events: i16, deadline: Instant) -> Result<bool> {
    if is_overtime(deadline) {
        return Ok(false);
    }
    loop {
        let left = deadline.saturating_duration_since(Instant::now());
        let mut asked = libc::pollfd { fd: of.as_raw_fd(), events, revents: 0 };
        let timeout = libc::timespec { tv_sec: left.as_secs().try_into().unwrap_or(libc::time_t::MAX), tv_nsec: left.subsec_nanos().into() };
        // SAFETY: the arguments are one `pollfd` and one `timespec`, both alive, and no signal mask.
        match unsafe { libc::ppoll(&raw mut asked, 1, &raw const timeout, std::ptr::null()) } {
            0 => return Ok(false),
            1.. => return Ok(true),
            _ => {
                let why = Error::last_os_error();
                if why.kind() != ErrorKind::Interrupted {
                    return Err(why);
                }
            }
        }
    }
}

fn check(answer: i32) -> Result<()> {
    if answer == 0 { Ok(()) } else { Err(Error::last_os_error()) }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use std::ffi::CStr;
    use std::os::fd::FromRawFd;

    /// Creates a pseudo terminal. Returns the end that plays the device, and the path of the other end.
    pub(crate) fn pty() -> (File, String) {
        // SAFETY: these are plain calls on a local descriptor; the name is copied out of a local buffer.
        unsafe {
            let master = libc::posix_openpt(libc::O_RDWR | libc::O_NOCTTY | libc::O_CLOEXEC);
            assert!(master >= 0 && libc::grantpt(master) == 0 && libc::unlockpt(master) == 0);
            let mut name = [0; 128];
            assert_eq!(libc::ptsname_r(master, name.as_mut_ptr(), name.len()), 0);
            (File::from_raw_fd(master), CStr::from_ptr(name.as_ptr()).to_str().expect("a path").to_owned())
        }
    }

    fn soon() -> Instant {
        Instant::now() + Duration::from_secs(30)
    }

    #[test]
    fn every_byte_passes_both_ways() {
        let (mut device, path) = pty();
        let line = SerialLine::open(&path, &Settings { baud: 1_000_000, parity: Parity::Even, stop_bits: 1 }).expect("it opens");
        let every: Vec<u8> = (0..=255).collect();
        line.write_all(&every, soon()).expect("it takes them");
        let mut got = vec![0; 256];
        device.read_exact(&mut got).expect("they come");
        assert_eq!(got, every);
        device.write_all(&every).expect("they go");
        let mut got: Vec<u8> = Vec::new();
        while got.len() < 256 {
            let mut some = [0; 64];
            let count = line.read(&mut some, soon()).expect("it reads");
            assert!(count > 0, "{} of 256 bytes came", got.len());
            got.extend_from_slice(&some[..count]);
        }
        assert_eq!(got, every);
    }

    #[test]
    fn a_forked_child_does_not_keep_a_line() {
        let (_device, path) = pty();
        let line = SerialLine::open(&path, &Settings::default()).expect("it opens");
        // SAFETY: the child makes only calls that are permitted between fork and exec, and ends there, with this thread at the latest.
        let child = unsafe { libc::fork() };
        if child == 0 {
            // SAFETY: as above.
            unsafe {
                libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL);
                libc::pause();
                libc::_exit(0)
            }
        }
        drop(line);
        let again = SerialLine::open(&path, &Settings::default());
        // SAFETY: the process is a child of this test, which is ended and reaped once.
        unsafe {
            libc::kill(child, libc::SIGKILL);
            libc::waitpid(child, std::ptr::null_mut(), 0);
        }
        again.expect("the lock has gone with the parent's descriptor");
    }

    #[test]
    fn it_waits_to_its_deadline_and_notices_the_end() {
        let (mut device, path) = pty();
        let line = SerialLine::open(&path, &Settings::default()).expect("it opens");
        let mut some = [0; 8];
        assert_eq!(line.read(&mut some, Instant::now()).expect("nothing is no fault"), 0);
        device.write_all(b"old").expect("it goes");
        assert!(wait(line.as_fd(), libc::POLLIN, soon()).expect("it is ready"));
        line.drain_input().expect("it is there");
        assert_eq!(line.read(&mut some, Instant::now()).expect("it is there"), 0, "what came before is gone");
        drop(device);
        assert!(line.read(&mut some, soon()).is_err());
    }

    #[test]
    fn a_line_that_was_given_back_is_free_though_a_guard_has_a_descriptor_of_it() {
        let (_device, path) = pty();
        let line = SerialLine::open(&path, &Settings::default()).expect("it opens");
        let _kept = line.as_fd().try_clone_to_owned().expect("a guard has it, too");
        drop(line);
        SerialLine::open(&path, &Settings::default()).expect("it opens again");
    }

    #[test]
    fn a_line_has_one_program() {
        let (_device, path) = pty();
        let line = SerialLine::open(&path, &Settings::default()).expect("it opens");
        let refused = SerialLine::open(&path, &Settings::default()).expect_err("it is taken").kind();
        assert_eq!(refused, ErrorKind::ResourceBusy);
        drop(line);
        SerialLine::open(&path, &Settings::default()).expect("it is free again");
        assert_eq!(SerialLine::open("/dev/null", &Settings::default()).expect_err("no terminal").kind(), Error::from_raw_os_error(libc::ENOTTY).kind());
    }

    #[test]
    fn a_byte_lasts_its_bits() {
        assert_eq!(Settings { baud: 9_600, ..Settings::default() }.byte_time(), Duration::from_nanos(1_041_666));
        assert_eq!(Settings { baud: 19_200, parity: Parity::Even, stop_bits: 1 }.byte_time(), Duration::from_nanos(572_916));
    }
}
