// SPDX-License-Identifier: Apache-2.0
//! A proxy between two ends of TCP streams that delays, stalls, cuts, corrupts, repeats, drops and reorders data.
use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Fault applied to the pieces of the stream as they are read: to every one, or to one in eight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Every piece arrives 5 ms later.
    Delay,
    /// No piece passes until the fault ends; then all do.
    Stall,
    /// The streams are cut, and new ones too while the fault lasts.
    Cut,
    /// One bit of some pieces is flipped.
    Corrupt,
    /// Some pieces arrive twice.
    Repeat,
    /// Some pieces are dropped.
    Drop,
    /// Some pieces arrive after their successor.
    Reorder,
}

pub struct Proxy {
    /// Listening address: another loopback address, since a listener on a different port than requested is refused.
    pub address: SocketAddr,
    state: Arc<State>,
}

#[derive(Default)]
struct State {
    fault: Mutex<Option<Fault>>,
    streams: Mutex<Vec<TcpStream>>,
    pieces: AtomicU64,
    faults: AtomicU64,
}

impl Proxy {
    /// Starts a proxy in front of `target`, an address and a port. Its threads end with their streams.
    pub fn start(target: &str) -> Self {
        let target: SocketAddr = target.parse().expect("an address and a port");
        let address = SocketAddr::from(([127, 0, 0, 2], target.port()));
        let listener = TcpListener::bind(address).expect("the port is free there too");
        let state = Arc::new(State::default());
        let accepting = state.clone();
        std::thread::spawn(move || {
            for near in listener.incoming().map_while(Result::ok) {
                let far = if accepting.fault() == Some(Fault::Cut) { None } else { TcpStream::connect(target).ok() };
                // Without a far end, the near one is closed here.
                let Some(far) = far else { continue };
                accepting.carry(&near, &far);
            }
        });
        Proxy { address, state }
    }

    pub fn set(&self, fault: Option<Fault>) {
        *self.state.fault.lock().expect("no holder panics") = fault;
        if fault == Some(Fault::Cut) {
            self.state.count();
            for stream in self.state.streams.lock().expect("no holder panics").drain(..) {
                let _ = stream.shutdown(Shutdown::Both);
            }
        }
    }

    /// Returns the number of stream faults so far.
    pub fn faults(&self) -> u64 {
        self.state.faults.load(Ordering::Relaxed)
    }
}

impl State {
    fn fault(&self) -> Option<Fault> {
        *self.fault.lock().expect("no holder panics")
    }

    fn count(&self) {
        self.faults.fetch_add(1, Ordering::Relaxed);
    }

    fn carry(self: &Arc<Self>, near: &TcpStream, far: &TcpStream) {
        let copy = |stream: &TcpStream| stream.try_clone().expect("a stream can be held twice");
        self.streams.lock().expect("no holder panics").extend([copy(near), copy(far)]);
        for (from, to) in [(copy(near), copy(far)), (copy(far), copy(near))] {
            let state = self.clone();
            std::thread::spawn(move || state.pump(from, to));
        }
    }

    fn pump(&self, mut from: TcpStream, mut to: TcpStream) {
        let mut buffer = [0; 4096];
        let mut held: Option<Vec<u8>> = None;
        while let Ok(count @ 1..) = from.read(&mut buffer) {
            let mut piece = buffer[..count].to_vec();
            let chosen = self.pieces.fetch_add(1, Ordering::Relaxed).is_multiple_of(8);
            let fault = self.fault().filter(|fault| chosen || *fault == Fault::Delay || *fault == Fault::Stall);
            if fault.is_some() {
                self.count();
            }
            match fault {
                Some(Fault::Delay) => std::thread::park_timeout(Duration::from_millis(5)),
                Some(Fault::Stall) => {
                    while self.fault() == Some(Fault::Stall) {
                        std::thread::park_timeout(Duration::from_millis(1));
                    }
                }
                Some(Fault::Corrupt) => piece[count / 2] ^= 0x10,
                Some(Fault::Repeat) => piece.extend_from_within(..),
                Some(Fault::Drop) => continue,
                Some(Fault::Reorder) if held.is_none() => {
                    held = Some(piece);
                    continue;
                }
                Some(Fault::Reorder | Fault::Cut) | None => {}
            }
            piece.extend(held.take().unwrap_or_default());
            if to.write_all(&piece).is_err() {
                break;
            }
        }
        let _ = (from.shutdown(Shutdown::Both), to.shutdown(Shutdown::Both));
    }
}
