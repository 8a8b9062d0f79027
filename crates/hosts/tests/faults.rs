// SPDX-License-Identifier: Apache-2.0
//! Faults on connections between hosts, in frames and in the byte stream under them: none reaches a reader.
mod common;
mod proxy;
use common::*;
use hosts::{Faulty, Hosts, Options, Security, WireFaults, wire_to_join, wire_to_listen};
use interconnect::{Ends, Link, Receiver, Sender};
use proxy::{Fault, Proxy};
use std::sync::Arc;
use std::time::Duration;

/// A writer, a reader, and the state of the reader, which panics if anything arrives that was not written, in order.
struct Stream {
    sender: Box<dyn Sender>,
    receiver: Box<dyn Receiver>,
    published: u64,
    pushed: u64,
    refused: u64,
    latched: u64,
    popped: u64,
}

impl Stream {
    fn new(writer: &Hosts, reader: &Hosts, number: u64) -> Self {
        let sender = writer.clone().sender(number, &SPEC).expect("there is room");
        let receiver = reader.clone().receiver(number, &SPEC, Box::new(|| ())).expect("there is room");
        Stream { sender, receiver, published: 0, pushed: 0, refused: 0, latched: 0, popped: 0 }
    }

    fn write(&mut self) {
        self.published += 1;
        publish(self.sender.as_mut(), self.published, monotonic_ns());
        if push(self.sender.as_mut(), self.pushed) {
            self.pushed += 1;
        } else {
            self.refused += 1;
        }
    }

    fn read(&mut self) {
        if let Some((_, value)) = latched(self.receiver.as_mut(), monotonic_ns()) {
            assert!(value > self.latched, "group {value} came after {}", self.latched);
            self.latched = value;
        }
        while let Some(value) = popped(self.receiver.as_mut()) {
            assert_eq!(value, self.popped, "rows are in order, each once");
            self.popped += 1;
        }
    }

    /// Writes and reads `rounds` times, about one a millisecond.
    fn flow(&mut self, rounds: usize) {
        for _ in 0..rounds {
            self.write();
            self.read();
            std::thread::park_timeout(Duration::from_millis(1));
        }
    }

    /// Waits until everything written has been read: the newest group and every row.
    fn settle(&mut self) {
        wait_until("the newest group and every row", || {
            self.read();
            self.latched == self.published && self.popped == self.pushed
        });
    }
}

#[test]
fn no_fault_of_the_wire_reaches_a_reader() {
    for seed in 1..=4 {
        let endpoint = format!("tcp/127.0.0.1:{}", free_port());
        let (near, far) = (options_of("faulty", "cell-a", &endpoint), options_of("faulty", "cell-b", &endpoint));
        let near_wire = Faulty::new(wire_to_listen(&near).expect("loopback"), seed, WireFaults::every());
        let a = Hosts::listen_over(near, Arc::new(near_wire)).expect("loopback");
        let far_wire = Faulty::new(wire_to_join(&far).expect("cell-a listens"), seed + 100, WireFaults::every());
        let b = Hosts::join_over(far, Arc::new(far_wire)).expect("hello is said until it is heard");
        assert!(a.wait_for("cell-b", LONG));
        let (mut there, mut back) = (Stream::new(&a, &b, 1), Stream::new(&b, &a, 2));
        for _ in 0..10 {
            there.flow(20);
            back.flow(20);
        }
        there.settle();
        back.settle();
        let (near, far): (Box<dyn Link>, Box<dyn Link>) = (a.link("cell-b", 1).expect("joined"), b.link("cell-a", 1).expect("listens"));
        for number in 0..50u32 {
            near.send(&number.to_le_bytes().repeat(1 + number as usize * 100)).expect("it is open");
        }
        for number in 0..50u32 {
            let frame = far.receive(LONG).expect("it is open").expect("it was sent");
            assert_eq!(frame, number.to_le_bytes().repeat(1 + number as usize * 100), "seed {seed}");
        }
    }
}

/// Sends in both directions under each fault in turn; after each, everything written is read.
fn flow_under(a: &Hosts, b: &Hosts, proxy: &Proxy, faults: &[Fault]) {
    let (mut there, mut back) = (Stream::new(a, b, 1), Stream::new(b, a, 2));
    for fault in faults {
        there.flow(20);
        back.flow(20);
        proxy.set(Some(*fault));
        there.flow(100);
        back.flow(100);
        proxy.set(None);
        there.settle();
        back.settle();
    }
    assert!(proxy.faults() > 0, "the proxy has done something");
}

/// Tests that TCP passes only delayed data or an end.
#[test]
fn no_fault_of_tcp_reaches_a_reader() {
    let (a, endpoint) = listening("stream");
    let proxy = Proxy::start(endpoint.trim_start_matches("tcp/"));
    let b = Hosts::join(options_of("stream", "cell-b", &format!("tcp/{}", proxy.address))).expect("cell-a listens behind it");
    flow_under(&a, &b, &proxy, &[Fault::Delay, Fault::Cut, Fault::Delay]);
}

/// Tests a fault that only a machine between two hosts can cause. The connection between hosts uses TLS, which detects it, and the stream
/// is replaced. (On the plain stream of loopback zenoh's own messages would be corrupted, and zenoh trusts them.)
#[test]
fn no_changed_byte_between_hosts_reaches_a_reader() {
    let authority = authority("changed");
    let security = |host: &str| {
        let (certificate, key) = authority.sign(host, &["127.0.0.1", "127.0.0.2"]);
        Security::Certificates { authority: authority.authority.clone(), certificate, key }
    };
    let target = format!("127.0.0.1:{}", free_port());
    let of = |name: &str, address: &str, security| Options { security, join_max: LONG, ..Options::new("changed", name, &format!("tls/{address}")) };
    let a = Hosts::listen(of("cell-a", &target, security("a"))).expect("it has certificates");
    let proxy = Proxy::start(&target);
    let b = Hosts::join(of("cell-b", &proxy.address.to_string(), security("b"))).expect("cell-a listens behind it");
    flow_under(&a, &b, &proxy, &[Fault::Corrupt, Fault::Repeat, Fault::Drop, Fault::Reorder, Fault::Cut, Fault::Delay]);
}

#[test]
fn a_stream_that_stalls_makes_the_writer_full_and_heals() {
    let (a, endpoint) = listening("stall");
    let proxy = Proxy::start(endpoint.trim_start_matches("tcp/"));
    let b = Hosts::join(options_of("stall", "cell-b", &format!("tcp/{}", proxy.address))).expect("cell-a listens behind it");
    let mut there = Stream::new(&a, &b, 1);
    there.flow(20);
    there.settle();
    proxy.set(Some(Fault::Stall));
    while there.refused < 50 {
        there.flow(10);
    }
    let (before, read) = (there.pushed, there.popped);
    assert!(before - read <= 64 + 4, "no more are kept than may be on their way and wait");
    proxy.set(None);
    there.settle();
    there.flow(100);
    there.settle();
    assert!(there.pushed > before, "there is room again");
}
