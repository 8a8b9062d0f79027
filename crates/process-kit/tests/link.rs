// SPDX-License-Identifier: Apache-2.0
//! The link between two processes: whole frames, in order, with descriptors, and an end visible to both sides.
use interconnect::{Link, LinkClosed};
use process_kit::{FRAME_LEN_MAX, Listener, SharedMemory, UnixLink, connect, connect_within, fresh_folder, is_abandoned, run_folder};
use proptest::prelude::*;
use std::io::Write;
use std::os::fd::AsFd;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixStream;
use std::sync::atomic::Ordering;
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(300);

fn pair() -> (UnixLink, UnixLink) {
    let (ours, theirs) = UnixLink::pair().unwrap();
    (ours, UnixLink::from_descriptor(theirs).unwrap())
}

#[test]
fn frames_come_whole_in_order_and_both_ways() {
    let (a, b) = pair();
    for frame in [&b""[..], b"one", b"two"] {
        a.send(frame).unwrap();
    }
    b.send(b"back").unwrap();
    assert_eq!([b.receive(LIMIT), b.receive(LIMIT), b.receive(LIMIT)], [Ok(Some(vec![])), Ok(Some(b"one".to_vec())), Ok(Some(b"two".to_vec()))]);
    assert_eq!(a.receive(LIMIT), Ok(Some(b"back".to_vec())));
    assert_eq!(a.receive(Duration::ZERO), Ok(None));
}

#[test]
fn a_frame_of_the_greatest_length_comes_whole_and_a_longer_one_closes() {
    let (a, b) = pair();
    let frame: Vec<u8> = (0..FRAME_LEN_MAX).map(|i| (i % 251) as u8).collect();
    std::thread::scope(|scope| {
        scope.spawn(|| a.send(&frame).unwrap());
        assert!(b.receive(LIMIT).unwrap().expect("in time") == frame);
    });
    assert_eq!(a.send(&vec![0; FRAME_LEN_MAX + 1]), Err(LinkClosed));
    assert_eq!(b.receive(LIMIT), Err(LinkClosed));
}

#[test]
fn what_was_sent_before_the_end_is_received_before_it() {
    let (a, b) = pair();
    a.send(b"last words").unwrap();
    drop(a);
    assert_eq!(b.receive(LIMIT), Ok(Some(b"last words".to_vec())));
    assert_eq!(b.receive(LIMIT), Err(LinkClosed));
    assert_eq!(b.send(b"hello?"), Err(LinkClosed));
}

#[test]
fn closing_ends_a_send_and_a_receive_that_wait() {
    let (a, b) = pair();
    std::thread::scope(|scope| {
        let sending = scope.spawn(|| while a.send(&[0; 4096]).is_ok() {});
        let receiving = scope.spawn(|| a.receive(LIMIT));
        b.close();
        sending.join().unwrap();
        assert_eq!(receiving.join().unwrap(), Err(LinkClosed));
    });
}

#[test]
fn who_does_not_read_is_dropped_where_a_limit_says_so() {
    let (a, _b) = pair();
    let sent = (0..10_000).map(|_| a.send_with(&[0; 4096], &[], Some(Duration::ZERO))).find(Result::is_err);
    assert_eq!(sent, Some(Err(LinkClosed)));
    assert_eq!(a.send(b"more"), Err(LinkClosed));
}

#[test]
fn descriptors_arrive_with_their_frame() {
    let (a, b) = pair();
    let memories: Vec<SharedMemory> = (0..3).map(|_| SharedMemory::new(8).unwrap()).collect();
    a.send(b"none").unwrap();
    a.send_with(b"two", &[memories[0].as_fd(), memories[1].as_fd()], None).unwrap();
    a.send_with(b"", &[memories[2].as_fd()], None).unwrap();
    memories.iter().zip(1..).for_each(|(memory, value)| memory.word(0).store(value, Ordering::Release));
    let mut values = Vec::new();
    for (frame, count) in [(&b"none"[..], 0), (b"two", 2), (b"", 1)] {
        let (bytes, descriptors) = b.receive_with(LIMIT).unwrap().expect("in time");
        assert_eq!((bytes.as_slice(), descriptors.len()), (frame, count));
        values.extend(descriptors.into_iter().map(|descriptor| SharedMemory::received(descriptor, 8).unwrap().word(0).load(Ordering::Acquire)));
    }
    assert_eq!(values, [1, 2, 3]);
}

#[test]
fn what_is_no_shared_memory_is_refused() {
    let file: std::os::fd::OwnedFd = std::fs::File::open("/dev/null").unwrap().into();
    assert!(SharedMemory::received(file, 8).is_err());
    assert!(SharedMemory::received(SharedMemory::new(8).unwrap().descriptor().unwrap(), 16).is_err());
}

#[test]
fn processes_of_a_user_find_each_other_by_a_path() {
    let folder = fresh_folder().unwrap();
    let mode = |path: &std::path::Path| std::fs::metadata(path).unwrap().permissions().mode() & 0o777;
    let path = folder.join("guard");
    assert_eq!(connect(&path).unwrap_err().kind(), std::io::ErrorKind::NotFound);
    let listener = Listener::listen(&path).unwrap();
    assert_eq!((mode(&run_folder().unwrap()), mode(&folder), mode(&path)), (0o700, 0o700, 0o600));
    assert!(listener.accept().unwrap().is_none());
    assert_eq!(Listener::listen(&path).unwrap_err().kind(), std::io::ErrorKind::AddrInUse);
    // The failed attempt had connected to check the address.
    drop(listener.accept().unwrap());
    let there = connect(&path).unwrap();
    let here = listener.accept().unwrap().expect("one waits");
    there.send(b"hello").unwrap();
    assert_eq!(here.receive(LIMIT), Ok(Some(b"hello".to_vec())));
    assert_eq!(here.peer().unwrap().1, std::process::id().cast_signed());
    drop(listener);
    assert!(!path.exists());
    // The state that a killed process leaves.
    drop(std::os::unix::net::UnixListener::bind(&path).unwrap());
    drop(Listener::listen(&path).expect("nobody listens there"));
    std::fs::remove_dir(folder).unwrap();
}

#[test]
fn a_listener_that_takes_no_connection_is_not_waited_for_without_end() {
    let folder = fresh_folder().unwrap();
    let path = folder.join("stopped");
    let listener = Listener::listen(&path).unwrap();
    let brief = Duration::from_millis(20);
    let mut pending = Vec::new();
    let refused = loop {
        match connect_within(&path, brief) {
            Ok(link) => pending.push(link),
            Err(error) => break error,
        }
        assert!(pending.len() < 1000, "the queue of a listener has an end");
    };
    assert_eq!(refused.kind(), std::io::ErrorKind::TimedOut);
    assert!(refused.to_string().contains("has not taken a connection for 0.02 s"), "{refused}");
    assert!(!is_abandoned(&path), "the process that listens is alive");
    assert!(listener.accept().unwrap().is_some());
    connect_within(&path, LIMIT).expect("there is room again");
    drop(listener);
    std::fs::remove_dir(folder).unwrap();
}

/// Sends raw bytes and closes; returns the frames received and whether the link closed.
fn received(bytes: &[u8]) -> (Vec<Vec<u8>>, bool) {
    let (mut raw, theirs) = UnixStream::pair().unwrap();
    let link = UnixLink::from_descriptor(theirs.into()).unwrap();
    std::thread::scope(|scope| {
        // After invalid bytes the link is closed while this side still writes.
        scope.spawn(move || raw.write_all(bytes));
        let mut frames = Vec::new();
        loop {
            match link.receive(LIMIT) {
                Ok(Some(frame)) => frames.push(frame),
                Ok(None) => return (frames, false),
                Err(LinkClosed) => return (frames, true),
            }
        }
    })
}

proptest! {
    #[test]
    fn any_bytes_give_frames_or_a_closed_link(bytes in prop::collection::vec(prop_oneof![4 => Just(0u8), 1 => any::<u8>()], 0..400)) {
        let (frames, is_closed) = received(&bytes);
        prop_assert!(is_closed);
        prop_assert!(frames.iter().map(|frame| frame.len() + 8).sum::<usize>() <= bytes.len());
    }

    #[test]
    fn frames_come_as_they_were_sent_however_the_bytes_are_cut(
        frames in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..50), 0..10), cut in 0usize..600,
    ) {
        let whole: Vec<u8> = frames.iter().flat_map(|frame| [&(frame.len() as u32).to_le_bytes()[..], &[0; 4], frame].concat()).collect();
        let cut = cut.min(whole.len());
        let (came, is_closed) = received(&whole[..cut]);
        prop_assert!(is_closed);
        prop_assert_eq!(&frames[..came.len()], came.as_slice());
        prop_assert!(cut < whole.len() || came.len() == frames.len());
    }
}

#[test]
fn a_header_that_promises_too_much_closes_the_link_at_once() {
    for header in
        [[(FRAME_LEN_MAX as u32 + 1).to_le_bytes(), 0u32.to_le_bytes()], [0u32.to_le_bytes(), 17u32.to_le_bytes()], [0u32.to_le_bytes(), 1u32.to_le_bytes()]]
    {
        assert_eq!(received(&header.concat()), (vec![], true));
    }
}
