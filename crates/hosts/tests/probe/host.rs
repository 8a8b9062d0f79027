// SPDX-License-Identifier: Apache-2.0
//! A host in its own process, for tests: commands on its standard input, events on its output, one per line.
//!
//!     hosts-probe listen|join SYSTEM NAME ENDPOINT [AUTHORITY CERTIFICATE KEY]
//!
//! `write N` publishes values on connection N every 5 ms; `read N` reads them; `at N` reports whether they are `fresh` or `stale`, the
//! newest value and the rows; `link HOST N` opens a link, `say TEXT` sends over it. It prints `wrong …` if it ever reads a value that was
//! not written.
use hosts::{Hosts, Options, Security};
use interconnect::{ConnectionSpec, Ends, Link, Receiver, Sender};
use std::collections::HashMap;
use std::io::BufRead;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

const SPEC: ConnectionSpec = ConnectionSpec { writer: 0, reader: 1, asynchronous_len: 16, queue_row_len: 16, queue_depth: 16 };
const PERIOD: Duration = Duration::from_millis(5);
const STALE: Duration = Duration::from_millis(300);

/// Values read on a connection: the newest value, and rows.
#[derive(Default)]
struct ConnectionValues {
    value: AtomicU64,
    rows: AtomicU64,
    /// True if the newest value has just arrived.
    is_fresh: AtomicBool,
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [side, system, name, endpoint, certificates @ ..] = arguments.as_slice() else { panic!("see the head of this program") };
    let security = match certificates {
        [authority, certificate, key] => Security::Certificates { authority: authority.into(), certificate: certificate.into(), key: key.into() },
        _ => Security::Loopback { secret: "the-secret-of-the-tests".to_owned() },
    };
    let options = Options { security, join_max: Duration::from_secs(60), ..Options::new(system, name, endpoint) };
    let hosts = if side == "listen" { Hosts::listen(options) } else { Hosts::join(options) };
    match hosts {
        Ok(hosts) => {
            println!("ready");
            serve(&hosts);
        }
        Err(refused) => println!("refused {refused}"),
    }
}

fn serve(hosts: &Hosts) {
    let mut seen: HashMap<u64, Arc<ConnectionValues>> = HashMap::new();
    let link: Mutex<Option<Arc<dyn Link>>> = Mutex::new(None);
    for line in std::io::stdin().lock().lines() {
        let line = line.expect("the test writes text");
        let (command, rest) = line.split_once(' ').expect("a command and what it is about");
        let number = || rest.rsplit(' ').next().and_then(|number| number.parse::<u64>().ok()).expect("a number");
        match command {
            "write" => {
                let sender = hosts.clone().sender(number(), &SPEC).expect("there is room");
                std::thread::spawn(move || write(sender));
            }
            "read" => {
                let (number, found) = (number(), Arc::new(ConnectionValues::default()));
                seen.insert(number, found.clone());
                let receiver = hosts.clone().receiver(number, &SPEC, Box::new(|| ())).expect("there is room");
                std::thread::spawn(move || read(receiver, &found));
            }
            "at" => {
                let found = &seen[&number()];
                let age = if found.is_fresh.load(Ordering::Relaxed) { "fresh" } else { "stale" };
                println!("at {age} {} {}", found.value.load(Ordering::Relaxed), found.rows.load(Ordering::Relaxed));
            }
            "link" => {
                let host = rest.split(' ').next().expect("a host");
                assert!(hosts.wait_for(host, Duration::from_secs(60)), "'{host}' joins in time");
                let opened: Arc<dyn Link> = hosts.link(host, number()).expect("it has joined").into();
                *link.lock().expect("one thread") = Some(opened.clone());
                std::thread::spawn(move || receive(opened.as_ref()));
                println!("linked");
            }
            "say" => {
                let link = link.lock().expect("one thread").clone().expect("a link was opened");
                // A closed link has already been reported.
                let _ = link.send(rest.as_bytes());
            }
            _ => panic!("'{command}' is not a command"),
        }
    }
}

fn checked(value: u64) -> [u8; 16] {
    let mut bytes = [0; 16];
    bytes[..8].copy_from_slice(&value.to_le_bytes());
    bytes[8..].copy_from_slice(&(!value).wrapping_mul(0x9e37_79b9_7f4a_7c15).to_le_bytes());
    bytes
}

fn value_of(bytes: &[u8]) -> u64 {
    let value = u64::from_le_bytes(bytes[..8].try_into().expect("eight bytes"));
    if bytes != checked(value) {
        println!("wrong bytes {bytes:?}");
    }
    value
}

fn write(mut sender: Box<dyn Sender>) {
    let mut rows = 0;
    for value in 1.. {
        sender.group().copy_from_slice(&checked(value));
        sender.publish(value, 0);
        rows += u64::from(sender.push(rows, 0, &mut |row| row.copy_from_slice(&checked(rows))).is_ok());
        std::thread::park_timeout(PERIOD);
    }
}

fn read(mut receiver: Box<dyn Receiver>, seen: &ConnectionValues) {
    let (mut newest, mut rows) = (0, 0);
    let mut heard = Instant::now();
    loop {
        if let Some(header) = receiver.latch(0) {
            let value = value_of(receiver.group());
            if value <= newest || value != header.number {
                println!("wrong group {value} after {newest}");
            }
            newest = value;
            heard = Instant::now();
        }
        while let Some(value) = receiver.peek_row().map(|(_, row)| value_of(row)) {
            if value != rows {
                println!("wrong row {value} for {rows}");
            }
            rows += 1;
            receiver.pop_row();
        }
        seen.value.store(newest, Ordering::Relaxed);
        seen.rows.store(rows, Ordering::Relaxed);
        seen.is_fresh.store(newest > 0 && heard.elapsed() < STALE, Ordering::Relaxed);
        std::thread::park_timeout(Duration::from_millis(1));
    }
}

fn receive(link: &dyn Link) {
    loop {
        match link.receive(Duration::from_secs(60)) {
            Ok(Some(frame)) => println!("heard {}", String::from_utf8_lossy(&frame)),
            Ok(None) => {}
            Err(closed) => {
                println!("closed {closed}");
                return;
            }
        }
    }
}
