// SPDX-License-Identifier: Apache-2.0
//! Signals of a cell offered to Modbus clients, such as a line controller or an operator panel: the cell reads the values that clients
//! write, and clients read the values of the cell.
//!
//! | module | |
//! |---|---|
//! | `tables` | registers and bits, and execution of requests on them |
//! | `serve` | the thread that answers clients |
mod serve;
mod tables;

use super::map::{self, End, MappedChannel, Write};
use device::{Channel, Class, Counters, Declaration, DeviceError, Driver, DriverError, GivenOptions, Kind, Life, OpenedDriver, OptionWord, SafeBy, SafeState};
use forks::Device;
use serde::Deserialize;
use serde_json::{Map, Value, json};
use serve::{Count, ServerState, serve};
use std::net::{IpAddr, Shutdown, SocketAddr, TcpListener, ToSocketAddrs};
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
pub(super) use tables::Tables;

pub(crate) static DRIVER: Declaration = Declaration {
    class: Class::Worker,
    life: Life::IN_PLACE,
    safe_state: SafeState {
        doc: "clients read the safe value of each channel, and see that the server is gone",
        by: &[SafeBy::Driver, SafeBy::End],
        within_ns: 1_000_000_000,
    },
    counters: Count::WORDS,
    rights: &["ports below 1024: cap_net_bind_service"],
    ..Declaration::new("modbus_server", "channels of this machine offered by Modbus over TCP to clients that read and write them", &OPTIONS, open)
};

const OPTIONS: [OptionWord; 5] = [
    OptionWord::needed("address", Kind::Text, "address to listen at: tcp/127.0.0.1:1502"),
    OptionWord::needed("channels", Kind::Table, "as for driver modbus; clients read the channels that are written, and write the others")
        .entries(&[&super::map::CHANNEL]),
    OptionWord::with_default(
        "to_network",
        Kind::Bool,
        "false",
        "whether other hosts may connect: Modbus has no authentication, so every program that reaches the port may write",
    ),
    OptionWord::with_default("clients", Kind::Whole, "8", "maximum number of clients; a further one replaces the one that has been silent longest")
        .within(1.0, 64.0),
    OptionWord::with_default("silent_ns", Kind::Whole, "no limit", "time without a request, after the first one, before the device is lost")
        .unit("ns")
        .within(1e3, 3.6e12),
];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Options {
    address: String,
    channels: Map<String, Value>,
    #[serde(default)]
    to_network: bool,
    #[serde(default = "eight")]
    clients: usize,
    silent_ns: Option<i64>,
}

fn eight() -> usize {
    8
}

struct Server {
    channels: Vec<Channel>,
    places: Vec<MappedChannel>,
    address: SocketAddr,
    clients: usize,
    shared: Arc<ServerState>,
    silent_ns: Option<i64>,
    /// Number of requests at the last reading, and the time of the last increase.
    asked: (u64, i64),
    running: Option<(UnixStream, JoinHandle<()>)>,
}

fn open(given: &GivenOptions<'_>) -> Result<OpenedDriver, DriverError> {
    let options: Options = given.read()?;
    let wrong_address = |why: String| given.wrong("address", why);
    let to = options
        .address
        .strip_prefix("tcp/")
        .ok_or_else(|| wrong_address(format!("'{}' is not an address to listen at; write tcp/127.0.0.1:1502", options.address)))?;
    let mut found = to.to_socket_addrs().map_err(|why| wrong_address(format!("'{to}': {why}; write tcp/127.0.0.1:1502")))?;
    let address = found.next().ok_or_else(|| wrong_address(format!("'{to}' is not a host")))?;
    if !options.to_network && !is_loopback(address.ip()) {
        let why = "other hosts could write its channels, and Modbus has no authentication; listen at tcp/127.0.0.1, or set to_network=true on a network of machines only";
        return Err(wrong_address(why.to_owned()));
    }
    let (channels, places) = map::places(&options.channels, End::Server).map_err(|why| given.wrong("channels", why))?;
    let tables = Mutex::new(Tables::new(&places));
    let shared = Arc::new(ServerState { tables, counters: Arc::new(Counters::new(Count::WORDS)), asked: AtomicU64::new(0) });
    let server = Server { channels, places, address, clients: options.clients, shared, silent_ns: options.silent_ns, asked: (0, 0), running: None };
    Ok((Box::new(server), json!({ "parts": [] })))
}

fn is_loopback(ip: IpAddr) -> bool {
    ip.to_canonical().is_loopback()
}

impl Server {
    fn put(&self, value: impl Fn(&MappedChannel) -> Vec<u8>) {
        let mut tables = self.shared.tables.lock().unwrap_or_else(PoisonError::into_inner);
        for place in self.places.iter().filter(|place| place.write != Write::Never) {
            if !tables.put(place, &value(place)) {
                self.shared.count(Count::Limited);
            }
        }
    }
}

impl Driver for Server {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn open(&mut self, now_ns: i64) -> Result<(), DeviceError> {
        self.safe_state();
        self.asked = (0, now_ns);
        let cannot = |why: std::io::Error| DeviceError { message: format!("it cannot listen at {}: {why}", self.address) };
        let listener = Device::new(TcpListener::bind(self.address).map_err(cannot)?);
        listener.set_nonblocking(true).map_err(cannot)?;
        let (mine, ends) = UnixStream::pair().map_err(cannot)?;
        let (shared, clients) = (self.shared.clone(), self.clients);
        let serving = std::thread::Builder::new().name("modbus server".to_owned()).spawn(move || serve(&listener, &ends, clients, &shared));
        self.running = Some((mine, serving.map_err(cannot)?));
        Ok(())
    }

    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        let tables = self.shared.tables.lock().unwrap_or_else(PoisonError::into_inner);
        for place in self.places.iter().filter(|place| place.write == Write::Never) {
            tables.get(place, place.slot.of_mut(readings));
        }
        drop(tables);
        let asked = self.shared.asked.load(Ordering::Relaxed);
        if asked != self.asked.0 {
            self.asked = (asked, release_ns);
        }
        match self.silent_ns {
            Some(silent_ns) if asked > 0 && release_ns - self.asked.1 > silent_ns => {
                Err(DeviceError { message: format!("no client has sent a request to {} for {} ms", self.address, silent_ns as f64 * 1e-6) })
            }
            _ => Ok(()),
        }
    }

    fn write(&mut self, _: i64, commands: &[u8], _: &[bool]) -> Result<(), DeviceError> {
        self.put(|place| place.slot.of(commands).to_vec());
        Ok(())
    }

    fn safe_state(&mut self) {
        self.put(|place| place.safe.clone());
    }

    fn close(&mut self) {
        if let Some((mine, serving)) = self.running.take() {
            // Not closed but shut down: a forked process may have a copy. It fails if the thread has already ended.
            let _ = mine.shutdown(Shutdown::Both);
            // The panic message has already been printed.
            let _ = serving.join();
        }
    }

    fn counters(&self) -> Option<Arc<Counters>> {
        Some(self.shared.counters.clone())
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.close();
    }
}
