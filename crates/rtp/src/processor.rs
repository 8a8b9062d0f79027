// SPDX-License-Identifier: Apache-2.0
//! The commanding side: a remote processor, as a host here sees it.
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

/// A device that was opened there: its channels, and what the driver says of itself (JSON).
#[derive(Debug)]
pub struct OpenedDevice {
    /// Channels by index, as everywhere.
    pub channels: Vec<Channel>,
    /// JSON text.
    pub description: String,
}

/// A process with the sources of a processor, or of several. It outlives that process: after a loss another one may take its place.
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
    /// Counters of the devices' drivers.
    counted: Mutex<HashMap<String, DriverCounters>>,
    is_up: AtomicBool,
    /// Its loss is being told.
    is_leaving: AtomicBool,
    /// Cause of its last loss, in words.
    lost: Mutex<Option<String>>,
    /// Bound for its silence.
    silence_ms: AtomicU64,
    running: Mutex<Option<Arc<dyn ProcessorProcess>>>,
    /// Blocks of the steps of the table of each source there.
    tables: Mutex<HashMap<SourceId, Vec<Option<BlockId>>>>,
    closing: AtomicBool,
    /// Processes run there that this side has not taken over yet.
    is_adopted: AtomicBool,
    host: Mutex<Weak<Host>>,
}

/// Message to the processor.
#[derive(Default)]
struct Wire {
    outbox: Option<Outbox<Vec<u8>>>,
    writer: Writer,
    scripts: HashMap<u64, Box<Script>>,
    modules: HashSet<String>,
    last: u64,
}

/// Bound for the answer to a question: opening a device or trying a module takes its time, taking a process none.
const ANSWER: Duration = Duration::from_secs(30);
/// A service may move a machine: who waits for it decides for how long.
const SERVICE: Duration = Duration::from_secs(24 * 3600);
const TAKE: Duration = Duration::from_secs(2);

/// Time without another message after which this side says that it is there.
const ALIVE: Duration = Duration::from_millis(500);

/// Between two looks at whether it is silent.
const LOOK: Duration = Duration::from_millis(50);

impl Processor {
    /// Makes a processor that is not there yet, by the name of the process, on another host that of the processor. `host_name`: where it runs, none
    /// on this host.
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

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Bounds for the silence of each side.
    pub fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    /// Returns false before the first greeting, and after a loss.
    pub fn is_up(&self) -> bool {
        self.is_up.load(Ordering::Acquire)
    }

    /// Returns whether it needs a new process. A caller that has just been told of its loss waits here until that is complete.
    pub fn is_down(&self) -> bool {
        let mut answers = locked(&self.answers);
        while self.is_leaving.load(Ordering::Acquire) {
            answers = self.answered.wait_timeout(answers, LOOK).expect("nobody panics with the lock held").0;
        }
        !self.is_up()
    }

    /// Greets a process that was started for it, and tells it which sources the system has. After a loss a new process takes the place of
    /// the old one so.
    ///
    /// # Errors
    /// In words: no answer, another version.
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
        // A process that only stands still is its guard's to judge.
        let silence = silence.max(self.bounds.lost_after.unwrap_or_default());
        self.silence_ms.store(silence.as_millis() as u64, Ordering::Relaxed);
        *locked(&self.host) = Arc::downgrade(host);
        self.is_up.store(true, Ordering::Release);
        let sender = link.clone();
        let spawn = |name: &str, body: Box<dyn FnOnce() + Send>| {
            std::thread::Builder::new().name(name.into()).spawn(body).map(drop).map_err(|why| format!("a thread for it cannot be started: {why}"))
        };
        spawn("rtp-sends", Box::new(move || send_all(&frames, &*sender)))?;
        let (this, host) = (self.clone(), Arc::downgrade(host));
        spawn("rtp-hears", Box::new(move || this.hear(&host, &link)))?;
        self.patience();
        let sources = locked(&self.sources).clone();
        sources.into_iter().try_for_each(|(_, spec, here)| self.tell_source(spec, here))
    }

    /// Expects a source that the system has already: it is told of when a process is there.
    pub fn expect_source(&self, source: SourceId, spec: &SourceSpec, here: bool) {
        locked(&self.sources).push((source, spec.clone(), here));
    }

    /// Adds the next source of the system; `here`: it runs there.
    ///
    /// # Errors
    /// In words: it cannot be started, or it does not answer.
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

    /// Makes sure that a module's code is there.
    ///
    /// # Errors
    /// In words: it is of another architecture, damaged, or it does not answer.
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

    /// Opens a device there.
    ///
    /// # Errors
    /// In words: what the driver says, or it does not answer.
    pub fn open(&self, device: &str, kind: &str, options: &str) -> Result<OpenedDevice, String> {
        let (device, kind, options) = (device.to_owned(), kind.to_owned(), options.to_owned());
        match self.ask(ANSWER, |ticket| Order::Open { ticket, device, kind, options })? {
            Answer::Opened { channels, description } => Ok(OpenedDevice { channels, description }),
            Answer::Refused(why) => Err(why),
            _ => Err("it gave another answer than was asked for".to_owned()),
        }
    }

    /// Carries out a service of a driver there; arguments and answer are JSON. It lasts as long as the driver takes.
    ///
    /// # Errors
    /// Why it was not carried out, or it does not answer.
    pub fn service(&self, device: &str, service: &str, arguments: &str) -> Result<String, ServiceError> {
        let (device, service, arguments) = (device.to_owned(), service.to_owned(), arguments.to_owned());
        match self.ask(SERVICE, |ticket| Order::Service { ticket, device, service, arguments }) {
            Ok(Answer::Served(served)) => served,
            Ok(Answer::Refused(why)) | Err(why) => Err(ServiceError::Failed(why)),
            Ok(_) => Err(ServiceError::Failed("it gave another answer than was asked for".to_owned())),
        }
    }

    /// Returns the counters of a device's driver there, by name, as they were told last.
    pub fn counted(&self, device: &str) -> Vec<(String, u64)> {
        locked(&self.counted).get(device).cloned().unwrap_or_default()
    }

    /// Returns the device, as tables here have it.
    ///
    /// # Errors
    /// Channels that do not fit together, in words.
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

    /// Returns whether processes run there that an earlier supervisor has left and that have not been taken over.
    pub fn is_adopted(&self) -> bool {
        self.is_adopted.load(Ordering::Acquire)
    }

    /// Takes over the processes that ran there without a supervisor: they go on in the sources that this side has made since. None where there were none.
    ///
    /// # Errors
    /// In words: it must not go on, or it does not answer.
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
            _ => Err("it gave another answer than was asked for".to_owned()),
        }
    }

    /// Closes a device there, behind what was submitted before.
    pub fn shut(&self, device: &str) {
        locked(&self.devices).remove(device);
        locked(&self.counted).remove(device);
        self.send(&Order::Shut { device: device.to_owned() });
    }

    /// Says what becomes of a process in a source there if its supervisor is gone: it goes on (`Some(None)`), a script is carried out, or
    /// nothing happens.
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

    /// Sets how long this side may be silent, and how long the processor goes on without it.
    fn patience(&self) {
        let ms = |limit: Duration| u64::try_from(limit.as_millis()).unwrap_or(u64::MAX);
        self.send(&Order::Patience { ms: ms(self.bounds.patience), silence_ms: ms(self.bounds.silence), standstill_ms: self.bounds.lost_after.map(ms) });
    }

    fn send(&self, order: &Order) {
        locked(&self.wire).send(order);
    }

    /// Returns the refusal that says that it is not there, and why.
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
            // Where the other side is gone, who hears it says so.
            let _sent = outbox.send(frame(order));
        }
    }
}

/// Sends what there is, and a sign of life where there is nothing, until this side or the other one ends it.
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
