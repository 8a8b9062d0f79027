// SPDX-License-Identifier: Apache-2.0
//! Commanding side: a remote processor as seen by a local host.
mod hears;
mod remote;

use crate::module::{self, Module};
use crate::places::{Bounds, Near, ProcessorProcess, StartedProcessor};
use crate::protocol::{Answer, DriverCounters, News, Order, TakenOver, VERSION, frame, opened};
use crate::shared::locked;
use device::{Channel, ServiceError};
use interconnect::{ConnectionSpec, EndError, Link, Receiver, Sender};
use kernel::{BlockId, BlockTimes, Device, Event, Op, RemoteWord, Script, SourceId, SourceSpec, Statistics, TakeResult};
use opengpac::abi::ABI as ABI_VERSION;
use process_kit::Silence;
use runtime::encoding::Writer;
use runtime::{Host, Remote, remote_device};
use std::collections::{HashMap, HashSet};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver as Frames, RecvTimeoutError, Sender as Outbox, channel};
use std::sync::{Arc, Condvar, Mutex, Weak};
use std::time::Duration;

/// A device opened in a remote processor: its channels, and the driver's description of itself (JSON).
#[derive(Debug)]
pub struct OpenedDevice {
    /// Channels, by index.
    pub channels: Vec<Channel>,
    /// Description as JSON text.
    pub description: String,
}

/// A process with the sources of one or several processors. This value outlives the process: after a loss, another process may replace
/// it.
pub struct Processor {
    name: String,
    bounds: Bounds,
    host_name: Option<String>,
    near: Mutex<Option<Near>>,
    wire: Mutex<Wire>,
    answers: Mutex<HashMap<u64, Option<Answer>>>,
    answered: Condvar,
    sources: Mutex<Vec<(SourceId, SourceSpec, bool)>>,
    statistics: Mutex<HashMap<SourceId, Statistics>>,
    block_times: Mutex<HashMap<BlockId, BlockTimes>>,
    devices: Mutex<HashMap<String, Weak<Device>>>,
    /// Counters maintained by the drivers of the devices.
    counted: Mutex<HashMap<String, DriverCounters>>,
    is_up: AtomicBool,
    /// Set while the processor's loss is being reported.
    is_leaving: AtomicBool,
    /// Human-readable cause of the processor's last loss.
    lost: Mutex<Option<String>>,
    /// Maximum silence of the processor.
    silence_ms: AtomicU64,
    running: Mutex<Option<Arc<dyn ProcessorProcess>>>,
    /// Blocks of the steps in the table of each remote source.
    tables: Mutex<HashMap<SourceId, Vec<Option<BlockId>>>>,
    closing: AtomicBool,
    /// True if the processor runs processes that this side has not taken over yet.
    is_adopted: AtomicBool,
    host: Mutex<Weak<Host>>,
}

/// Connection for messages to the processor.
#[derive(Default)]
struct Wire {
    outbox: Option<Outbox<Vec<u8>>>,
    writer: Writer,
    scripts: HashMap<u64, Box<Script>>,
    modules: HashSet<String>,
    last: u64,
}

/// Timeout for answers. Long, because opening a device or trying a module takes time.
const ANSWER: Duration = Duration::from_secs(30);
/// Timeout for services, which may move a machine. In practice, the waiting client decides how long to wait.
const SERVICE: Duration = Duration::from_secs(24 * 3600);
const TAKE: Duration = Duration::from_secs(2);

/// Time without another message after which this side sends an `Alive` message.
const ALIVE: Duration = Duration::from_millis(500);

/// Poll period for silence.
const LOOK: Duration = Duration::from_millis(50);

impl Processor {
    /// Creates a processor that has no process yet, named after its process or, on another host, after the processor. `host_name`: host
    /// on which it runs, `None` for this host.
    pub fn new(name: &str, host_name: Option<&str>, bounds: Bounds) -> Arc<Processor> {
        Arc::new(Processor {
            name: name.to_owned(),
            bounds,
            host_name: host_name.map(str::to_owned),
            near: Mutex::new(None),
            wire: Mutex::default(),
            answers: Mutex::default(),
            answered: Condvar::new(),
            sources: Mutex::default(),
            statistics: Mutex::default(),
            block_times: Mutex::default(),
            devices: Mutex::default(),
            counted: Mutex::default(),
            is_up: AtomicBool::new(false),
            is_leaving: AtomicBool::new(false),
            lost: Mutex::default(),
            silence_ms: AtomicU64::new(0),
            running: Mutex::default(),
            tables: Mutex::default(),
            closing: AtomicBool::new(false),
            is_adopted: AtomicBool::new(false),
            host: Mutex::default(),
        })
    }

    /// Returns the name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the maximum silence of each side.
    pub fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    /// Returns false before the first greeting, and after a loss.
    pub fn is_up(&self) -> bool {
        self.is_up.load(Ordering::Acquire)
    }

    /// Returns true if the processor needs a new process. A caller that has just been notified of its loss waits here until the loss is
    /// complete.
    pub fn is_down(&self) -> bool {
        let mut answers = locked(&self.answers);
        while self.is_leaving.load(Ordering::Acquire) {
            answers = self.answered.wait_timeout(answers, LOOK).expect("nobody panics with the lock held").0;
        }
        !self.is_up()
    }

    /// Greets a process that was started for the processor, and sends it the sources of the system. After a loss, this replaces the old
    /// process with a new one.
    ///
    /// # Errors
    /// Fails with a message if there is no answer or the version differs.
    pub fn attach(self: &Arc<Self>, host: &Arc<Host>, system: &str, started: StartedProcessor) -> Result<(), String> {
        let StartedProcessor { link, near, running, silence, is_adopted } = started;
        let greeting = Order::Greet { version: VERSION, abi: ABI_VERSION, system: system.to_owned(), processor: self.name.clone(), epoch_ns: host.epoch_ns() };
        link.send(&frame(&greeting)).map_err(|why| why.to_string())?;
        let welcome = link.receive(ANSWER).map_err(|_| format!("its process {}", running.cause()))?;
        let Some(News::Welcome { refused, target, .. }) = welcome.map(|bytes| opened::<News>(&bytes)).transpose()? else {
            return Err("it does not answer the greeting".to_owned());
        };
        if let Some(refused) = refused {
            return Err(format!("it refuses ({target}): {refused}"));
        }
        let (outbox, frames) = channel::<Vec<u8>>();
        {
            let mut wire = locked(&self.wire);
            *wire = Wire { outbox: Some(outbox), last: wire.last, ..Wire::default() };
        }
        (*locked(&self.near), *locked(&self.running)) = (Some(near), Some(running));
        self.is_adopted.store(is_adopted, Ordering::Release);
        // Judging a process that merely stands still is up to its guard.
        let silence = silence.max(self.bounds.lost_after.unwrap_or_default());
        self.silence_ms.store(silence.as_millis() as u64, Ordering::Relaxed);
        *locked(&self.host) = Arc::downgrade(host);
        self.is_up.store(true, Ordering::Release);
        let sender = link.clone();
        let spawn = |name: &str, body: Box<dyn FnOnce() + Send>| {
            std::thread::Builder::new().name(name.into()).spawn(body).map(drop).map_err(|why| format!("cannot start a thread for it: {why}"))
        };
        spawn("rtp-sends", Box::new(move || send_all(&frames, &*sender)))?;
        let (this, host) = (self.clone(), Arc::downgrade(host));
        spawn("rtp-hears", Box::new(move || this.hear(&host, &link)))?;
        self.patience();
        let sources = locked(&self.sources).clone();
        sources.into_iter().try_for_each(|(_, spec, here)| self.tell_source(spec, here))
    }

    /// Registers a source that the system already has, to be sent once the processor has a process.
    pub fn expect_source(&self, source: SourceId, spec: &SourceSpec, here: bool) {
        locked(&self.sources).push((source, spec.clone(), here));
    }

    /// Adds the next source of the system; `here`: the source runs in this processor.
    ///
    /// # Errors
    /// Fails with a message if the source cannot be started, or there is no answer.
    pub fn add_source(&self, source: SourceId, spec: &SourceSpec, here: bool) -> Result<(), String> {
        locked(&self.sources).push((source, spec.clone(), here));
        self.tell_source(spec.clone(), here)
    }

    fn tell_source(&self, spec: SourceSpec, here: bool) -> Result<(), String> {
        match self.ask(ANSWER, |ticket| Order::Source { ticket, spec, here })? {
            Answer::Refused(why) => Err(why),
            _ => Ok(()),
        }
    }

    /// Ensures that the processor has a module's code.
    ///
    /// # Errors
    /// Fails with a message if the module is damaged or for another architecture, or if there is no answer.
    pub fn ensure(&self, module: &Module) -> Result<(), String> {
        let key = module.key().to_owned();
        if key == module::LIBRARY || locked(&self.wire).modules.contains(&key) {
            return Ok(());
        }
        let (name, bytes) = (module.name().to_owned(), module.bytes().to_vec());
        match self.ask(ANSWER, |ticket| Order::Module { ticket, key: key.clone(), name, bytes })? {
            Answer::Refused(why) => Err(why),
            _ => {
                locked(&self.wire).modules.insert(key);
                Ok(())
            }
        }
    }

    /// Opens a device in the processor.
    ///
    /// # Errors
    /// Fails with the driver's message, or if there is no answer.
    pub fn open(&self, device: &str, kind: &str, options: &str) -> Result<OpenedDevice, String> {
        let (device, kind, options) = (device.to_owned(), kind.to_owned(), options.to_owned());
        match self.ask(ANSWER, |ticket| Order::Open { ticket, device, kind, options })? {
            Answer::Opened { channels, description } => Ok(OpenedDevice { channels, description }),
            Answer::Refused(why) => Err(why),
            _ => Err("its answer does not match the request".to_owned()),
        }
    }

    /// Carries out a service of a driver of the processor; arguments and answer are JSON. Takes as long as the driver does.
    ///
    /// # Errors
    /// Fails with the reason if the service was not carried out, or if there is no answer.
    pub fn service(&self, device: &str, service: &str, arguments: &str) -> Result<String, ServiceError> {
        let (device, service, arguments) = (device.to_owned(), service.to_owned(), arguments.to_owned());
        match self.ask(SERVICE, |ticket| Order::Service { ticket, device, service, arguments }) {
            Ok(Answer::Served(served)) => served,
            Ok(Answer::Refused(why)) | Err(why) => Err(ServiceError::Failed(why)),
            Ok(_) => Err(ServiceError::Failed("its answer does not match the request".to_owned())),
        }
    }

    /// Returns the counters maintained by a device's driver, by name, as last reported.
    pub fn counted(&self, device: &str) -> Vec<(String, u64)> {
        locked(&self.counted).get(device).cloned().unwrap_or_default()
    }

    /// Returns the device for use in local tables.
    ///
    /// # Errors
    /// Fails with a message if the channels are inconsistent.
    pub fn device(self: &Arc<Self>, name: &str, channels: Vec<Channel>) -> Result<Arc<Device>, String> {
        let (this, device) = (Arc::downgrade(self), name.to_owned());
        let calls = Box::new(move |call| {
            if let Some(this) = this.upgrade() {
                this.send(&Order::Device { device: device.clone(), call });
            }
        });
        let made = remote_device::open(name, channels, calls).map_err(|why| why.message)?;
        locked(&self.devices).insert(name.to_owned(), Arc::downgrade(&made));
        Ok(made)
    }

    /// Returns true if the processor runs processes of an earlier supervisor that have not been taken over.
    pub fn is_adopted(&self) -> bool {
        self.is_adopted.load(Ordering::Acquire)
    }

    /// Takes over the processes that ran in the processor without a supervisor: they continue in the sources that this side has created
    /// since. Returns `None` if there were none.
    ///
    /// # Errors
    /// Fails with a message if they must not continue, or there is no answer.
    pub fn take_over(&self) -> Result<Option<TakenOver>, String> {
        if !self.is_adopted() {
            return Ok(None);
        }
        match self.ask(ANSWER, |ticket| Order::TakeOver { ticket })? {
            Answer::TakenOver(report) => {
                if let Some(running) = locked(&self.running).as_ref() {
                    running.taken_over();
                }
                self.is_adopted.store(false, Ordering::Release);
                Ok(Some(report))
            }
            Answer::Refused(why) => Err(why),
            _ => Err("its answer does not match the request".to_owned()),
        }
    }

    /// Closes a device of the processor, after previously submitted work.
    pub fn shut(&self, device: &str) {
        locked(&self.devices).remove(device);
        locked(&self.counted).remove(device);
        self.send(&Order::Shut { device: device.to_owned() });
    }

    /// Sets what happens to a process in a source of the processor if its supervisor disconnects: the process continues (`Some(None)`), a
    /// script is carried out, or nothing happens.
    pub fn farewell(&self, process: u64, source: SourceId, script: Option<Option<&Script>>) {
        let mut wire = locked(&self.wire);
        let order = match script {
            None => Order::NoFarewell { process, source },
            Some(script) => {
                let parcel = script.and_then(|script| wire.writer.parcel(script, &module::name_of).ok());
                Order::Farewell { process, source, parcel }
            }
        };
        wire.send(&order);
    }

    /// Sends the maximum silence of this side, and the time for which the processor continues without a supervisor.
    fn patience(&self) {
        let ms = |limit: Duration| u64::try_from(limit.as_millis()).unwrap_or(u64::MAX);
        self.send(&Order::Patience { ms: ms(self.bounds.patience), silence_ms: ms(self.bounds.silence), standstill_ms: self.bounds.lost_after.map(ms) });
    }

    fn send(&self, order: &Order) {
        locked(&self.wire).send(order);
    }

    /// Returns the refusal that states that the processor is not connected, with the reason.
    fn gone(&self) -> String {
        match locked(&self.lost).as_ref() {
            Some(why) => format!("'{}' is lost: {why}", self.name),
            None => format!("'{}' has no process yet", self.name),
        }
    }

    /// Sends an order with a ticket, and waits for the answer.
    fn ask(&self, limit: Duration, order: impl FnOnce(u64) -> Order) -> Result<Answer, String> {
        let ticket = {
            let mut wire = locked(&self.wire);
            wire.last += 1;
            let ticket = wire.last;
            locked(&self.answers).insert(ticket, None);
            wire.send(&order(ticket));
            ticket
        };
        let mut silence = Silence::begins();
        let mut answers = locked(&self.answers);
        loop {
            if answers.get(&ticket).is_some_and(Option::is_some) {
                let answer = answers.remove(&ticket).flatten();
                return answer.ok_or_else(|| "it gave no answer".to_owned());
            }
            silence.looked(false);
            let left = limit.saturating_sub(silence.lasted());
            let is_gone = !self.is_up();
            if is_gone || left.is_zero() {
                answers.remove(&ticket);
                return Err(if is_gone { self.gone() } else { format!("'{}' has not answered for {} s", self.name, limit.as_secs()) });
            }
            answers = self.answered.wait_timeout(answers, left.min(LOOK)).expect("nobody panics with the lock held").0;
        }
    }
}

impl Wire {
    fn send(&mut self, order: &Order) {
        if let Some(outbox) = &self.outbox {
            // If the other side has disconnected, the receiving thread reports it.
            let _sent = outbox.send(frame(order));
        }
    }
}

/// Sends pending frames, or `Alive` messages if there are none, until either side closes the link.
fn send_all(frames: &Frames<Vec<u8>>, link: &dyn Link) {
    loop {
        let next = match frames.recv_timeout(ALIVE) {
            Ok(bytes) => bytes,
            Err(RecvTimeoutError::Timeout) => frame(&Order::Alive),
            Err(RecvTimeoutError::Disconnected) => return,
        };
        if link.send(&next).is_err() {
            return;
        }
    }
}

fn unreached() -> EndError {
    EndError { message: "the processor has no process yet".to_owned() }
}
