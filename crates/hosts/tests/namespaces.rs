// SPDX-License-Identifier: Apache-2.0
//! Hosts in their own network namespaces, with veth pairs to one switch: values across, partitions, and how they heal.
//!
//! Needs the privilege to create network namespaces. `OPENGPAC_PARTITIONS_S=1,3,10,30` tries longer partitions.
mod common;
use common::{Authority, LONG, authority};
use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Silence limit of the probes' hosts.
const SILENT_S: u64 = 5;

/// A switch with hosts around it, each in its own namespace: host k has the address 10.99.0.k.
struct Network {
    prefix: String,
    hosts: usize,
}

impl Network {
    fn new(test: &str, hosts: usize) -> Self {
        let network = Network { prefix: format!("og{test}{}", std::process::id()), hosts };
        let switch = network.switch();
        ip(&format!("netns add {switch}"));
        ip(&format!("-n {switch} link add br0 type bridge"));
        ip(&format!("-n {switch} link set br0 up"));
        for host in 1..=hosts {
            let namespace = network.namespace(host);
            ip(&format!("netns add {namespace}"));
            ip(&format!("-n {switch} link add port{host} type veth peer name eth0 netns {namespace}"));
            ip(&format!("-n {switch} link set port{host} master br0 up"));
            ip(&format!("-n {namespace} addr add 10.99.0.{host}/24 dev eth0"));
            ip(&format!("-n {namespace} link set eth0 up"));
            ip(&format!("-n {namespace} link set lo up"));
        }
        network
    }

    fn switch(&self) -> String {
        format!("{}s", self.prefix)
    }

    fn namespace(&self, host: usize) -> String {
        format!("{}h{host}", self.prefix)
    }

    /// Unplugs a host from the switch: it notices only silence.
    fn cut(&self, host: usize) {
        ip(&format!("-n {} link set port{host} nomaster", self.switch()));
    }

    fn heal(&self, host: usize) {
        ip(&format!("-n {} link set port{host} master br0", self.switch()));
    }

    fn probe(&self, host: usize, arguments: &[&str]) -> Probe {
        let mut command = Command::new("ip");
        command.args(["netns", "exec", &self.namespace(host), env!("CARGO_BIN_EXE_hosts-probe")]).args(arguments);
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("ip is installed");
        let output = BufReader::new(child.stdout.take().expect("piped"));
        let (said, lines) = channel();
        // The thread ends with the probe.
        std::thread::spawn(move || output.lines().map_while(Result::ok).for_each(|line| drop(said.send(line))));
        Probe { child, lines, passed: VecDeque::new(), name: format!("host {host}") }
    }
}

impl Drop for Network {
    fn drop(&mut self) {
        for namespace in (1..=self.hosts).map(|host| self.namespace(host)).chain([self.switch()]) {
            let _ = Command::new("ip").args(["netns", "del", &namespace]).status();
        }
    }
}

fn ip(arguments: &str) {
    let output = Command::new("ip").args(arguments.split(' ')).output().expect("ip, of iproute2, is installed");
    assert!(
        output.status.success(),
        "`ip {arguments}` failed: {}these tests make network namespaces: run them as root, or with CAP_NET_ADMIN and CAP_SYS_ADMIN",
        String::from_utf8_lossy(&output.stderr)
    );
}

struct Probe {
    child: Child,
    lines: Receiver<String>,
    /// Lines that arrived while another one was awaited.
    passed: VecDeque<String>,
    name: String,
}

impl Probe {
    fn tell(&mut self, command: &str) {
        let input = self.child.stdin.as_mut().expect("piped");
        writeln!(input, "{command}").expect("the probe listens");
    }

    /// Returns the first unread line with this start. Panics if one reports a wrong value.
    fn hears(&mut self, start: &str) -> String {
        self.hears_any(&[start])
    }

    /// Returns the first unread line with one of these starts.
    fn hears_any(&mut self, starts: &[&str]) -> String {
        let is_one = |line: &str| starts.iter().any(|start| line.starts_with(start));
        if let Some(at) = self.passed.iter().position(|line| is_one(line)) {
            return self.passed.remove(at).expect("it was found");
        }
        let until = Instant::now() + LONG;
        loop {
            let line = self.line(starts[0], until);
            if is_one(&line) {
                return line;
            }
            self.passed.push_back(line);
        }
    }

    fn line(&self, start: &str, until: Instant) -> String {
        let left = until.saturating_duration_since(Instant::now());
        let line = self.lines.recv_timeout(left).unwrap_or_else(|_| panic!("{} never said '{start}'", self.name));
        assert!(!line.starts_with("wrong") && !line.starts_with("refused"), "{}: {line}", self.name);
        line
    }

    /// Returns the newest value and the number of rows of a connection.
    fn at(&mut self, connection: u64) -> (u64, u64) {
        let (_, value, rows) = self.asked(connection);
        (value, rows)
    }

    /// Returns whether a connection is fresh, its newest value, and its rows.
    fn asked(&mut self, connection: u64) -> (bool, u64, u64) {
        self.tell(&format!("at {connection}"));
        let line = self.hears("at ");
        let [_, age, value, rows] = line.split(' ').collect::<Vec<_>>()[..] else { panic!("'{line}' has other words") };
        (age == "fresh", value.parse().expect("a number"), rows.parse().expect("a number"))
    }

    /// Waits until a connection is fresh, or stale. A busy machine may make it stale for a moment at any time: it only has to become
    /// fresh again.
    fn becomes(&mut self, age: &str, connection: u64) {
        let until = Instant::now() + LONG;
        while self.asked(connection).0 != (age == "fresh") {
            assert!(Instant::now() < until, "{}: connection {connection} never becomes {age}", self.name);
            std::thread::park_timeout(Duration::from_millis(5));
        }
    }

    /// Waits until more has arrived on a connection.
    fn goes_on(&mut self, connection: u64) {
        let (value, rows) = self.at(connection);
        let until = Instant::now() + LONG;
        while self.at(connection).0 <= value || self.at(connection).1 <= rows {
            let found = self.at(connection);
            assert!(Instant::now() < until, "{}: nothing more comes on connection {connection} than {found:?}", self.name);
            std::thread::park_timeout(Duration::from_millis(5));
        }
    }
}

impl Drop for Probe {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn paths(authority: &Authority, host: usize) -> [String; 3] {
    let (certificate, key) = authority.sign(&format!("host{host}"), &[&format!("10.99.0.{host}")]);
    [authority.authority.clone(), certificate, key].map(|path: PathBuf| path.to_str().expect("a path of text").to_owned())
}

/// Starts a host that listens and others that have joined it, over TLS with certificates, each ready.
fn cell(network: &Network, authority: &Authority) -> Vec<Probe> {
    let mut probes: Vec<Probe> = Vec::new();
    for host in 1..=network.hosts {
        let [authority, certificate, key] = paths(authority, host);
        let (side, name) = (if host == 1 { "listen" } else { "join" }, format!("cell-{host}"));
        let mut probe = network.probe(host, &[side, "net", &name, "tls/10.99.0.1:7447", &authority, &certificate, &key]);
        probe.hears("ready");
        probes.push(probe);
    }
    probes
}

fn partitions_s() -> Vec<u64> {
    let said = std::env::var("OPENGPAC_PARTITIONS_S").unwrap_or_else(|_| "1,3".to_owned());
    said.split(',').map(|seconds| seconds.trim().parse().expect("seconds, as in 1,3,10,30")).collect()
}

#[test]
fn two_hosts_part_and_find_each_other_again() {
    let (network, authority) = (Network::new("p", 2), authority("parted"));
    let mut probes = cell(&network, &authority);
    let [near, far] = probes.as_mut_slice() else { panic!("two hosts") };
    near.tell("write 1");
    far.tell("read 1");
    far.becomes("fresh", 1);
    for (round, seconds) in partitions_s().into_iter().enumerate() {
        let number = 100 + round;
        near.tell(&format!("link cell-2 {number}"));
        far.tell(&format!("link cell-1 {number}"));
        near.hears("linked");
        far.hears("linked");
        near.tell("say before");
        far.hears("heard before");
        let rows_before = far.at(1).1;

        network.cut(2);
        let cut = Instant::now();
        far.becomes("stale", 1);
        near.tell("say meanwhile");
        while cut.elapsed() < Duration::from_secs(seconds) {
            std::thread::park_timeout(Duration::from_secs(seconds).saturating_sub(cut.elapsed()));
        }
        network.heal(2);
        let healed = Instant::now();
        far.becomes("fresh", 1);
        eprintln!("after {seconds} s apart the newest values came {} ms after the cable", healed.elapsed().as_millis());
        far.goes_on(1);
        assert!(far.at(1).1 > rows_before);
        // On a machine that stalled meanwhile, the intended shorter silence may be the longer one: it is judged by its actual length,
        // and may have begun slightly before the cable was unplugged.
        let closes = |said: &str| {
            let is_closed = said.starts_with("closed");
            assert!(!is_closed || cut.elapsed() >= Duration::from_secs(SILENT_S - 1), "after {seconds} s apart: {said}");
            is_closed
        };
        if closes(&far.hears_any(&["heard meanwhile", "closed"])) {
            near.hears("closed");
            continue;
        }
        assert!(seconds < SILENT_S, "heard after {seconds} s apart");
        far.tell("say still here");
        let _closed = closes(&near.hears_any(&["heard still here", "closed"]));
    }
}

#[test]
fn of_three_hosts_two_go_on_while_one_is_away() {
    let (network, authority) = (Network::new("t", 3), authority("three"));
    let mut probes = cell(&network, &authority);
    let [a, b, c] = probes.as_mut_slice() else { panic!("three hosts") };
    // From each host to another: 1 to the listening host, 2 from it, 3 between the two that joined.
    b.tell("write 1");
    a.tell("read 1");
    a.tell("write 2");
    c.tell("read 2");
    b.tell("write 3");
    c.tell("read 3");
    a.becomes("fresh", 1);
    c.becomes("fresh", 2);
    c.becomes("fresh", 3);
    network.cut(2);
    a.becomes("stale", 1);
    c.becomes("stale", 3);
    c.goes_on(2);
    network.heal(2);
    a.becomes("fresh", 1);
    c.becomes("fresh", 3);
    a.goes_on(1);
    c.goes_on(3);
}

#[test]
fn a_host_that_is_killed_closes_its_link_and_its_name_can_be_taken_again() {
    let (network, authority) = (Network::new("k", 2), authority("killed"));
    let mut probes = cell(&network, &authority);
    probes[0].tell("link cell-2 1");
    probes[0].hears("linked");
    probes[1].child.kill().expect("it runs");
    probes[0].hears("closed");
    let [authority, certificate, key] = paths(&authority, 2);
    let mut again = network.probe(2, &["join", "net", "cell-2", "tls/10.99.0.1:7447", &authority, &certificate, &key]);
    again.hears("ready");
}
