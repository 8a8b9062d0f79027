// SPDX-License-Identifier: Apache-2.0
//! Connections between hosts, over TCP on this machine: groups, rows, space, times.
mod common;
use common::*;
use hosts::{Clocks, Hosts, Options};
use interconnect::{ConnectionSpec, Ends};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

fn nobody() -> Box<dyn Fn() + Send + Sync> {
    Box::new(|| ())
}

#[test]
fn values_cross_in_either_direction() {
    let (mut a, endpoint) = listening("values");
    let mut b = Hosts::join(options_of("values", "cell-b", &endpoint)).expect("cell-a listens");
    assert!(a.wait_for("cell-b", LONG) && !a.wait_for("cell-c", std::time::Duration::ZERO));
    for (number, there) in [(1, true), (2, false)] {
        let (writer, reader) = if there { (&mut a, &mut b) } else { (&mut b, &mut a) };
        let mut sender = writer.sender(number, &SPEC).expect("there is room");
        let mut receiver = reader.receiver(number, &SPEC, nobody()).expect("there is room");
        assert!(!sender.arrived());
        for value in 1..=20 {
            publish(sender.as_mut(), value, monotonic_ns());
            let mut newest = 0;
            wait_until("the group", || {
                newest = latched(receiver.as_mut(), monotonic_ns()).map_or(newest, |(_, value)| value);
                newest == value
            });
        }
    }
}

#[test]
fn a_reader_that_comes_later_finds_the_newest_group() {
    let (mut a, endpoint) = listening("later");
    let mut sender = a.sender(7, &SPEC).expect("there is room");
    (1..=3).for_each(|value| publish(sender.as_mut(), value, monotonic_ns()));
    let mut b = Hosts::join(options_of("later", "cell-b", &endpoint)).expect("cell-a listens");
    let mut receiver = b.receiver(7, &SPEC, nobody()).expect("there is room");
    let mut found = None;
    wait_until("the newest group", || {
        found = latched(receiver.as_mut(), monotonic_ns());
        found.is_some()
    });
    assert_eq!(found.map(|(_, value)| value), Some(3));
}

#[test]
fn every_row_comes_in_order_once_and_raises_once() {
    let (mut a, endpoint) = listening("rows");
    let mut b = Hosts::join(options_of("rows", "cell-b", &endpoint)).expect("cell-a listens");
    let raised = Arc::new(AtomicUsize::new(0));
    let counting = raised.clone();
    let raise = Box::new(move || {
        counting.fetch_add(1, Ordering::Relaxed);
    });
    let mut receiver = b.receiver(1, &SPEC, raise).expect("there is room");
    let mut sender = a.sender(1, &SPEC).expect("there is room");
    let (mut pushed, mut came) = (0, 0);
    wait_until("2,000 rows", || {
        while pushed < 2_000 && push(sender.as_mut(), pushed) {
            pushed += 1;
        }
        while let Some(value) = popped(receiver.as_mut()) {
            assert_eq!(value, came);
            came += 1;
        }
        came == 2_000
    });
    wait_until("the last raise", || raised.load(Ordering::Relaxed) >= 2_000);
    assert_eq!(raised.load(Ordering::Relaxed), 2_000);
}

#[test]
fn a_writer_whose_reader_pops_nothing_is_full_and_gets_room_again() {
    let (mut a, endpoint) = listening("full");
    let mut b = Hosts::join(options_of("full", "cell-b", &endpoint)).expect("cell-a listens");
    let mut receiver = b.receiver(1, &SPEC, nobody()).expect("there is room");
    let mut sender = a.sender(1, &SPEC).expect("there is room");
    let mut pushed = 0;
    wait_until("no room", || {
        let room = push(sender.as_mut(), pushed);
        pushed += u64::from(room);
        !room && receiver.rows() as u64 == pushed
    });
    assert!((4..=4 + 64).contains(&pushed), "as many wait as may, and as may be on their way: {pushed}");
    for value in 0..pushed {
        assert_eq!(popped(receiver.as_mut()), Some(value));
    }
    wait_until("room", || push(sender.as_mut(), pushed));
    wait_until("the row", || popped(receiver.as_mut()) == Some(pushed));
}

#[test]
fn three_hosts_share_one_address() {
    let (mut a, endpoint) = listening("three");
    let mut b = Hosts::join(options_of("three", "cell-b", &endpoint)).expect("cell-a listens");
    let mut c = Hosts::join(options_of("three", "cell-c", &endpoint)).expect("cell-a listens");
    assert!(a.wait_for("cell-b", LONG) && a.wait_for("cell-c", LONG));
    assert_eq!(a.peers().len(), 2);
    assert_eq!(b.peers().iter().map(|peer| peer.name.as_str()).collect::<Vec<_>>(), ["cell-a"]);
    assert_eq!(a.peers()[0].target, hosts::TARGET);
    let mut there = b.sender(1, &SPEC).expect("there is room");
    let mut far = c.receiver(1, &SPEC, nobody()).expect("there is room");
    let mut second = a.sender(2, &SPEC).expect("there is room");
    let mut near = c.receiver(2, &SPEC, nobody()).expect("there is room");
    publish(there.as_mut(), 5, monotonic_ns());
    publish(second.as_mut(), 6, monotonic_ns());
    wait_until("cell-b's value at cell-c", || latched(far.as_mut(), monotonic_ns()).is_some_and(|(_, value)| value == 5));
    wait_until("cell-a's value at cell-c", || latched(near.as_mut(), monotonic_ns()).is_some_and(|(_, value)| value == 6));
}

#[test]
fn what_was_pushed_last_arrives_after_the_writer_is_gone() {
    let (mut a, endpoint) = listening("last");
    let mut b = Hosts::join(options_of("last", "cell-b", &endpoint)).expect("cell-a listens");
    let mut receiver = b.receiver(1, &SPEC, nobody()).expect("there is room");
    let mut sender = a.sender(1, &SPEC).expect("there is room");
    publish(sender.as_mut(), 9, monotonic_ns());
    assert!(push(sender.as_mut(), 0));
    drop(sender);
    wait_until("its last group", || latched(receiver.as_mut(), monotonic_ns()).is_some());
    wait_until("its last row", || popped(receiver.as_mut()).is_some());
}

#[test]
fn a_connection_without_a_queue_or_without_a_group_is_one_too() {
    let (mut a, endpoint) = listening("halves");
    let mut b = Hosts::join(options_of("halves", "cell-b", &endpoint)).expect("cell-a listens");
    let (group, rows) = (ConnectionSpec { queue_row_len: 0, queue_depth: 0, ..SPEC }, ConnectionSpec { asynchronous_len: 0, ..SPEC });
    let (mut sends_group, mut sends_rows) = (a.sender(1, &group).expect("room"), a.sender(2, &rows).expect("room"));
    let mut has_group = b.receiver(1, &group, nobody()).expect("room");
    let mut has_rows = b.receiver(2, &rows, nobody()).expect("room");
    publish(sends_group.as_mut(), 1, 0);
    assert!(push(sends_rows.as_mut(), 0));
    wait_until("the group", || latched(has_group.as_mut(), 0).is_some());
    wait_until("the row", || popped(has_rows.as_mut()).is_some());
    assert_eq!((has_group.rows(), has_group.peek_row()), (0, None));
}

/// Returns clocks that are ahead of this host's.
fn ahead(steady_ns: i64, wall_ns: i64) -> Clocks {
    let own = Clocks::default();
    let (steady, wall) = (own.steady, own.wall);
    Clocks { steady: Arc::new(move || steady() + steady_ns), wall: Arc::new(move || wall() + wall_ns) }
}

#[test]
fn times_are_converted_to_the_readers_clock_and_the_offset_is_shown() {
    const HOUR: i64 = 3_600_000_000_000;
    let (a, endpoint) = listening("clocks");
    let mut b = Hosts::join(Options { clocks: ahead(5 * HOUR, HOUR), ..options_of("clocks", "cell-b", &endpoint) }).expect("cell-a listens");
    let mut c = Hosts::join(Options { clocks: ahead(-3 * HOUR, 0), ..options_of("clocks", "cell-c", &endpoint) }).expect("cell-a listens");
    assert!(a.wait_for("cell-b", LONG));

    let seen_by_b = b.clock_offset("cell-a").expect("it is measured before joining is done");
    let seen_by_a = a.clock_offset("cell-b").expect("waited for");
    for (offset, steady_ns, wall_ns) in [(seen_by_b, -5 * HOUR, -HOUR), (seen_by_a, 5 * HOUR, HOUR)] {
        assert!((offset.clock_offset_ns - steady_ns).abs() <= offset.uncertainty_ns, "{offset:?}");
        // The two clocks are read one after the other, so there may be a delay in between.
        assert!((offset.wall_offset_ns - wall_ns).abs() < HOUR / 60, "{offset:?}");
    }

    // Epochs at the same instant: 1 s ago.
    let epoch_ns = monotonic_ns() - 1_000_000_000;
    a.set_epoch(epoch_ns);
    b.set_epoch(b.here_ns(epoch_ns));
    c.set_epoch(c.here_ns(epoch_ns));
    let mut sender = b.sender(1, &SPEC).expect("room");
    let mut receiver = c.receiver(1, &SPEC, nobody()).expect("room");
    let time_ns = 500_000_000;
    publish(sender.as_mut(), 1, time_ns);
    let mut header = None;
    wait_until("the group", || {
        header = latched(receiver.as_mut(), 0);
        header.is_some()
    });
    let wrong_ns = header.expect("waited for").0.time_ns - time_ns;
    let may_be_wrong_ns: i64 = [&b, &c].map(|host| host.clock_offset("cell-a").expect("measured").uncertainty_ns).iter().sum();
    // The offset may have been measured more precisely since the epoch was set: each may be off by its uncertainty.
    assert!(wrong_ns.abs() <= 2 * may_be_wrong_ns.max(20_000_000), "{wrong_ns} ns");
}

#[test]
fn clocks_that_agree_too_little_are_told() {
    let (_a, endpoint) = listening("watch");
    let (told, reports) = std::sync::mpsc::channel();
    let told = std::sync::Mutex::new(told);
    let watch = Arc::new(move |report: &hosts::ClockReport| told.lock().expect("one at a time").send(report.clone()).expect("the test listens"));
    let options =
        Options { clocks: ahead(0, 2_000_000_000), clock_limit_ns: Some(1_000_000_000), clock_watch: Some(watch), ..options_of("watch", "cell-b", &endpoint) };
    let _b = Hosts::join(options).expect("cell-a listens");
    let report = reports.recv_timeout(LONG).expect("the wall clock is 2 s ahead");
    assert_eq!((report.host.as_str(), report.beyond, report.limit_ns), ("cell-a", true, 1_000_000_000));
    assert!(report.offset.wall_offset_ns < -1_000_000_000, "{report:?}");
}
