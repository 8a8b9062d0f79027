// SPDX-License-Identifier: Apache-2.0
//! Physical devices as the kernel serves them: read at the start of a firing of their source and written at its end.
use crate::block::Block;
use crate::device_state::{AT_ZERO, Ask, DeviceCall, DeviceStanding, OFF, STOP, TELL};
use crate::forcing::{FORCED_LEN_MAX, Forcing};
use crate::memory::{Cell, Extent};
use crate::service::{LatestReading, Service};
use crate::tape::Tape;
use device::{Channel, DeviceError, Direction, Driver, SafeHandle};
use std::cell::UnsafeCell;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock};

/// A device in the image of its source.
pub struct Device {
    pub(crate) name: String,
    pub(crate) channels: Vec<Channel>,
    pub(crate) readings: Cell,
    /// Values that blocks stored for the write channels.
    pub(crate) commands: Cell,
    /// For each channel: true if claimed by a running verb.
    pub(crate) engaged: Vec<AtomicBool>,
    pub(crate) standing: DeviceStanding,
    pub(crate) forcing: Forcing,
    /// While set, every write outputs the safe values; the first such write calls the driver's `safe_state`.
    pub(crate) stop: OnceLock<Arc<AtomicBool>>,
    pub(crate) is_asking: AtomicBool,
    /// Sends requests to a remote device.
    pub(crate) calls: OnceLock<Box<dyn Fn(DeviceCall) + Send + Sync>>,
    pub(crate) safe_handles: Mutex<Arc<Vec<SafeHandle>>>,
    /// Latest readings, published for an heir of the device.
    pub(crate) seen: LatestReading,
    pub(crate) service: UnsafeCell<Service>,
}

// SAFETY: `service` is touched only by the kernel of the device's source; the rest is atomic or never changes.
unsafe impl Send for Device {}
// SAFETY: as for `Send`.
unsafe impl Sync for Device {}

impl Device {
    /// Opens the device. Its commands initially hold their safe values.
    pub fn open(name: &str, mut driver: Box<dyn Driver>, now_ns: i64) -> Result<Arc<Device>, DeviceError> {
        driver.open(now_ns)?;
        let safe_handles = Mutex::new(Arc::new(driver.safe_handles()));
        let channels = driver.channels().to_vec();
        let end = |direction| channels.iter().filter(|channel| channel.direction == direction).map(|channel| channel.offset + channel.len).max().unwrap_or(0);
        let (readings_len, commands_len) = (end(Direction::Read), end(Direction::Write));
        let readings = Extent::new(readings_len).cell(0, readings_len);
        let commands = Extent::new(commands_len).cell(0, commands_len);
        for channel in channels.iter().filter(|channel| channel.direction == Direction::Write) {
            assert_eq!(
                channel.safe.len(),
                channel.len,
                "channel '{}' of device '{name}' has {} bytes, but its safe value has {}",
                channel.name,
                channel.len,
                channel.safe.len()
            );
            commands.part(channel.offset, channel.len).store(&channel.safe);
        }
        let writes = channels.iter().filter(|channel| channel.direction == Direction::Write).count();
        let (out, engaged) = (commands.load(), vec![false; writes]);
        let service = Service {
            driver,
            out,
            engaged,
            unforced: vec![0; readings_len],
            was_forced: false,
            written_ns: None,
            was_stopped: false,
            ahead_ns: 0,
            shows: None,
            looks: None,
            is_new: false,
            is_closed: false,
        };
        Ok(Arc::new(Device {
            name: name.to_owned(),
            readings,
            commands,
            engaged: channels.iter().map(|_| AtomicBool::new(false)).collect(),
            standing: DeviceStanding::new(channels.len()),
            forcing: Forcing::new(channels.len()),
            channels,
            stop: OnceLock::new(),
            is_asking: AtomicBool::new(false),
            calls: OnceLock::new(),
            safe_handles,
            seen: LatestReading::default(),
            service: UnsafeCell::new(service),
        }))
    }

    /// Returns the complete images of the readings and the commands.
    pub fn images(&self) -> (&Cell, &Cell) {
        (&self.readings, &self.commands)
    }

    /// Returns the device's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the device's channels; other methods take indices into this slice.
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// Returns the handles that bring the device's outputs to their safe state without the help of this process; empty if the driver does
    /// not support this.
    pub fn safe_handles(&self) -> Arc<Vec<SafeHandle>> {
        self.safe_handles.lock().expect("nobody panics with the lock held").clone()
    }

    /// Replaces the device's safe handles when another driver takes over the device.
    pub fn set_safe_handles(&self, handles: Arc<Vec<SafeHandle>>) {
        *self.safe_handles.lock().expect("nobody panics with the lock held") = handles;
    }

    /// Returns the device's state: whether it is lost, the requests of its channels, and how often their slew limits took effect.
    pub fn standing(&self) -> &DeviceStanding {
        &self.standing
    }

    /// Sets the function that sends requests to a remote device. Set once in the lifetime of a device.
    pub fn ask_through(&self, calls: Box<dyn Fn(DeviceCall) + Send + Sync>) {
        let _first = self.calls.set(calls);
    }

    /// Returns the readings that the device's heir sees.
    pub fn seen(&self) -> &LatestReading {
        &self.seen
    }

    /// Returns the state that an exchange between two firings changes: the driver, the last outputs, and the readings for an heir.
    ///
    /// # Safety
    /// No other thread may access the state: call this only from the kernel of the device's source, or while no kernel has the device in a table.
    #[expect(clippy::mut_from_ref, reason = "the caller is the one that touches it")]
    pub unsafe fn service(&self) -> &mut Service {
        // SAFETY: the caller's word.
        unsafe { &mut *self.service.get() }
    }

    /// Returns the same state through exclusive access to the device.
    pub fn service_mut(&mut self) -> &mut Service {
        self.service.get_mut()
    }

    /// Returns true if `block` reads one of the device's channels.
    pub(crate) fn is_read_by(&self, block: &Block) -> bool {
        let readings = self.readings.start() as usize..self.readings.start() as usize + self.readings.len();
        block.parts().2.iter().flatten().any(|cell| readings.contains(&(cell.start() as usize)))
    }

    /// Returns the cell of a channel, to which blocks with a device item bind.
    pub fn cell(&self, channel: usize) -> Cell {
        let declared = &self.channels[channel];
        match declared.direction {
            Direction::Read => self.readings.part(declared.offset, declared.len),
            Direction::Write => self.commands.part(declared.offset, declared.len),
        }
    }

    /// Marks a write channel as claimed or free, by an atomic flag. Takes effect at the next write.
    pub fn engage(&self, channel: usize, engaged: bool) {
        self.engaged[channel].store(engaged, Ordering::Release);
    }

    /// Returns the number of times the slew limit of a channel took effect.
    pub fn slew_limited(&self, channel: usize) -> u64 {
        self.standing.limited[channel].load(Ordering::Relaxed)
    }

    /// Makes every write output the safe values while `stop` is set; the first such write calls the driver's `safe_state`. The flag is
    /// set once in the lifetime of a device.
    pub fn obey(&self, stop: Arc<AtomicBool>) {
        // A second call would pass the same flag: a host has only one.
        let _first = self.stop.set(stop);
    }

    fn is_stopped(&self) -> bool {
        self.stop.get().is_some_and(|stop| stop.load(Ordering::Acquire))
    }

    /// Makes read channel `channel` request `what` whenever its value is not 0 (or, with `at_zero`, whenever it is 0), starting with the
    /// next reading.
    pub fn ask(&self, channel: usize, what: Ask, at_zero: bool) {
        let asked = what;
        let what = if what == Ask::Stop { STOP } else { TELL };
        // Until the first reading, a permission counts as not granted and a stop as not requested.
        self.standing.asking[channel].now.store(what == TELL, Ordering::Release);
        self.standing.asking[channel].what.store(if at_zero { what | AT_ZERO } else { what }, Ordering::Release);
        self.is_asking.store(true, Ordering::Release);
        self.call(DeviceCall::Ask { channel: channel as u32, what: asked, at_zero });
    }

    /// Returns true if `channel` made its request in the latest reading or the device is lost.
    pub fn asks(&self, channel: usize) -> bool {
        self.standing.asking[channel].now.load(Ordering::Acquire)
    }

    /// Returns true if the channel made its request in any reading since the last `forget`.
    pub fn asked(&self, channel: usize) -> bool {
        self.standing.asking[channel].once.load(Ordering::Acquire)
    }

    /// Forces a channel to the bytes of this word from the next exchange on; `None` ends the forcing. A forced command is written only
    /// while the channel is claimed and no emergency stop is in force, and within the slew limit. Panics if the channel is longer than a
    /// word.
    pub fn force(&self, channel: usize, value: Option<u64>) {
        assert!(self.channels[channel].len <= FORCED_LEN_MAX, "channel '{}' is too long to be forced", self.channels[channel].name);
        self.forcing.set(channel, value);
        self.call(DeviceCall::Force { channel: channel as u32, value });
    }

    /// Ends the forcing of all channels.
    pub fn unforce_all(&self) {
        (0..self.channels.len()).filter(|channel| self.forcing.of(*channel).is_some()).for_each(|channel| self.force(channel, None));
    }

    /// Forwards a call to the processor of a remote device; does nothing for a local one.
    pub fn call(&self, call: DeviceCall) {
        if let Some(calls) = self.calls.get() {
            calls(call);
        }
    }

    /// Clears the record that `channel` made its request.
    pub fn forget(&self, channel: usize) {
        self.standing.asking[channel].once.store(false, Ordering::Release);
        self.standing.forgotten.fetch_add(1, Ordering::AcqRel);
        self.call(DeviceCall::Forget { channel: channel as u32 });
    }

    /// Returns true if the device has failed; it is then no longer read or written.
    pub fn is_lost(&self) -> bool {
        self.standing.lost.load(Ordering::Acquire)
    }

    /// Reads every channel.
    ///
    /// # Safety
    /// Must be called only by the kernel of the device's source.
    pub(crate) unsafe fn read(&self, release_ns: i64, tape: Option<&dyn Tape>) -> Result<(), DeviceError> {
        if self.is_lost() {
            return Ok(());
        }
        // SAFETY: the caller is the one that touches both.
        let (service, readings) = unsafe { (&mut *self.service.get(), std::slice::from_raw_parts_mut(self.readings.start(), self.readings.len())) };
        let mut live = |readings: &mut [u8]| {
            // A driver that has nothing new leaves its readings as they are: they must be its own.
            if std::mem::take(&mut service.was_forced) {
                readings.copy_from_slice(&service.unforced);
            }
            match &mut service.looks {
                None => service.driver.read(release_ns + service.ahead_ns, readings),
                Some(looks) => looks.read(release_ns, readings),
            }?;
            if self.forcing.is_any() {
                service.unforced.copy_from_slice(readings);
                service.was_forced = true;
                self.forcing.replace(&self.channels, readings);
            }
            Ok(())
        };
        let read = match tape {
            None => live(readings),
            Some(tape) => tape.read(readings, &mut live),
        };
        if let Some(shows) = &mut service.shows {
            shows.group()[..readings.len()].copy_from_slice(readings);
            shows.publish(0, release_ns);
        }
        self.checked(service, read)?;
        self.standing.read.store(true, Ordering::Release);
        Ok(())
    }

    /// Checks the channels with requests after a reading. Returns true if one of them changed, so that the supervisor must be notified.
    /// `is_blind`: there are no valid readings (the device is lost or its source has stopped), which counts as a request.
    ///
    /// # Safety
    /// Same as for `read`.
    pub(crate) unsafe fn look(&self, is_blind: bool) -> bool {
        if !self.is_asking.load(Ordering::Acquire) {
            return false;
        }
        let mut changed = false;
        for (asking, channel) in self.standing.asking.iter().zip(&self.channels) {
            let what = asking.what.load(Ordering::Acquire);
            if what == OFF {
                continue;
            }
            // SAFETY: the channel lies within the readings, which only this source's kernel stores to.
            let reading = unsafe { std::slice::from_raw_parts(self.readings.start().add(channel.offset), channel.len) };
            let is_zero = reading.iter().all(|byte| *byte == 0);
            let asks = is_blind || is_zero == (what & AT_ZERO != 0);
            if asks {
                changed |= !asking.once.swap(true, Ordering::AcqRel);
                if let (true, Some(stop)) = (what & STOP != 0, self.stop.get()) {
                    stop.store(true, Ordering::Release);
                }
            }
            // A stopped source is restarted by a reset; a value that it cannot read now must not prevent that.
            let asks = asks && (!is_blind || self.is_lost());
            changed |= asking.now.swap(asks, Ordering::AcqRel) != asks;
        }
        changed
    }

    /// Writes every channel: claimed ones as forced or stored, within their slew limits, the others with safe values. In the first write
    /// after an emergency stop, the driver brings the device to its safe state instead.
    ///
    /// # Safety
    /// Same as for `read`.
    pub(crate) unsafe fn write(&self, release_ns: i64, tape: Option<&dyn Tape>) -> Result<(), DeviceError> {
        if self.is_lost() {
            return Ok(());
        }
        // SAFETY: the caller is the one that touches it.
        let service = unsafe { &mut *self.service.get() };
        let (is_stopped, is_forcing) = (self.is_stopped(), self.forcing.is_any());
        let elapsed_s = service.written_ns.map_or(0.0, |written| (release_ns - written) as f64 * 1e-9);
        let writes = self.channels.iter().enumerate().filter(|(_, channel)| channel.direction == Direction::Write);
        for (place, (index, channel)) in writes.enumerate() {
            let engaged = self.engaged[index].load(Ordering::Acquire) && !is_stopped;
            service.engaged[place] = engaged;
            let out = &mut service.out[channel.offset..channel.offset + channel.len];
            if !engaged {
                out.copy_from_slice(&channel.safe);
                continue;
            }
            // SAFETY: the channel lies within the commands, which only this source stores to.
            let stored = unsafe { std::slice::from_raw_parts(self.commands.start().add(channel.offset), channel.len) };
            let forced = if is_forcing { self.forcing.of(index) } else { None };
            let command = forced.as_ref().map_or(stored, |bytes| &bytes[..channel.len]);
            match channel.slew_max {
                Some(slew_max) if channel.len == size_of::<f64>() => {
                    if limit(out, command, slew_max * elapsed_s) {
                        let count = &self.standing.limited[index];
                        count.store(count.load(Ordering::Relaxed) + 1, Ordering::Relaxed);
                    }
                }
                _ => out.copy_from_slice(command),
            }
        }
        if std::mem::take(&mut service.is_new) {
            self.seen.written(release_ns - service.written_ns.unwrap_or(release_ns));
        }
        service.written_ns = Some(release_ns);
        let written = service.send(release_ns, is_stopped, tape);
        self.checked(service, written)
    }

    /// Stores the safe values of `channels`, frees the channels, and writes the values immediately if the device is not lost.
    ///
    /// # Safety
    /// Same as for `read`.
    pub(crate) unsafe fn make_safe(&self, release_ns: i64, channels: &[u16], tape: Option<&dyn Tape>) -> Result<(), DeviceError> {
        // SAFETY: the caller is the one that touches it.
        let service = unsafe { &mut *self.service.get() };
        for (place, (index, channel)) in self.channels.iter().enumerate().filter(|(_, channel)| channel.direction == Direction::Write).enumerate() {
            if channels.iter().any(|asked| usize::from(*asked) == index) {
                self.engage(index, false);
                service.engaged[place] = false;
                // SAFETY: the channel lies within the commands; `safe` has its length (checked at opening).
                unsafe { self.commands.start().add(channel.offset).copy_from_nonoverlapping(channel.safe.as_ptr(), channel.len) };
                service.out[channel.offset..channel.offset + channel.len].copy_from_slice(&channel.safe);
            }
        }
        // The channels of a lost device are freed too, so that no stale command is written when it is reopened.
        if self.is_lost() {
            return Ok(());
        }
        let written = service.send(release_ns, self.is_stopped(), tape);
        self.checked(service, written)
    }

    /// Brings all outputs to their safe state.
    ///
    /// # Safety
    /// Same as for `read`.
    pub(crate) unsafe fn safe_state(&self) {
        // SAFETY: the caller is the one that touches it.
        let service = unsafe { &mut *self.service.get() };
        for channel in self.channels.iter().filter(|channel| channel.direction == Direction::Write) {
            // SAFETY: as in `make_safe`.
            unsafe { self.commands.start().add(channel.offset).copy_from_nonoverlapping(channel.safe.as_ptr(), channel.len) };
            service.out[channel.offset..channel.offset + channel.len].copy_from_slice(&channel.safe);
        }
        service.driver.safe_state();
    }

    /// Closes the driver. This is the last call by the device's kernel; other references to the device may exist much longer.
    ///
    /// # Safety
    /// Same as for `service`.
    pub unsafe fn close(&self) {
        // SAFETY: the caller is the one that touches it.
        unsafe { &mut *self.service.get() }.close();
        // The guard has its own copies of the handles registered with it.
        if let Ok(mut handles) = self.safe_handles.lock() {
            *handles = Arc::default();
        }
    }

    /// Returns true if a channel of the device is claimed, which means that stored values are written.
    pub fn is_commanded(&self) -> bool {
        self.engaged.iter().any(|engaged| engaged.load(Ordering::Acquire))
    }

    /// Brings the device to its safe state, and stops its reads and writes.
    ///
    /// # Safety
    /// Same as for `read`.
    pub(crate) unsafe fn lose(&self) {
        self.standing.lost.store(true, Ordering::Release);
        // SAFETY: the caller is the one that touches it.
        unsafe { self.safe_state() };
    }

    fn checked(&self, service: &mut Service, result: Result<(), DeviceError>) -> Result<(), DeviceError> {
        if result.is_err() {
            self.standing.lost.store(true, Ordering::Release);
            service.driver.safe_state();
        }
        result
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        self.service.get_mut().close();
    }
}

/// Moves `out` towards `command` by at most `step`; returns true if the step was limited.
fn limit(out: &mut [u8], command: &[u8], step: f64) -> bool {
    let value = |bytes: &[u8]| f64::from_ne_bytes(bytes.try_into().expect("a channel with a slew limit is a double"));
    let (from, to) = (value(out), value(command));
    let limited = to.clamp(from - step, from + step);
    out.copy_from_slice(&limited.to_ne_bytes());
    limited != to
}
