// SPDX-License-Identifier: Apache-2.0
//! A forked child inherits nothing of a device; the parent's close is the last one.
use forks::Device;
use std::io::{Read, Write};
use std::os::fd::AsRawFd;
use std::os::unix::net::UnixStream;
use std::time::Duration;

/// Forks a child that lives until it is killed, or until the calling thread ends. Returns its process id.
fn forked() -> libc::pid_t {
    // SAFETY: the child makes only calls that are permitted between fork and exec, and ends there.
    let child = unsafe { libc::fork() };
    if child == 0 {
        // SAFETY: as above.
        unsafe {
            libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL);
            libc::pause();
            libc::_exit(0)
        }
    }
    assert!(child > 0);
    child
}

#[test]
fn the_other_end_of_a_device_sees_it_close_while_a_child_lives() {
    let (ours, mut theirs) = UnixStream::pair().expect("two sockets");
    let device = Device::new(ours);
    (&*device).write_all(b"x").expect("it is there");
    let child = forked();
    (&*device).write_all(b"y").expect("the parent still has it");
    // A duplicate such as a guard has.
    let duplicate = device.try_clone().expect("a duplicate");
    let late = forked();
    drop((device, duplicate));
    let mut said = Vec::new();
    // If a child still had it, end of file would never come.
    theirs.set_read_timeout(Some(Duration::from_secs(60))).expect("a socket");
    theirs.read_to_end(&mut said).expect("its end, though the child lives");
    assert_eq!(said, b"xy");
    // A later file with the same descriptor number is shared by parent and child.
    let (kept, mut other) = UnixStream::pair().expect("two sockets");
    let second = forked();
    drop(kept);
    other.set_nonblocking(true).expect("a socket");
    assert!(other.read(&mut [0]).is_err_and(|why| why.kind() == std::io::ErrorKind::WouldBlock), "a file that is no device stays in the child");
    // SAFETY: children of this test, each of which is ended and reaped once.
    unsafe {
        for child in [child, late, second] {
            libc::kill(child, libc::SIGKILL);
            assert_eq!(libc::waitpid(child, std::ptr::null_mut(), 0), child);
        }
    }
}

/// Forks three generations of children, each of which writes its findings to `told` and ends.
fn told_by_descendants(told: i32, descriptors: [i32; 2]) {
    // SAFETY: the children make only calls that are permitted between fork and exec, and each ends here.
    unsafe {
        let child = libc::fork();
        assert!(child >= 0);
        if child > 0 {
            libc::waitpid(child, std::ptr::null_mut(), 0);
            return;
        }
        for _ in 0..3 {
            let flags = descriptors.map(|descriptor| libc::fcntl(descriptor, libc::F_GETFD) as i8 as u8);
            libc::write(told, flags.as_ptr().cast(), flags.len());
            let next = libc::fork();
            if next != 0 {
                libc::waitpid(next, std::ptr::null_mut(), 0);
                libc::_exit(0);
            }
        }
        libc::_exit(0)
    }
}

#[test]
fn a_child_of_a_child_keeps_what_stands_in_the_place_of_a_device() {
    let device = Device::new(UnixStream::pair().expect("two sockets").0);
    // SAFETY: a descriptor of this test; it stays open across exec, as the standard input of a service does.
    let input = unsafe { libc::open(c"/dev/null".as_ptr(), libc::O_RDONLY) };
    let (mut heard, told) = UnixStream::pair().expect("two sockets");
    told_by_descendants(told.as_raw_fd(), [input, device.as_raw_fd()]);
    drop(told);
    let mut flags = Vec::new();
    heard.set_read_timeout(Some(Duration::from_secs(60))).expect("a socket");
    heard.read_to_end(&mut flags).expect("all children have ended");
    let close_on_exec = libc::FD_CLOEXEC as u8;
    assert_eq!(flags, [0, close_on_exec].repeat(3), "its own file stays open when a program is executed; the device's number stays taken");
}
