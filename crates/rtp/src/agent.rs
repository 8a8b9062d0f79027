// SPDX-License-Identifier: Apache-2.0
//! The processor's own side: it does what it is told.
use crate::ground::Grounds;
use crate::heart;
use crate::protocol::{Answer, News, Order, VERSION, frame, opened};
use crate::service::{Admitted, BlackBox, Caller, Door, OnDevice};
use crate::silence::Silence;
use crate::tells;
use interconnect::{Link, Memory};
use kernel::wire::{Parcel, Reader};
use kernel::{ClockKind, Device, DeviceCall, Holding, Host, SourceId};
use modules::Probe;
use opengpac::abi::ABI as ABI_VERSION;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::Duration;

/// The devices that were opened here, by name.
pub(crate) type Devices = Mutex<BTreeMap<String, Arc<Device>>>;

/// What the threads of a processor share.
pub(crate) struct Shared {
    pub host: Arc<Host>,
    pub link: Arc<dyn Link>,
    pub reader: Mutex<Reader>,
    pub devices: Arc<Devices>,
    /// Sources that run here.
    pub sources: Mutex<Vec<SourceId>>,
    /// What runs here is what this process is there for: its heart beats by it.
    pub leads: AtomicBool,
    pub ends: AtomicBool,
}

/// How long it waits for a frame before it looks around.
pub(crate) const LOOK: Duration = Duration::from_millis(100);

pub(crate) fn locked<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().expect("nobody panics with the lock held")
}

/// What serves one who commands.
pub(crate) struct Agent {
    pub shared: Arc<Shared>,
    /// What tells, and the heart.
    pub threads: Vec<JoinHandle<()>>,
    pub ground: Grounds,
    /// While it is set, every write of a device is the safe one.
    pub stop: Arc<AtomicBool>,
    pub farewells: HashMap<(u64, SourceId), Option<Parcel>>,
    /// Something goes on without anybody who commands.
    pub goes_on: bool,
    pub patience: Duration,
    /// Sources of the system so far, here or not.
    count: u32,
    /// Sources elsewhere that channels here raise.
    passed: HashSet<SourceId>,
    /// How each device was opened, and what its driver says of itself.
    opened: HashMap<String, Opening>,
    /// What each source has in force, or will have.
    pub held: BTreeMap<SourceId, Holding>,
    pub trade: Arc<Trade>,
    /// What runs here so far, and that this one is to take over.
    pub before: Option<Box<Agent>>,
    /// Who knocked when the link was about to be gone.
    pub caller: Option<Box<dyn Caller>>,
}

/// What all who command this processor, one after the other, have in common.
pub(crate) struct Trade {
    pub probe: Probe,
    pub epoch: Arc<dyn Fn(i64) -> i64 + Send + Sync>,
    pub device: OnDevice,
    pub beat: Arc<dyn Fn() + Send + Sync>,
    pub leaves: bool,
}

struct Opening {
    kind: String,
    options: serde_json::Value,
    description: String,
}

/// How serving one who commands ended.
pub(crate) enum Ended {
    /// As it said.
    Closed,
    /// It is gone without a word.
    Gone,
    /// What it said cannot be carried out.
    Broken(String),
}

impl Agent {
    /// For who greets over `link`. `before`: what runs here already.
    pub fn hired(admitted: Admitted, trade: &Arc<Trade>, before: Option<Box<Agent>>) -> Result<Agent, (String, Option<Box<Agent>>)> {
        let Admitted { link, reaches, black_box, is_unguarded } = admitted;
        if let (true, Some(before)) = (is_unguarded, &before) {
            locked(&before.shared.devices).values().for_each(|device| (trade.device)(device, true));
        }
        let (epoch_ns, name) = match greet(&link) {
            Ok(greeting) => greeting,
            Err(why) => return Err((why, before)),
        };
        let host = Arc::new(Host::since(ClockKind::Monotonic, Box::new(Memory), (trade.epoch)(epoch_ns)));
        if let Some(BlackBox { memory, len }) = black_box {
            // SAFETY: what `BlackBox` says of it.
            unsafe { host.set_black_box(memory, len) };
        }
        let shared = Arc::new(Shared {
            host: host.clone(),
            link,
            reader: Mutex::default(),
            devices: Arc::default(),
            sources: Mutex::default(),
            leads: AtomicBool::new(before.is_none()),
            ends: AtomicBool::new(false),
        });
        let (told, beating, beat) = (shared.clone(), shared.clone(), trade.beat.clone());
        let spawn = |name: &str, body: Box<dyn FnOnce() + Send>| std::thread::Builder::new().name(name.into()).spawn(body);
        let teller = spawn("tells", Box::new(move || tells::run(&told)));
        let threads = match teller.and_then(|teller| Ok(vec![teller, spawn("heart", Box::new(move || heart::run(&beating, &*beat)))?])) {
            Ok(threads) => threads,
            Err(why) => {
                shared.ends.store(true, Ordering::Release);
                return Err((format!("processor '{name}' cannot start a thread: {why}"), before));
            }
        };
        Ok(Agent {
            ground: Grounds::new(host, shared.devices.clone(), reaches, trade.probe.clone()),
            shared,
            threads,
            stop: Arc::default(),
            farewells: HashMap::new(),
            goes_on: false,
            patience: Duration::ZERO,
            count: 0,
            passed: HashSet::new(),
            opened: HashMap::new(),
            held: BTreeMap::new(),
            trade: trade.clone(),
            before,
            caller: None,
        })
    }

    /// Serves until the other side closes it, is gone or says nothing for too long; turns away whoever knocks meanwhile.
    pub fn run(&mut self, door: &mut Option<Box<dyn Door>>) -> Ended {
        let mut silence = Silence::begins();
        loop {
            // Who knocks just when the link breaks is not turned away.
            let limit = if self.caller.is_some() { Duration::ZERO } else { LOOK };
            let received = self.shared.link.receive(limit);
            silence.looked(matches!(received, Ok(Some(_))));
            match received {
                Ok(None) if !self.patience.is_zero() && silence.lasted() > self.patience => return Ended::Gone,
                Ok(None) => match self.caller.take() {
                    Some(caller) => caller.refuse(self.turning_away()),
                    None => self.caller = door.as_mut().and_then(|door| door.wait(Duration::ZERO)),
                },
                Ok(Some(bytes)) => match opened::<Order>(&bytes).and_then(|order| self.obey(order)) {
                    Ok(true) => return Ended::Closed,
                    Ok(false) => {}
                    Err(message) => {
                        self.say(&News::Broken { message: message.clone() });
                        return Ended::Broken(message);
                    }
                },
                Err(_) => return Ended::Gone,
            }
        }
    }

    fn turning_away(&self) -> &'static str {
        match self.before {
            Some(_) => "another system is about to take it over",
            None => "its system is there and commands it; only what has lost its system is taken over",
        }
    }

    fn say(&self, news: &News) {
        // Where nobody hears it, `receive` says so next.
        let _heard = self.shared.link.send(&frame(news));
    }

    fn answer(&self, ticket: u64, answer: Answer) {
        self.say(&News::Answer { ticket, answer });
    }

    /// Does what it is told; true where that was to end.
    fn obey(&mut self, order: Order) -> Result<bool, String> {
        match order {
            Order::Greet { .. } => return Err("a second greeting".to_owned()),
            Order::Source { ticket, spec, here } => {
                let answer = self.source(spec, here);
                self.answer(ticket, answer);
            }
            Order::Work { source, submission, parcel } => self.work(source, submission, parcel)?,
            Order::Request { source } => self.shared.host.request(self.mine(source)?),
            Order::Restart { source } => self.shared.host.restart(self.mine(source)?),
            Order::Probe { source, for_ns } => self.shared.host.probe(self.mine(source)?, for_ns),
            Order::Take { ticket, process, generation, insist } => {
                let taken = locked(&self.shared.reader).process_of(process).map(|process| process.take(generation, insist));
                self.answer(ticket, Answer::Taken(taken));
            }
            Order::Enter { process, stage, generation } => {
                if let Some(process) = locked(&self.shared.reader).process_of(process) {
                    process.at_stage(stage, generation);
                }
            }
            Order::Module { ticket, key, name, bytes } => {
                let loaded = self.ground.load(&key, &name, &bytes);
                self.answer(ticket, loaded.map_or_else(Answer::Refused, |()| Answer::Done));
            }
            Order::Open { ticket, device, kind, options } => {
                let answer = self.open(&device, &kind, &options).unwrap_or_else(Answer::Refused);
                self.answer(ticket, answer);
            }
            Order::Shut { device } => {
                self.opened.remove(&device);
                let shut = locked(&self.shared.devices).remove(&device);
                // One that is not taken over yet stays where it runs.
                if let Some(device) = shut.filter(|device| !self.is_before(device.name())) {
                    (self.trade.device)(&device, false);
                }
            }
            Order::Device { device, call } => {
                if let Some(device) = locked(&self.shared.devices).get(&device) {
                    match call {
                        DeviceCall::Ask { channel, what, at_zero } if (channel as usize) < device.channels().len() => {
                            device.ask(channel as usize, what, at_zero)
                        }
                        DeviceCall::Forget { channel } if (channel as usize) < device.channels().len() => device.forget(channel as usize),
                        _ => return Err(format!("device '{}' has no such channel", device.name())),
                    }
                }
            }
            Order::Stop { set } => self.stop.store(set, Ordering::Release),
            Order::Farewell { process, source, parcel } => {
                self.farewells.insert((process, self.mine(source)?), parcel);
            }
            Order::NoFarewell { process, source } => drop(self.farewells.remove(&(process, source))),
            Order::Alive => {}
            Order::Patience { ms } => self.patience = Duration::from_millis(ms),
            Order::TakeOver { ticket } => {
                let answer = self.take_over().map_or_else(Answer::Refused, Answer::TakenOver);
                self.answer(ticket, answer);
            }
            Order::Close => return Ok(true),
        }
        Ok(false)
    }

    /// A source that runs here, by its number.
    fn mine(&self, source: SourceId) -> Result<SourceId, String> {
        if locked(&self.shared.sources).contains(&source) { Ok(source) } else { Err(format!("source {} does not run here", source.0)) }
    }

    fn source(&mut self, spec: kernel::SourceSpec, here: bool) -> Answer {
        if !here {
            self.shared.host.skip_source(spec);
            self.count += 1;
            return Answer::Done;
        }
        let name = spec.name.clone();
        match self.shared.host.add_source(spec) {
            Ok(source) => {
                locked(&self.shared.sources).push(source);
                self.count += 1;
                Answer::Done
            }
            Err(why) => Answer::Refused(format!("source '{name}' cannot be started: {why}")),
        }
    }

    fn work(&mut self, source: SourceId, submission: u64, parcel: Parcel) -> Result<(), String> {
        let source = self.mine(source)?;
        let script = locked(&self.shared.reader).open(submission, parcel, &mut self.ground)?;
        if let Some(kernel::Op::Table(table)) = script.ops.iter().rfind(|op| matches!(op, kernel::Op::Table(_))) {
            self.held.insert(source, table.holding(source));
        }
        self.pass_on()?;
        self.shared.host.submit(source, script);
        Ok(())
    }

    /// Sources elsewhere that a channel here raises are raised by who commands.
    fn pass_on(&mut self) -> Result<(), String> {
        let raised: Vec<SourceId> =
            locked(&self.shared.reader).raised().filter(|source| !self.passed.contains(source) && self.mine(*source).is_err()).collect();
        for source in raised.into_iter().filter(|source| source.0 < self.count) {
            let link = self.shared.link.clone();
            let request = move || {
                // Where nobody hears it, `receive` says so next.
                let _heard = link.send(&frame(&News::Raised { source }));
            };
            self.shared.host.pass_on(source, Box::new(request)).map_err(|why| format!("a thread cannot be started: {why}"))?;
            self.passed.insert(source);
        }
        Ok(())
    }

    fn open(&mut self, name: &str, kind: &str, options: &str) -> Result<Answer, String> {
        let options: serde_json::Value = serde_json::from_str(options).map_err(|why| format!("the options of device '{name}' are no JSON: {why}"))?;
        let known = locked(&self.shared.devices).get(name).filter(|device| device.is_lost()).cloned();
        if let Some(lost) = known {
            return self.reopen(&lost, kind, &options);
        }
        let (device, description) = match self.open_heir(name, kind, &options)? {
            Some(heir) => heir,
            None => {
                let (driver, description) = drivers::open(kind, &options).map_err(|why| why.to_string())?;
                let device = Device::open_seen(name, driver, self.shared.host.now_ns()).map_err(|why| why.message)?;
                (self.trade.device)(&device, true);
                (device, description.to_string())
            }
        };
        device.obey(self.stop.clone());
        let channels = device.channels().to_vec();
        locked(&self.shared.devices).insert(name.to_owned(), device);
        self.opened.insert(name.to_owned(), Opening { kind: kind.to_owned(), options, description: description.clone() });
        Ok(Answer::Opened { channels, description })
    }

    /// Whether a device of that name is still with what ran here before.
    fn is_before(&self, name: &str) -> bool {
        self.before.as_ref().is_some_and(|before| before.opened.contains_key(name))
    }

    /// The heir of the device of that name that runs here already. Errors: it is another one, in words.
    fn open_heir(&self, name: &str, kind: &str, options: &serde_json::Value) -> Result<Option<(Arc<Device>, String)>, String> {
        let Some(before) = &self.before else { return Ok(None) };
        let device = locked(&before.shared.devices).get(name).cloned();
        let (Some(device), Some(opening)) = (device, before.opened.get(name)) else { return Ok(None) };
        if opening.kind != kind || opening.options != *options {
            return Err(format!(
                "device '{name}' runs there with driver '{}' and {}, and is to be taken over with driver '{kind}' and {options}; open it as it was",
                opening.kind, opening.options
            ));
        }
        let heir = Device::heir(&device).map_err(|why| why.message)?;
        Ok(Some((heir, opening.description.clone())))
    }
}

fn greet(link: &Arc<dyn Link>) -> Result<(i64, String), String> {
    const GREETING: Duration = Duration::from_secs(30);
    let greeting = link.receive(GREETING).map_err(|why| why.to_string())?.ok_or("nobody has greeted this processor for 30 s")?;
    let Order::Greet { version, abi, processor, epoch_ns, .. } = opened(&greeting)? else { return Err("the first frame is no greeting".to_owned()) };
    let refused = match (version == VERSION, abi == ABI_VERSION) {
        (true, true) => None,
        (false, _) => Some(format!("it speaks version {VERSION} of the protocol, the system version {version}: install the same release on both sides")),
        (_, false) => {
            Some(format!("its blocks are of ABI version {ABI_VERSION}, those of the system of version {abi}: install the same release on both sides"))
        }
    };
    let target = format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS);
    let welcome = News::Welcome { version: VERSION, abi: ABI_VERSION, target, pid: std::process::id(), refused: refused.clone() };
    link.send(&frame(&welcome)).map_err(|why| why.to_string())?;
    refused.map_or(Ok((epoch_ns, processor)), Err)
}
