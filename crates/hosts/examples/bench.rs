// SPDX-License-Identifier: Apache-2.0
//! Latency of a value from one host to another, compared with the same bytes over bare zenoh, alternating in one run. Each row is printed
//! as one JSON line.
//!
//!     bench ROUNDS
//!
//! This process listens, and a second one echoes. Over loopback, both carriers are plain; over a veth pair into a network namespace,
//! which needs the privilege to create one, both use TLS with certificates. A latency is half a round trip at 200 Hz, from a thread of
//! one process to a thread of the other: a value (a row) wakes its reader; a group is found by a reader that polls every 20 µs.
#[path = "../tests/common/authority.rs"]
mod authority;
use authority::Authority;
use hosts::{Hosts, Options, Security};
use interconnect::{ConnectionSpec, Ends, Receiver, Sender};
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, OnceLock};
use std::thread::Thread;
use std::time::{Duration, Instant};
use zenoh::Wait;
use zenoh::qos::{CongestionControl, Priority};

const SAMPLES: usize = 100;
const PAUSE: Duration = Duration::from_millis(5);
const LOOK: Duration = Duration::from_micros(20);
const LOST: Duration = Duration::from_secs(2);
const LENGTHS: [usize; 2] = [64, 4096];

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    // SAFETY: sets the timer slack of this thread; no memory is involved. Threads created later inherit it.
    unsafe { libc::prctl(libc::PR_SET_TIMERSLACK, 1) };
    match arguments.as_slice() {
        [echo, at, bare, files @ ..] if echo == "echo" => send_back(&Way::new(at, bare, files)),
        [rounds] => measure(rounds.parse().expect("a number of rounds")),
        _ => measure(5),
    }
}

/// Endpoints for our connections and for bare zenoh, and their credentials.
struct Way {
    at: String,
    bare: String,
    /// Paths of the authority, certificate and key.
    files: Vec<String>,
}

impl Way {
    fn new(at: &str, bare: &str, files: &[String]) -> Self {
        Way { at: at.to_owned(), bare: bare.to_owned(), files: files.to_vec() }
    }

    fn options(&self, name: &str) -> Options {
        let security = match self.files.as_slice() {
            [authority, certificate, key] => Security::Certificates { authority: authority.into(), certificate: certificate.into(), key: key.into() },
            _ => Security::Loopback { secret: "the-secret-of-the-tests".to_owned() },
        };
        Options { security, ..Options::new("bench", name, &self.at) }
    }

    fn bare(&self, listens: bool) -> zenoh::Session {
        let mut config = zenoh::Config::default();
        let mut set = |key: &str, value: String| config.insert_json5(key, &value).expect("a setting of zenoh");
        let (mode, side, endpoints) = if listens { ("router", "listen", &self.bare) } else { ("client", "connect", &self.bare) };
        set("mode", format!("{mode:?}"));
        set(&format!("{side}/endpoints"), format!("[{endpoints:?}]"));
        set("scouting/multicast/enabled", "false".to_owned());
        set("scouting/gossip/enabled", "false".to_owned());
        if let [authority, certificate, key] = self.files.as_slice() {
            set("transport/link/tls/root_ca_certificate", format!("{authority:?}"));
            set("transport/link/tls/enable_mtls", "true".to_owned());
            set(&format!("transport/link/tls/{side}_certificate"), format!("{certificate:?}"));
            set(&format!("transport/link/tls/{side}_private_key"), format!("{key:?}"));
        }
        zenoh::open(config).wait().expect("the other side is there")
    }
}

/// End of a path, which sends bytes and receives those that arrive.
trait Carries {
    /// Sends bytes; returns false if a buffer is full because the other side has not read for a while, as on a busy machine.
    fn send(&mut self, bytes: &[u8]) -> bool;
    /// Receives available bytes; returns true if there were any.
    fn take(&mut self) -> bool;
}

/// One end of our rows or groups.
struct Ours {
    sender: Box<dyn Sender>,
    receiver: Box<dyn Receiver>,
    number: u64,
    rows: bool,
}

impl Ours {
    fn new(hosts: &Hosts, number: u64, len: usize, rows: bool, near: bool, wakes: Arc<OnceLock<Thread>>) -> Self {
        let (asynchronous_len, queue_row_len, queue_depth) = if rows { (0, len, 4) } else { (len, 0, 0) };
        let spec = ConnectionSpec { writer: 0, reader: 1, asynchronous_len, queue_row_len, queue_depth };
        let (there, back) = if near { (2 * number, 2 * number + 1) } else { (2 * number + 1, 2 * number) };
        let raise = Box::new(move || wakes.get().map(Thread::unpark).unwrap_or_default());
        let receiver = hosts.clone().receiver(back, &spec, raise).expect("there is room");
        Ours { sender: hosts.clone().sender(there, &spec).expect("there is room"), receiver, number: 0, rows }
    }
}

impl Carries for Ours {
    fn send(&mut self, bytes: &[u8]) -> bool {
        self.number += 1;
        if self.rows {
            return self.sender.push(self.number, 0, &mut |row| row.copy_from_slice(bytes)).is_ok();
        }
        self.sender.group().copy_from_slice(bytes);
        self.sender.publish(self.number, 0);
        true
    }

    fn take(&mut self) -> bool {
        if self.rows { self.receiver.pop_row() } else { self.receiver.latch(0).is_some() }
    }
}

/// End of the same path over bare zenoh.
struct Bare {
    publisher: zenoh::pubsub::Publisher<'static>,
    came: Arc<Mutex<Option<Vec<u8>>>>,
    _subscriber: zenoh::pubsub::Subscriber<()>,
}

impl Bare {
    fn new(session: &zenoh::Session, number: u64, near: bool, wakes: Arc<OnceLock<Thread>>) -> Self {
        let (there, back) = (format!("bare/{number}/{near}"), format!("bare/{number}/{}", !near));
        let came = Arc::new(Mutex::new(None));
        let arrives = came.clone();
        let subscriber = session.declare_subscriber(back).callback(move |sample| {
            *arrives.lock().expect("no holder panics") = Some(sample.payload().to_bytes().into_owned());
            wakes.get().map(Thread::unpark).unwrap_or_default();
        });
        let publisher = session.declare_publisher(there).congestion_control(CongestionControl::Drop).priority(Priority::InteractiveHigh).express(true);
        let (publisher, subscriber) = (publisher.wait().expect("the session is open"), subscriber.wait().expect("the session is open"));
        Bare { publisher, came, _subscriber: subscriber }
    }
}

impl Carries for Bare {
    fn send(&mut self, bytes: &[u8]) -> bool {
        self.publisher.put(bytes.to_vec()).wait().expect("the session is open");
        true
    }

    fn take(&mut self) -> bool {
        self.came.lock().expect("no holder panics").take().is_some()
    }
}

/// Path under test: its length, true if the reader is woken, true if it is ours, the carrier, and the waiting thread.
type WayUnderTest = (usize, bool, bool, Box<dyn Carries + Send>, Arc<OnceLock<Thread>>);

/// Returns all paths of one side: for each length, woken and polling ones, alternating between our connections and bare zenoh.
fn ways(hosts: &Hosts, session: &zenoh::Session, near: bool) -> Vec<WayUnderTest> {
    let mut ways: Vec<WayUnderTest> = Vec::new();
    for (at, len) in LENGTHS.into_iter().enumerate() {
        for woken in [true, false] {
            let number = 10 + 2 * at as u64 + u64::from(woken);
            let (for_ours, for_bare) = (Arc::new(OnceLock::new()), Arc::new(OnceLock::new()));
            let bare = Bare::new(session, number, near, if woken { for_bare.clone() } else { Arc::default() });
            ways.push((len, woken, true, Box::new(Ours::new(hosts, number, len, woken, near, for_ours.clone())), for_ours));
            ways.push((len, woken, false, Box::new(bare), for_bare));
        }
    }
    ways
}

/// Waits until bytes have arrived, either woken or polling every 20 µs. Returns false on timeout.
fn await_one(way: &mut dyn Carries, woken: bool, limit: Duration) -> bool {
    let until = Instant::now() + limit;
    while !way.take() {
        if Instant::now() > until {
            return false;
        }
        std::thread::park_timeout(if woken { limit } else { LOOK });
    }
    true
}

fn send_back(way: &Way) {
    let hosts = Hosts::join(way.options("far")).expect("the near side listens");
    let session = way.bare(false);
    // Only the measured path may poll, and only during its measurement: the others would take processor time from the next measurement.
    let looks: Arc<Mutex<usize>> = Arc::default();
    for (at, (len, woken, _, mut way, wakes)) in ways(&hosts, &session, false).into_iter().enumerate() {
        let looks = looks.clone();
        std::thread::spawn(move || {
            let _ = wakes.set(std::thread::current());
            loop {
                if !woken && *looks.lock().expect("no holder panics") != at {
                    std::thread::park_timeout(PAUSE);
                } else if await_one(way.as_mut(), woken, if woken { LOST } else { PAUSE }) {
                    // If there is no space, the other side counts the round as lost.
                    let _has_room = way.send(&vec![1; len]);
                }
            }
        });
    }
    println!("ready");
    for line in std::io::stdin().lock().lines().map_while(Result::ok) {
        *looks.lock().expect("no holder panics") = line.parse().expect("which one is measured");
    }
}

fn measure(rounds: usize) {
    let program = std::env::current_exe().expect("it runs");
    let (at, bare) = (free_port(), free_port());
    let plain = Way::new(&format!("tcp/127.0.0.1:{at}"), &format!("tcp/127.0.0.1:{bare}"), &[]);
    let mut echo = Command::new(&program);
    echo.args(["echo", &plain.at, &plain.bare]);
    compare("loopback", &plain, echo, rounds);

    let cable = Cable::new();
    let authority = Authority::at(std::env::temp_dir().join(format!("opengpac-bench-{}", std::process::id())));
    let files = |host: &str, address: &str| {
        let (certificate, key) = authority.sign(host, &[address]);
        [authority.authority.clone(), certificate, key].map(|path| path.to_str().expect("a path of text").to_owned())
    };
    let way = Way::new("tls/10.98.7.1:7447", "tls/10.98.7.1:7448", &files("near", "10.98.7.1"));
    let mut echo = Command::new("ip");
    echo.args(["netns", "exec", &cable.namespace]).arg(&program).args(["echo", &way.at, &way.bare]).args(files("far", "10.98.7.2"));
    compare("namespaces, TLS", &way, echo, rounds);
}

/// The echo process, which is killed when this value is dropped.
struct Echo(Child);

impl Drop for Echo {
    fn drop(&mut self) {
        let _ = (self.0.kill(), self.0.wait());
    }
}

fn compare(where_to: &str, way: &Way, mut echo: Command, rounds: usize) {
    let hosts = Hosts::listen(way.options("near")).expect("the address is free");
    let session = way.bare(true);
    let mut echo = Echo(echo.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("the program is there"));
    let mut said = BufReader::new(echo.0.stdout.take().expect("piped")).lines();
    assert_eq!(said.next().and_then(Result::ok).as_deref(), Some("ready"), "the far side joins");
    let mut ways = ways(&hosts, &session, true);
    let mut latencies: Vec<Vec<f64>> = ways.iter().map(|_| Vec::new()).collect();
    for round in 0..=rounds {
        for (at, (len, woken, _, way, wakes)) in ways.iter_mut().enumerate() {
            let _ = wakes.set(std::thread::current());
            writeln!(echo.0.stdin.as_mut().expect("piped"), "{at}").expect("the far side listens");
            std::thread::park_timeout(4 * PAUSE);
            let mut times: Vec<f64> = (0..SAMPLES).filter_map(|_| round_trip(way.as_mut(), *len, *woken)).collect();
            assert!(times.len() > SAMPLES / 2, "most come back");
            times.sort_by(f64::total_cmp);
            // The first round is a warm-up.
            if round > 0 {
                latencies[at].push(times[times.len() / 2] / 2.0);
            }
        }
    }
    for (pair, both) in latencies.chunks(2).enumerate() {
        let (len, woken, ..) = &ways[2 * pair];
        let what = format!("{} of {len} bytes between hosts, {where_to}", if *woken { "value" } else { "group" });
        report(&what, median(&both[0]), median(&both[1]), median(&both[0].iter().zip(&both[1]).map(|(ours, bare)| ours / bare).collect::<Vec<_>>()));
    }
}

fn round_trip(way: &mut dyn Carries, len: usize, woken: bool) -> Option<f64> {
    std::thread::park_timeout(PAUSE);
    while way.take() {}
    let sent = Instant::now();
    (way.send(&vec![1; len]) && await_one(way, woken, LOST)).then(|| sent.elapsed().as_secs_f64() * 1e6)
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

fn report(what: &str, ours_us: f64, bare_us: f64, ratio: f64) {
    println!(
        r#"{{"row": "hosts", "what": "{what}", "ours": "{ours_us:.0} µs", "peer": "bare zenoh {bare_us:.0} µs", "value": {ratio:.3}, "shown": "{ratio:.2} ×", "bar": 1.5, "bar_text": "≤ 1.5 ×"}}"#
    );
}

fn free_port() -> u16 {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port is free");
    listener.local_addr().expect("it is bound").port()
}

/// A veth pair, with 10.98.7.1 on this side and 10.98.7.2 in a separate namespace.
struct Cable {
    namespace: String,
    near: String,
}

impl Cable {
    fn new() -> Self {
        let number = std::process::id() % 100_000;
        let cable = Cable { namespace: format!("ogbench{number}"), near: format!("ogb{number}") };
        let Cable { namespace, near } = &cable;
        ip(&format!("netns add {namespace}"));
        ip(&format!("link add {near} type veth peer name eth0 netns {namespace}"));
        ip(&format!("addr add 10.98.7.1/24 dev {near}"));
        ip(&format!("link set {near} up"));
        ip(&format!("-n {namespace} addr add 10.98.7.2/24 dev eth0"));
        ip(&format!("-n {namespace} link set eth0 up"));
        cable
    }
}

impl Drop for Cable {
    fn drop(&mut self) {
        let _ = Command::new("ip").args(["link", "del", &self.near]).status();
        let _ = Command::new("ip").args(["netns", "del", &self.namespace]).status();
    }
}

fn ip(arguments: &str) {
    let status = Command::new("ip").args(arguments.split(' ')).status().expect("ip, of iproute2, is installed");
    assert!(status.success(), "`ip {arguments}` failed: network namespaces need root");
}
