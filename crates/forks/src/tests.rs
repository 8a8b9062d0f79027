// SPDX-License-Identifier: Apache-2.0
//! A forked child finds nothing of a device; the parent's close is the last one.
use crate::Device;
use std::io::{Read, Write};
use std::os::unix::net::UnixStream;

/// Forks a child that waits until `go` is closed; its process id.
fn forked_while(go: &UnixStream) -> libc::pid_t {
    use std::os::fd::AsRawFd;
    let gate = go.as_raw_fd();
    // SAFETY: the child calls nothing but what it may between fork and exec, and ends.
    match unsafe { libc::fork() } {
        0 => {
            let mut byte = 0u8;
            // SAFETY: a byte of ours; it waits for the end of the gate.
            unsafe {
                libc::read(gate, (&raw mut byte).cast(), 1);
                libc::_exit(0)
            }
        }
        child => child,
    }
}

#[test]
fn the_other_end_of_a_device_sees_it_close_while_a_child_lives() {
    let (gate, open) = UnixStream::pair().expect("two sockets");
    let (ours, mut theirs) = UnixStream::pair().expect("two sockets");
    let device = Device::new(ours);
    (&*device).write_all(b"x").expect("it is there");
    let child = forked_while(&gate);
    assert!(child > 0);
    (&*device).write_all(b"y").expect("the parent still has it");
    // As a guard has one.
    let duplicate = device.try_clone().expect("a duplicate");
    let late = forked_while(&gate);
    drop((device, duplicate));
    let mut said = Vec::new();
    theirs.read_to_end(&mut said).expect("its end, though the child lives");
    assert_eq!(said, b"xy");
    // What had the same number since is the parent's and the child's.
    let (kept, mut other) = UnixStream::pair().expect("two sockets");
    let second = forked_while(&gate);
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
    drop(open);
}
