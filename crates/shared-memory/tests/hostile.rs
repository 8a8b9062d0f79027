// SPDX-License-Identifier: Apache-2.0
//! A hostile process that writes arbitrary bytes to a connection's memory: the ends of others neither panic nor wait nor access anything
//! outside it, and the connection is lost with a reason or continues.
mod processes;

use interconnect::{ConnectionSpec, Ends};
use processes::folders;
use proptest::prelude::*;
use shared_memory::{SealedMemory, SharedMemory, new_run};
use std::fs::File;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::time::{Duration, Instant};

const SPEC: ConnectionSpec = ConnectionSpec { writer: 3, reader: 5, asynchronous_len: 40, queue_row_len: 24, queue_depth: 4 };
const WORDS: usize = 7 * 64;
/// Total number of writes, of the property and of the thread.
const WRITES: usize = 1_000_000;
const SPECIAL: [u64; 14] = [0, 1, 2, 3, 4, 5, 6, 7, 255, 1 << 31, u32::MAX as u64, 1 << 63, u64::MAX - 1, u64::MAX];

fn nobody() -> Box<dyn Fn() + Send + Sync> {
    Box::new(|| ())
}

/// Pseudo-random numbers from a seed.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed ^ (mixed >> 27)
    }

    fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit as u64) as usize
    }
}

/// Maps the memory of a file in the run's folder, as any process of the same user can.
fn memory_of(path: &Path) -> SealedMemory {
    let file = File::options().read(true).write(true).open(path).expect("it is offered");
    let len = file.metadata().expect("it is open").len() as usize;
    SealedMemory::received(file.into(), len).expect("what is offered is sealed")
}

fn folder(system: &str) -> PathBuf {
    folders(system).pop().expect("the run has a folder")
}

/// Makes one write of a hostile process, mostly to the control words.
fn write(memory: &SealedMemory, numbers: &mut Numbers) {
    let end = if numbers.below(10) < 7 { WORDS.min(memory.len()) } else { memory.len() };
    let at = numbers.below(end);
    // SAFETY: within the mapping; bytes are aligned.
    let byte = |at: usize| unsafe { AtomicU8::from_ptr(memory.start().add(at)) };
    match numbers.below(5) {
        0 | 1 => byte(at).store(numbers.next() as u8, Ordering::Relaxed),
        2 | 3 => memory.word((at / 8 * 8).min(memory.len() / 8 * 8 - 8)).store(SPECIAL[numbers.below(SPECIAL.len())], Ordering::Relaxed),
        _ => (at..memory.len().min(at + 64)).for_each(|at| byte(at).store(numbers.next() as u8, Ordering::Relaxed)),
    }
}

/// Makes one of the calls of a source; each is bounded whatever the memory contains.
fn call(sender: &mut dyn interconnect::Sender, receiver: &mut dyn interconnect::Receiver, numbers: &mut Numbers) {
    match numbers.below(6) {
        0 => {
            sender.group().fill(7);
            sender.publish(1, 1);
        }
        1 => drop(sender.push(1, 1, &mut |row| row.fill(9))),
        2 => drop(receiver.latch(0)),
        3 => assert_eq!(receiver.group().len(), SPEC.asynchronous_len),
        4 => {
            let mut taken = 0;
            while receiver.peek_row().is_some_and(|(_, row)| row.len() == SPEC.queue_row_len) && receiver.pop_row() {
                taken += 1;
                assert!(taken <= 2 * SPEC.queue_depth, "rows have no end");
            }
        }
        _ => assert!(receiver.rows() <= SPEC.queue_depth),
    }
}

fn attacked(seed: u64, writes: usize) -> usize {
    let (system, run, mut numbers) = (format!("hostile-{:x}", new_run()), new_run(), Numbers(seed));
    let (mut here, mut there) = (SharedMemory::new(&system, run).expect("a member"), SharedMemory::new(&system, run).expect("a member"));
    let bells = std::fs::read_dir(folder(&system)).expect("a folder").flatten().map(|entry| entry.path());
    let bells = memory_of(&bells.into_iter().find(|path| path.to_string_lossy().contains("/bells-")).expect("there are bells"));
    let (mut done, mut lost, mut number) = (0, 0, 0);
    while done < writes {
        number += 1;
        let mut sender = here.sender(number, &SPEC).expect("the end is free");
        let mut receiver = there.receiver(number, &SPEC, nobody()).expect("the end is free");
        let memory = memory_of(&folder(&system).join(format!("c{number}-writing")));
        // SAFETY: the seals forbid it, as is checked here.
        assert_ne!(unsafe { libc::ftruncate(std::os::fd::AsRawFd::as_raw_fd(&std::os::fd::AsFd::as_fd(&memory)), 0) }, 0);
        for _ in 0..numbers.below(200) {
            done += 1;
            if numbers.below(8) == 0 {
                write(&bells, &mut numbers)
            } else {
                write(&memory, &mut numbers)
            };
            (0..numbers.below(4)).for_each(|_| call(&mut *sender, &mut *receiver, &mut numbers));
        }
        // A further end that opens the damaged memory is accepted or refused, and neither takes long.
        if numbers.below(4) == 0 {
            drop(sender);
            drop(here.sender(number, &SPEC).map_err(|error| assert!(error.message.contains("connection"), "{error}")));
        }
        let news: Vec<_> = here.lost().into_iter().chain(there.lost()).collect();
        assert!(news.len() <= 2 && news.iter().all(|news| (news.writer, news.reader) == (3, 5) && news.message.contains("overwritten")), "{news:?}");
        lost += news.len();
        assert_eq!(there.lost(), [], "it is told once");
    }
    // The listening thread, whose bell was overwritten, ends too.
    let since = Instant::now();
    drop((here, there));
    assert!(since.elapsed() < Duration::from_secs(60));
    assert_eq!(folders(&system), Vec::<PathBuf>::new());
    lost
}

#[test]
fn a_million_writes_between_the_calls_of_honest_ends() {
    let lost: usize = (0..10).map(|seed| attacked(seed, WRITES / 10)).sum();
    assert!(lost > 1000, "only {lost} ends noticed");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 20, ..ProptestConfig::default() })]

    #[test]
    fn any_seed(seed: u64) {
        attacked(seed, 300);
    }
}

#[test]
fn a_peer_that_never_stops_writing_makes_no_call_endless() {
    let (system, run) = (format!("hammered-{:x}", new_run()), new_run());
    let (mut here, mut there) = (SharedMemory::new(&system, run).expect("a member"), SharedMemory::new(&system, run).expect("a member"));
    let ends = AtomicBool::new(false);
    for number in 0..20 {
        let mut sender = here.sender(number, &SPEC).expect("the end is free");
        let mut receiver = there.receiver(number, &SPEC, nobody()).expect("the end is free");
        let memory = memory_of(&folder(&system).join(format!("c{number}-writing")));
        ends.store(false, Ordering::Relaxed);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                let mut numbers = Numbers(number);
                while !ends.load(Ordering::Relaxed) {
                    write(&memory, &mut numbers);
                }
            });
            let mut numbers = Numbers(!number);
            for _ in 0..2_000 {
                call(&mut *sender, &mut *receiver, &mut numbers);
            }
            ends.store(true, Ordering::Relaxed);
        });
    }
}

#[test]
fn what_a_peer_offers_instead_of_memory_is_refused_by_its_process() {
    let (system, run) = (format!("offers-{:x}", new_run()), new_run());
    let mut ends = SharedMemory::new(&system, run).expect("a member");
    let place = folder(&system).join("c1-writing");
    let me = std::process::id();
    let refused = |ends: &mut SharedMemory| ends.receiver(1, &SPEC, nobody()).map(|_| ()).expect_err("it is no memory").message;
    let file = File::open("/proc/self/exe").expect("this program");
    let (null, number) = (File::open("/dev/null").expect("a device"), |file: &File| std::os::fd::AsRawFd::as_raw_fd(file));
    for (leads_to, why) in [
        ("/etc/passwd".to_owned(), "not the memory of a process".to_owned()),
        (format!("/proc/{me}/fd/{}", number(&null)), format!("process {me} offers something that is not memory")),
        (format!("/proc/{me}/fd/{}", number(&file)), "".to_owned()),
    ] {
        symlink(&leads_to, &place).expect("a link");
        let message = refused(&mut ends);
        assert!(message.contains(&why), "{message}");
        std::fs::remove_file(&place).expect("it is ours");
    }
    // SAFETY: the name ends in NUL.
    let open = unsafe { libc::memfd_create(c"open".as_ptr(), libc::MFD_CLOEXEC | libc::MFD_ALLOW_SEALING) };
    // SAFETY: a descriptor created just above.
    let open: File = unsafe { std::os::fd::FromRawFd::from_raw_fd(open) };
    open.set_len(4096).expect("it is not sealed");
    symlink(format!("/proc/{me}/fd/{}", number(&open)), &place).expect("a link");
    let message = refused(&mut ends);
    assert!(message.contains("the memory is not sealed") && message.contains(&format!("process {me} offers it")), "{message}");
}

#[test]
fn a_process_that_is_stopped_with_a_lock_keeps_nobody_waiting_for_long() {
    let (system, run) = (format!("locked-{:x}", new_run()), new_run());
    let ends = SharedMemory::new(&system, run).expect("a member");
    let members = File::options().read(true).write(true).open(folder(&system).join("members")).expect("it is ours");
    let mut byte = libc::flock { l_type: libc::F_WRLCK as i16, l_whence: 0, l_start: 0, l_len: 0, l_pid: 0 };
    // SAFETY: the structure lives through the call.
    assert_eq!(unsafe { libc::fcntl(std::os::fd::AsRawFd::as_raw_fd(&members), libc::F_OFD_SETLK, &mut byte) }, 0);
    let refused = SharedMemory::new(&system, run).map(|_| ()).expect_err("somebody has every lock").message;
    assert!(refused.contains("another process has held a lock for 2 s"), "{refused}");
    drop(members);
    assert!(SharedMemory::new(&system, run).is_ok());
    drop(ends);
}
