// SPDX-License-Identifier: Apache-2.0
//! A dedicated thread for a driver whose exchange may block, such as that of a fieldbus over TCP or a serial line. The source takes the
//! newest readings from triple buffers, and leaves its commands in them; neither waits for the other.
//!
//! | event | consequence |
//! |---|---|
//! | an exchange fails | the next `read` of the source fails: the device is lost |
//! | an exchange takes long | the readings age; beyond `age_max_ns`, the device is lost |
//! | the device sends nothing new | the readings age too; the device is lost beyond `age_max_ns` if that option was set |
//! | the source leaves no commands for longer than `age_max_ns` | the thread brings the outputs to their safe state |
//! | source and thread were stalled together | neither counts the other as silent: silence is measured from the resumption |
//! | `safe_state` | the thread is woken; the safe state follows the current exchange |
use crate::readings::{AgedChannels, check_age};
use device::{Attendance, Channel, Counters, DeviceError, Driver, Pace, SafeHandle, Services};
use interconnect::{TripleReader, TripleWriter, triple_buffer};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Time limit for an exchange in progress when the driver is opened or closed, in addition to the declared wait for the device.
const EXCHANGE: Duration = Duration::from_secs(5);
/// Bytes before commands: the time of writing, ns.
const STAMP: usize = size_of::<i64>();
/// Bytes before readings: the times at which they were exchanged, and at which the device took them, ns.
const STAMPS: usize = 2 * STAMP;

/// State shared by the source and the thread in addition to the buffers.
#[derive(Default)]
struct SharedState {
    /// Number of requests for the safe state.
    safe: AtomicU64,
    stops: AtomicBool,
    lost: AtomicBool,
    /// Cause of the loss, written before `lost`.
    why: Mutex<String>,
}

impl SharedState {
    fn lose(&self, why: String) {
        *self.why.lock().unwrap_or_else(PoisonError::into_inner) = why;
        self.lost.store(true, Ordering::Release);
    }

    fn why(&self) -> DeviceError {
        DeviceError { message: self.why.lock().unwrap_or_else(PoisonError::into_inner).clone() }
    }
}

pub(crate) struct Worker {
    /// Driver before `open`; afterwards, the thread owns it.
    inner: Option<Box<dyn Driver>>,
    aged: AgedChannels,
    pace: Pace,
    services: Option<Arc<dyn Services>>,
    counters: Option<Arc<Counters>>,
    watchdog_ns: Option<i64>,
    safe_handles: Mutex<Vec<SafeHandle>>,
    running: Option<SourceSide>,
}

/// The source's side of an open driver.
struct SourceSide {
    shared: Arc<SharedState>,
    readings: TripleReader,
    commands: TripleWriter,
    attendance: Attendance,
    thread: JoinHandle<()>,
    ended: Receiver<()>,
}

impl Worker {
    pub(crate) fn new(inner: Box<dyn Driver>, pace: Pace) -> Self {
        let aged = AgedChannels::new(inner.channels());
        let (services, counters, watchdog_ns) = (inner.services(), inner.counters(), inner.watchdog_ns());
        Worker { inner: Some(inner), aged, pace, services, counters, watchdog_ns, safe_handles: Mutex::default(), running: None }
    }
}

impl Driver for Worker {
    fn channels(&self) -> &[Channel] {
        &self.aged.channels
    }

    fn open(&mut self, now_ns: i64) -> Result<(), DeviceError> {
        let Some(inner) = self.inner.take() else { return Err(DeviceError { message: "it was opened before; open the device again".to_owned() }) };
        let shared = Arc::new(SharedState::default());
        let (to_source, readings) = triple_buffer(STAMPS + self.aged.readings_len);
        let (commands, from_source) = triple_buffer(STAMP + self.aged.written + self.aged.commands_len);
        let (opened, opens) = sync_channel(1);
        let (ends, ended) = sync_channel(1);
        let exchange = Exchange {
            inner,
            pace: self.pace,
            shared: shared.clone(),
            clock: Clock { epoch: Instant::now(), epoch_ns: now_ns },
            engaged: vec![false; self.aged.written],
            readings: to_source,
            commands: from_source,
            commanded_ns: None,
            attendance: Attendance::default(),
            safe_done: 0,
        };
        let thread = std::thread::Builder::new().name("exchange".to_owned()).spawn(move || exchange.run(&opened, &ends));
        let thread = thread.map_err(|why| DeviceError { message: format!("cannot start a thread for its exchange: {why}") })?;
        let waits = Duration::from_nanos(self.pace.waits_ns.unsigned_abs()) + EXCHANGE;
        let handles = match opens.recv_timeout(waits) {
            Ok(opened) => opened?,
            Err(RecvTimeoutError::Timeout) => {
                shared.stops.store(true, Ordering::Release);
                return Err(DeviceError { message: format!("it did not answer within {:.1} s", waits.as_secs_f64()) });
            }
            Err(RecvTimeoutError::Disconnected) => return Err(DeviceError { message: "its driver ended during opening".to_owned() }),
        };
        self.safe_handles = Mutex::new(handles);
        self.running = Some(SourceSide { shared, readings, commands, attendance: Attendance::default(), thread, ended });
        Ok(())
    }

    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        let Some(running) = &mut self.running else { return Err(DeviceError { message: "it is not open".to_owned() }) };
        if running.shared.lost.load(Ordering::Acquire) {
            return Err(running.shared.why());
        }
        running.readings.latch();
        let (stamps, newest) = running.readings.front().split_at(STAMPS);
        readings[..self.aged.readings_len].copy_from_slice(newest);
        let (exchanged, taken) = stamps.split_at(STAMP);
        let age_ns = self.aged.set_age(readings, release_ns, stamp_of(taken));
        let back_ns = running.attendance.look(release_ns, self.pace.age_max_ns);
        let silent_ns = release_ns - stamp_of(exchanged).max(back_ns);
        if silent_ns > self.pace.age_max_ns {
            let (age, most) = (silent_ns as f64 * 1e-6, self.pace.age_max_ns as f64 * 1e-6);
            // The device stays lost, even if this side was held up.
            running.shared.lose(format!("its newest readings are {age:.1} ms old, more than {most} ms: it answers too slowly or not at all"));
            return Err(running.shared.why());
        }
        check_age(&self.pace, age_ns.min(release_ns.saturating_sub(back_ns)))
    }

    fn write(&mut self, release_ns: i64, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError> {
        let Some(running) = &mut self.running else { return Err(DeviceError { message: "it is not open".to_owned() }) };
        let written = self.aged.written;
        let place = running.commands.back();
        place[..STAMP].copy_from_slice(&release_ns.to_ne_bytes());
        for (at, engaged) in place[STAMP..STAMP + written].iter_mut().zip(engaged) {
            *at = u8::from(*engaged);
        }
        place[STAMP + written..].copy_from_slice(&commands[..self.aged.commands_len]);
        running.commands.publish();
        Ok(())
    }

    fn safe_state(&mut self) {
        if let Some(running) = &self.running {
            running.shared.safe.fetch_add(1, Ordering::Release);
            running.thread.thread().unpark();
        }
    }

    fn close(&mut self) {
        let Some(running) = self.running.take() else { return };
        running.shared.stops.store(true, Ordering::Release);
        running.thread.thread().unpark();
        // A driver that does not return from its exchange keeps its thread: there is no way to stop it.
        if running.ended.recv_timeout(EXCHANGE) != Err(RecvTimeoutError::Timeout) {
            // The panic message has already been printed.
            let _ = running.thread.join();
        }
    }

    fn safe_handles(&self) -> Vec<SafeHandle> {
        std::mem::take(&mut *self.safe_handles.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn watchdog_ns(&self) -> Option<i64> {
        self.watchdog_ns
    }

    fn services(&self) -> Option<Arc<dyn Services>> {
        self.services.clone()
    }

    fn counters(&self) -> Option<Arc<Counters>> {
        self.counters.clone()
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.close();
    }
}

/// Clock of the source, for use by the thread; it was read when the driver was opened.
struct Clock {
    epoch: Instant,
    epoch_ns: i64,
}

impl Clock {
    fn now_ns(&self) -> i64 {
        self.epoch_ns + i64::try_from(self.epoch.elapsed().as_nanos()).unwrap_or(i64::MAX)
    }
}

/// The thread's side of an open driver.
struct Exchange {
    inner: Box<dyn Driver>,
    pace: Pace,
    shared: Arc<SharedState>,
    clock: Clock,
    engaged: Vec<bool>,
    readings: TripleWriter,
    commands: TripleReader,
    /// Time at which the current commands were written; `None` if the outputs are at rest.
    commanded_ns: Option<i64>,
    attendance: Attendance,
    safe_done: u64,
}

impl Exchange {
    fn run(mut self, opened: &SyncSender<Result<Vec<SafeHandle>, DeviceError>>, ends: &SyncSender<()>) {
        forks::bind_thread();
        let first = self.inner.open(self.clock.now_ns()).and_then(|()| self.read());
        let opens = match first {
            Ok(()) => opened.send(Ok(self.inner.safe_handles())).is_ok(),
            Err(why) => {
                let _ = opened.send(Err(why));
                false
            }
        };
        if opens {
            self.serve();
        }
        self.inner.safe_state();
        self.inner.close();
        // The closing side may have given up waiting.
        let _ = ends.send(());
    }

    fn serve(&mut self) {
        let mut next_ns = self.clock.now_ns() + self.pace.period_ns;
        while !self.shared.stops.load(Ordering::Acquire) {
            forks::end_if_child();
            let left_ns = next_ns - self.clock.now_ns();
            let safe = self.shared.safe.load(Ordering::Acquire);
            if safe != self.safe_done {
                self.safe_done = safe;
                self.rest();
                continue;
            }
            if left_ns > 0 {
                std::thread::park_timeout(Duration::from_nanos(left_ns.unsigned_abs()));
                continue;
            }
            // Missed exchanges are not made up for.
            next_ns = (next_ns + self.pace.period_ns).max(self.clock.now_ns());
            if let Err(why) = self.write().and_then(|()| self.read()) {
                self.shared.lose(why.message);
                return;
            }
        }
    }

    fn rest(&mut self) {
        self.commands.latch();
        self.commanded_ns = None;
        self.inner.safe_state();
    }

    fn read(&mut self) -> Result<(), DeviceError> {
        let now_ns = self.clock.now_ns();
        let place = self.readings.back();
        self.inner.read(now_ns, &mut place[STAMPS..])?;
        let taken_ns = self.inner.taken_ns().unwrap_or(now_ns);
        place[..STAMP].copy_from_slice(&now_ns.to_ne_bytes());
        place[STAMP..STAMPS].copy_from_slice(&taken_ns.to_ne_bytes());
        self.readings.publish();
        Ok(())
    }

    fn write(&mut self) -> Result<(), DeviceError> {
        let now_ns = self.clock.now_ns();
        let back_ns = self.attendance.look(now_ns, self.pace.age_max_ns);
        if self.commands.latch() {
            self.commanded_ns = Some(stamp_of(&self.commands.front()[..STAMP]));
        }
        let Some(commanded_ns) = self.commanded_ns else { return Ok(()) };
        if now_ns - commanded_ns.max(back_ns) > self.pace.age_max_ns {
            self.rest();
            return Ok(());
        }
        let (engaged, commands) = self.commands.front()[STAMP..].split_at(self.engaged.len());
        self.engaged.iter_mut().zip(engaged).for_each(|(flag, engaged)| *flag = *engaged != 0);
        self.inner.write(now_ns, commands, &self.engaged)
    }
}

fn stamp_of(bytes: &[u8]) -> i64 {
    bytes.try_into().map_or(i64::MIN, i64::from_ne_bytes)
}
