// SPDX-License-Identifier: Apache-2.0
//! Driver of a plant that runs in a process of its own.
use super::plant_link::{ask_with, ask_within};
use super::plant_messages::{Answer, Ask, age_of};
use super::region::{Region, Shape, SharedTripleBuffer};
use super::services::PlantServices;
use device::{Attendance, Channel, Counters, DeclaredServices, DeviceError, Driver, SafeHandle, Services, Slot};
use interconnect::{TripleReader, TripleWriter};
use process_kit::{Child, UnixLink, connect, now_ns};
use serde_json::Value;
use std::io::ErrorKind;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Time limit for closing a plant.
const END: Duration = Duration::from_secs(5);
/// Divisor of the maximum silence; the quotient is the age above which readings count as late.
const LATE: i64 = 8;

/// Time limits after which the process counts as lost, ns.
pub(super) struct Bounds {
    /// Maximum time without a step of the process.
    pub(super) silent_ns: i64,
    /// Maximum age of the newest readings, if set.
    pub(super) taken_max_ns: Option<i64>,
    /// Maximum time without a new command.
    pub(super) timeout_ns: Option<i64>,
}

pub(super) struct PlantProcess {
    /// Link; `None` after closing, because the process is then released, however long this value lives.
    link: Option<UnixLink>,
    /// The plant process, if this driver started it.
    child: Option<Child>,
    channels: Vec<Channel>,
    shape: Shape,
    silent_ns: i64,
    /// Maximum age of the readings, above which the process counts as lost, even if it answers.
    taken_max_ns: Option<i64>,
    timeout_ns: Option<i64>,
    /// Slot in which the process stores the time of its readings, and from which a program reads their age; `None` for a machine, which
    /// does not report the time.
    age: Option<Slot>,
    /// Path at which other programs find the process.
    path: Option<PathBuf>,
    session: Option<Session>,
    services: Option<Arc<PlantServices>>,
    counters: Option<Arc<Counters>>,
}

struct Session {
    region: Region,
    commands: TripleWriter<SharedTripleBuffer>,
    readings: TripleReader<SharedTripleBuffer>,
    /// Number of steps of the plant at the last read, and the release time at which it last changed.
    steps: u64,
    stepped_ns: Option<i64>,
    attendance: Attendance,
    /// Time since which this side has been running without a stall.
    back_ns: i64,
    /// Lead of the source's clock over that of this host.
    ahead_ns: i64,
}

impl Session {
    /// Returns the time for which the process has not made a step while this side was running, ns.
    fn silent_ns(&mut self, release_ns: i64, silent_max_ns: i64) -> i64 {
        self.back_ns = self.attendance.look(release_ns, silent_max_ns);
        let steps = self.region.steps().load(Ordering::Acquire);
        match self.stepped_ns {
            Some(stepped_ns) if steps == self.steps => release_ns - stepped_ns.max(self.back_ns),
            _ => {
                (self.steps, self.stepped_ns) = (steps, Some(release_ns));
                0
            }
        }
    }
}

impl PlantProcess {
    pub fn new(
        link: UnixLink,
        child: Option<Child>,
        (channels, about): (Vec<Channel>, &Value),
        Bounds { silent_ns, taken_max_ns, timeout_ns }: Bounds,
        path: Option<PathBuf>,
    ) -> PlantProcess {
        PlantProcess {
            shape: Shape::of(&channels, 0),
            age: age_of(&channels, about),
            link: Some(link),
            child,
            channels,
            silent_ns,
            taken_max_ns,
            timeout_ns,
            path,
            session: None,
            services: None,
            counters: None,
        }
    }

    /// Adds the services and counters of the driver that runs in the process.
    pub fn serving(mut self, told: DeclaredServices, link: Option<UnixLink>) -> PlantProcess {
        self.shape.counters = told.counters.len();
        self.services = (!told.services.is_empty()).then(|| Arc::new(PlantServices { words: told.services, link: Mutex::new(link), rests: AtomicU64::new(0) }));
        self.counters = (!told.counters.is_empty()).then(|| Arc::new(Counters::new(told.counters)));
        self
    }

    /// Reads a driver in a process of its own that reports the age of its readings.
    fn read_aged(&mut self, age: Slot, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        let Some(session) = &mut self.session else { return Err(DeviceError { message: "its process is not open".to_owned() }) };
        session.readings.latch();
        let (group, counted) = session.readings.front().split_at(self.shape.readings);
        readings.copy_from_slice(group);
        if let Some(counters) = &self.counters {
            counted.chunks_exact(8).enumerate().for_each(|(index, value)| counters.set(index, u64::from_ne_bytes(value.try_into().unwrap_or_default())));
        }
        let taken_ns = age.of(readings).try_into().map_or(i64::MIN, i64::from_ne_bytes);
        let age_ns = (release_ns - session.ahead_ns).saturating_sub(taken_ns).max(0);
        age.set_double(readings, 0, age_ns as f64 * 1e-9);
        let silent_ns = session.silent_ns(release_ns, self.silent_ns);
        // Readings from before a stall of this side do not count as too old yet.
        let seen_ns = age_ns.min(release_ns.saturating_sub(session.back_ns));
        // The process is checked for life only if it is late: that is a system call.
        let is_late = silent_ns > self.silent_ns / LATE;
        if let Some(status) = self.child.as_ref().filter(|_| is_late).and_then(|child| child.wait(Duration::ZERO)) {
            return Err(DeviceError { message: format!("its process {status}") });
        }
        let old = |age_ns: i64, most_ns: i64, what: &str| {
            let (age, most) = (age_ns as f64 * 1e-6, most_ns as f64 * 1e-6);
            Err(DeviceError { message: format!("its newest readings are {age:.1} ms old, more than {most} ms: {what}") })
        };
        match self.taken_max_ns {
            _ if silent_ns > self.silent_ns => old(silent_ns, self.silent_ns, "it answers too slowly or not at all"),
            Some(most_ns) if seen_ns > most_ns => old(age_ns, most_ns, "it answers too slowly, or delivers nothing new"),
            _ => Ok(()),
        }
    }

    fn leave(&mut self, group: &[u8], engaged: Option<&[bool]>) {
        let Some(session) = &mut self.session else { return };
        let back = session.commands.back();
        let (commands, claimed) = back.split_at_mut(self.shape.commands);
        commands.copy_from_slice(&group[..self.shape.commands]);
        match engaged {
            Some(engaged) => claimed.iter_mut().zip(engaged).for_each(|(byte, engaged)| *byte = u8::from(*engaged)),
            None => claimed.fill(0),
        }
        session.commands.publish();
    }
}

impl Driver for PlantProcess {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn open(&mut self, opened_ns: i64) -> Result<(), DeviceError> {
        let fail = |message: String| DeviceError { message: format!("the plant cannot be opened: {message}") };
        let link = self.link.as_ref().ok_or_else(|| fail("it was closed".to_owned()))?;
        let descriptor = match ask_with(link, Ask::Open).map_err(fail)? {
            (Answer::Opened, mut descriptors) if !descriptors.is_empty() => descriptors.remove(0),
            (Answer::Refused(problem), _) => return Err(fail(problem)),
            (other, _) => return Err(fail(format!("it gave an unexpected answer, {other:?}"))),
        };
        let region = Region::received(descriptor, self.shape).map_err(|error| fail(error.to_string()))?;
        let (commands, readings) = region.driver_ends();
        self.services.iter().for_each(|services| services.rests.store(0, Ordering::Release));
        self.session = Some(Session {
            region,
            commands,
            readings,
            steps: 0,
            stepped_ns: None,
            attendance: Attendance::default(),
            back_ns: i64::MIN,
            ahead_ns: opened_ns - now_ns(),
        });
        Ok(())
    }

    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        let Some(session) = &mut self.session else { return Err(DeviceError { message: "the plant is not open".to_owned() }) };
        if let Some(message) = session.region.failure() {
            return Err(DeviceError { message });
        }
        if session.region.is_safe() {
            let message = "its process hung, so the guard brought the plant to its safe state; open it again to command it".to_owned();
            return Err(DeviceError { message });
        }
        if let Some(timeout_ns) = self.timeout_ns.filter(|_| session.region.timed_out().load(Ordering::Acquire) != 0) {
            return Err(DeviceError { message: device::timeout_message(timeout_ns) });
        }
        if let Some(age) = self.age {
            return self.read_aged(age, release_ns, readings);
        }
        let silent_ns = session.silent_ns(release_ns, self.silent_ns);
        if silent_ns > self.silent_ns {
            return Err(DeviceError { message: format!("the plant process has not executed a step for {} ms", silent_ns / 1_000_000) });
        }
        session.readings.latch();
        readings.copy_from_slice(session.readings.front());
        Ok(())
    }

    fn write(&mut self, _: i64, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError> {
        self.leave(commands, Some(engaged));
        Ok(())
    }

    fn safe_state(&mut self) {
        // The safe values are written in place of commands, so that no earlier ones apply; then the plant is requested to take them.
        let Some(session) = &mut self.session else { return };
        let back = session.commands.back();
        back.fill(0);
        for channel in self.channels.iter().filter(|channel| channel.direction == device::Direction::Write) {
            back[channel.offset..channel.offset + channel.len].copy_from_slice(&channel.safe);
        }
        session.commands.publish();
        let rests = session.region.rests().fetch_add(1, Ordering::Release) + 1;
        self.services.iter().for_each(|services| services.rests.store(rests, Ordering::Release));
    }

    fn close(&mut self) {
        self.safe_state();
        self.session = None;
        if let Some(services) = &self.services {
            services.close();
        }
        // A plant that has exited, or that another driver has opened since, must not be closed.
        let closed = self.link.take().map(|link| ask_within(&link, Ask::Close, END));
        if let Some(child) = self.child.take()
            && (matches!(closed, Some(Ok((Answer::Refused(_), _)))) || child.wait(END).is_none())
        {
            match self.age {
                // A driver that hangs in its exchange is not a machine that others could continue to use.
                Some(_) => drop(child.end(Duration::ZERO)),
                None => child.leave(),
            }
        }
        // A killed process could not remove its socket.
        if let Some(path) = &self.path
            && connect(path).is_err_and(|error| error.kind() == ErrorKind::ConnectionRefused)
        {
            // It may already have been removed.
            let _removed = std::fs::remove_file(path);
        }
    }

    fn services(&self) -> Option<Arc<dyn Services>> {
        self.services.clone().map(|asked| asked as Arc<dyn Services>)
    }

    fn counters(&self) -> Option<Arc<Counters>> {
        self.counters.clone()
    }

    fn watchdog_ns(&self) -> Option<i64> {
        self.timeout_ns
    }

    fn safe_handles(&self) -> Vec<SafeHandle> {
        let handle = |session: &Session| {
            let writes = session.region.safe_writes(&self.shape.safe_group(&self.channels));
            Some(SafeHandle { descriptor: session.region.memory().descriptor().ok()?, writes, latches: true })
        };
        self.session.as_ref().and_then(handle).into_iter().collect()
    }
}

impl Drop for PlantProcess {
    /// Closes the plant, so that a driver that was created but never opened does not leave a process behind either.
    fn drop(&mut self) {
        if self.child.is_some() || self.session.is_some() {
            self.close();
        }
    }
}
