// SPDX-License-Identifier: Apache-2.0
//! An endpoint of an emulated bus in this process: frames are answered within the call, and the exchange determines the time.
use super::bus::Bus;
use crate::frame::{self, Came, FRAME_LEN, Frame};
use crate::link::{Link, hears};
use std::collections::VecDeque;
use std::io;
use std::os::fd::OwnedFd;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::Duration;

/// Maximum number of frames that an endpoint buffers.
const ROOM: usize = 4096;

/// A bus and its endpoints.
pub struct SharedBus {
    inner: Mutex<Inner>,
}

struct Inner {
    bus: Bus,
    /// Socket through which other processes send frames. It is connected to itself, so that a duplicate can be written even after this
    /// process has exited.
    outside: Option<UnixDatagram>,
    now_ns: Option<i64>,
    ends: Vec<(u64, End)>,
    next: u64,
}

struct End {
    heard: Vec<(u16, u16)>,
    came: VecDeque<[u8; FRAME_LEN]>,
}

impl SharedBus {
    pub fn new(bus: Bus) -> Arc<SharedBus> {
        Arc::new(SharedBus { inner: Mutex::new(Inner { bus, outside: None, now_ns: None, ends: Vec::new(), next: 0 }) })
    }

    /// Executes an action on the bus.
    pub fn with<T>(&self, act: impl FnOnce(&mut Bus) -> T) -> T {
        let mut inner = self.lock();
        let done = act(&mut inner.bus);
        inner.deliver();
        done
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Inner {
    /// Processes the frames sent from other processes.
    fn admit(&mut self) {
        let mut bytes = [0; FRAME_LEN];
        while let Some(len) = self.outside.as_ref().and_then(|outside| outside.recv(&mut bytes).ok()) {
            if let Came::Frame(frame) = frame::read(&bytes[..len]) {
                self.bus.take(&frame);
            }
        }
    }

    fn way_in(&mut self) -> io::Result<OwnedFd> {
        if self.outside.is_none() {
            static NEXT: AtomicU64 = AtomicU64::new(0);
            let name = format!("opengpac-canopen-within-{}-{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
            let own = SocketAddr::from_abstract_name(name)?;
            let outside = UnixDatagram::bind_addr(&own)?;
            outside.connect_addr(&own)?;
            outside.set_nonblocking(true)?;
            self.outside = Some(outside);
        }
        let outside = self.outside.as_ref().ok_or(io::ErrorKind::NotConnected)?;
        Ok(outside.try_clone()?.into())
    }

    fn deliver(&mut self) {
        while let Some(bytes) = self.bus.said() {
            for (_, end) in &mut self.ends {
                if end.came.len() < ROOM && end.hears(&bytes) {
                    end.came.push_back(bytes);
                }
            }
        }
    }
}

impl End {
    fn hears(&self, bytes: &[u8; FRAME_LEN]) -> bool {
        match frame::read(bytes) {
            Came::Frame(frame) => hears(&self.heard, frame.id),
            Came::Report { .. } | Came::Strange => true,
        }
    }
}

/// Buses of this process, by interface name.
static BUSES: Mutex<Vec<(String, Weak<SharedBus>)>> = Mutex::new(Vec::new());

/// Registers a bus under its interface name, `emulated:NAME`. It stays registered as long as it has an owner.
pub fn publish(name: &str, bus: &Arc<SharedBus>) {
    let mut buses = BUSES.lock().unwrap_or_else(PoisonError::into_inner);
    buses.retain(|(_, bus)| bus.strong_count() > 0);
    buses.push((name.to_owned(), Arc::downgrade(bus)));
}

/// Returns the bus with this name.
pub fn published(name: &str) -> Option<Arc<SharedBus>> {
    let buses = BUSES.lock().unwrap_or_else(PoisonError::into_inner);
    buses.iter().rev().find(|(of, _)| of == name).and_then(|(_, bus)| bus.upgrade())
}

/// An endpoint of an emulated bus.
pub struct Within {
    of: Arc<SharedBus>,
    number: u64,
}

impl Within {
    pub fn new(of: Arc<SharedBus>, heard: &[(u16, u16)]) -> Within {
        let mut inner = of.lock();
        let number = inner.next;
        inner.next += 1;
        inner.ends.push((number, End { heard: heard.to_vec(), came: VecDeque::with_capacity(ROOM) }));
        drop(inner);
        Within { of, number }
    }
}

impl Drop for Within {
    fn drop(&mut self) {
        self.of.lock().ends.retain(|(number, _)| *number != self.number);
    }
}

impl Link for Within {
    fn send(&mut self, frame: &Frame) -> io::Result<()> {
        let mut inner = self.of.lock();
        inner.bus.take(frame);
        inner.deliver();
        Ok(())
    }

    fn receive(&mut self) -> io::Result<Option<Came>> {
        let mut inner = self.of.lock();
        let end = inner.ends.iter_mut().find(|(number, _)| *number == self.number);
        Ok(end.and_then(|(_, end)| end.came.pop_front()).map(|bytes| frame::read(&bytes)))
    }

    // All frames that will arrive have already arrived.
    fn wait(&mut self, _: Duration) {}

    fn settle(&mut self, now_ns: i64) -> io::Result<()> {
        let mut inner = self.of.lock();
        let span_ns = inner.now_ns.map_or(0, |before| now_ns - before).max(0);
        inner.now_ns = Some(now_ns);
        inner.admit();
        inner.bus.go_on(span_ns);
        inner.deliver();
        Ok(())
    }

    fn duplicate(&self) -> Option<OwnedFd> {
        self.of.lock().way_in().ok()
    }
}
