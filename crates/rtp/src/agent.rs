// SPDX-License-Identifier: Apache-2.0
//! Processor side: carries out orders from the commander.
use crate::heart;
use crate::protocol::{Answer, News, Order, VERSION, frame, opened};
use crate::script_context::Grounds;
use crate::service::{AdmittedSupervisor, BlackBox, Caller, Door, Terms};
use crate::shared::{LOOK, ProcessorState, locked};
use crate::tells;
use device::{Beside, ServiceError};
use interconnect::{Link, Memory};
use kernel::{Device, DeviceCall, FORCED_LEN_MAX, SourceId};
use opengpac::abi::ABI as ABI_VERSION;
use process_kit::Silence;
use runtime::encoding::Parcel;
use runtime::{ClockKind, Holding, Host};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

/// Agent that serves one commander.
pub(crate) struct Agent {
    pub shared: Arc<ProcessorState>,
    /// Threads that send events and the heartbeat.
    pub threads: Vec<JoinHandle<()>>,
    pub ground: Grounds,
    /// While set, every write of a device outputs the safe values.
    pub stop: Arc<AtomicBool>,
    pub farewells: HashMap<(u64, SourceId), Option<Parcel>>,
    /// True if a process continues to run without a commander.
    pub goes_on: bool,
    pub patience: Duration,
    /// Number of sources added to the system so far, local and remote.
    count: u32,
    /// Remote sources raised by local channels.
    passed: HashSet<SourceId>,
    /// Options with which each device was opened, and its driver's description of itself.
    opened: HashMap<String, Opening>,
    /// Table of each source that is in force, or about to be.
    pub held: BTreeMap<SourceId, Holding>,
    pub terms: Arc<Terms>,
    /// Agent of processes that already run here and that this commander will take over.
    pub before: Option<Box<Agent>>,
    /// Supervisor that connected when the link was about to break.
    pub caller: Option<Box<dyn Caller>>,
}

struct Opening {
    kind: String,
    options: serde_json::Value,
    description: String,
}

/// Reason why the service of a commander ended.
pub(crate) enum ServiceEnd {
    /// The commander closed the service.
    Closed,
    /// The commander disconnected without notice.
    Gone,
    /// The commander sent an order that cannot be carried out.
    Broken(String),
}

impl Agent {
    /// Creates the agent of a commander that connects over `link`. `before`: the agent of processes already running here.
    pub fn hired(admitted: AdmittedSupervisor, terms: &Arc<Terms>, before: Option<Box<Agent>>) -> Result<Agent, (String, Option<Box<Agent>>)> {
        let AdmittedSupervisor { link, reaches, black_box, is_unguarded } = admitted;
        if let (true, Some(before)) = (is_unguarded, &before) {
            locked(&before.shared.devices).values().for_each(|device| (terms.device)(device, true));
        }
        let (epoch_ns, name) = match greet(&link) {
            Ok(greeting) => greeting,
            Err(why) => return Err((why, before)),
        };
        let host = Arc::new(Host::since(ClockKind::Monotonic, Box::new(Memory), (terms.epoch)(epoch_ns)));
        if let Some(BlackBox { memory, len }) = black_box {
            // SAFETY: what `BlackBox` says of it.
            unsafe { host.set_black_box(memory, len) };
        }
        let stop = Arc::<AtomicBool>::default();
        let shared = Arc::new(ProcessorState {
            host: host.clone(),
            link,
            reader: Mutex::default(),
            devices: Arc::default(),
            besides: Mutex::default(),
            sources: Mutex::default(),
            leads: AtomicBool::new(before.is_none()),
            ends: AtomicBool::new(false),
            stop: stop.clone(),
            silence_ms: AtomicU64::new(0),
        });
        let (told, beating, its) = (shared.clone(), shared.clone(), terms.clone());
        let spawn = |name: &str, body: Box<dyn FnOnce() + Send>| std::thread::Builder::new().name(name.into()).spawn(body);
        let teller = spawn("tells", Box::new(move || tells::run(&told)));
        let threads = match teller.and_then(|teller| Ok(vec![teller, spawn("heart", Box::new(move || heart::run(&beating, &its)))?])) {
            Ok(threads) => threads,
            Err(why) => {
                shared.ends.store(true, Ordering::Release);
                return Err((format!("processor '{name}' cannot start a thread: {why}"), before));
            }
        };
        Ok(Agent {
            ground: Grounds::new(host, shared.devices.clone(), reaches, terms.probe.clone()),
            shared,
            threads,
            stop,
            farewells: HashMap::new(),
            goes_on: false,
            patience: Duration::ZERO,
            count: 0,
            passed: HashSet::new(),
            opened: HashMap::new(),
            held: BTreeMap::new(),
            terms: terms.clone(),
            before,
            caller: None,
        })
    }

    /// Serves until the other side closes the link, disconnects or is silent for too long; rejects new connections in the meantime.
    pub fn run(&mut self, door: &mut Option<Box<dyn Door>>) -> ServiceEnd {
        let mut silence = Silence::begins();
        loop {
            // A supervisor that connects just as the link breaks is not rejected.
            let limit = if self.caller.is_some() { Duration::ZERO } else { LOOK };
            let received = self.shared.link.receive(limit);
            silence.looked(matches!(received, Ok(Some(_))));
            self.ground.tell_lost();
            match received {
                Ok(None) if self.shared.is_over(silence.lasted()) => return ServiceEnd::Gone,
                Ok(None) => match self.caller.take() {
                    Some(caller) => caller.refuse(self.turning_away()),
                    None => self.caller = door.as_mut().and_then(|door| door.wait(Duration::ZERO)),
                },
                Ok(Some(bytes)) => match opened::<Order>(&bytes).and_then(|order| self.obey(order)) {
                    Ok(true) => return ServiceEnd::Closed,
                    Ok(false) => {}
                    Err(message) => {
                        self.say(&News::Broken { message: message.clone() });
                        return ServiceEnd::Broken(message);
                    }
                },
                Err(_) => return ServiceEnd::Gone,
            }
        }
    }

    fn turning_away(&self) -> &'static str {
        match self.before {
            Some(_) => "another system is already taking it over",
            None => "its system is still there and commands it; only a processor that has lost its system is taken over",
        }
    }

    fn say(&self, news: &News) {
        // If the link is broken, the next `receive` reports it.
        let _heard = self.shared.link.send(&frame(news));
    }

    fn answer(&self, ticket: u64, answer: Answer) {
        self.say(&News::Answer { ticket, answer });
    }

    /// Carries out an order; returns true if the order ends the service.
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
            Order::Service { ticket, device, service, arguments } => self.serve(ticket, &device, service, arguments),
            Order::Shut { device } => {
                self.opened.remove(&device);
                locked(&self.shared.besides).remove(&device);
                let shut = locked(&self.shared.devices).remove(&device);
                // A device not taken over yet stays where it runs.
                if let Some(device) = shut.filter(|device| !self.is_before(device.name())) {
                    (self.terms.device)(&device, false);
                }
            }
            Order::Device { device, call } => {
                if let Some(device) = locked(&self.shared.devices).get(&device) {
                    match call {
                        DeviceCall::Ask { channel, what, at_zero } if (channel as usize) < device.channels().len() => {
                            device.ask(channel as usize, what, at_zero)
                        }
                        DeviceCall::Force { channel, value }
                            if device.channels().get(channel as usize).is_some_and(|channel| channel.len <= FORCED_LEN_MAX) =>
                        {
                            device.force(channel as usize, value)
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
            Order::Patience { ms, silence_ms, standstill_ms } => {
                standstill_ms.into_iter().for_each(|ms| self.shared.host.allow_standstill(Duration::from_millis(ms)));
                self.patience = Duration::from_millis(ms);
                self.shared.silence_ms.store(silence_ms, Ordering::Release);
            }
            Order::TakeOver { ticket } => {
                let answer = self.take_over().map_or_else(Answer::Refused, Answer::TakenOver);
                self.answer(ticket, answer);
            }
            Order::Close => return Ok(true),
        }
        Ok(false)
    }

    /// Returns the number of a source if it runs here; fails otherwise.
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
            self.held.insert(source, Holding::of(table, source));
        }
        self.pass_on()?;
        self.shared.host.submit(source, script);
        Ok(())
    }

    /// Reports to the commander which remote sources are raised by local channels.
    fn pass_on(&mut self) -> Result<(), String> {
        let raised: Vec<SourceId> =
            locked(&self.shared.reader).raised().filter(|source| !self.passed.contains(source) && self.mine(*source).is_err()).collect();
        for source in raised.into_iter().filter(|source| source.0 < self.count) {
            let link = self.shared.link.clone();
            let request = move || {
                // If the link is broken, the next `receive` reports it.
                let _heard = link.send(&frame(&News::Raised { source }));
            };
            self.shared.host.pass_on(source, Box::new(request)).map_err(|why| format!("a thread cannot be started: {why}"))?;
            self.passed.insert(source);
        }
        Ok(())
    }

    fn open(&mut self, name: &str, kind: &str, options: &str) -> Result<Answer, String> {
        let options: serde_json::Value = serde_json::from_str(options).map_err(|why| format!("the options of device '{name}' are not JSON: {why}"))?;
        let known = locked(&self.shared.devices).get(name).filter(|device| device.is_lost()).cloned();
        if let Some(lost) = known {
            return self.reopen(&lost, kind, &options);
        }
        let (device, description, beside) = match self.open_heir(name, kind, &options)? {
            Some(heir) => heir,
            None => {
                let (driver, description) = drivers::open(kind, &options).map_err(|why| why.to_string())?;
                let beside = Beside::of(kind, &*driver);
                let device = runtime::open_seen(name, driver, self.shared.host.now_ns()).map_err(|why| why.message)?;
                (self.terms.device)(&device, true);
                (device, description.to_string(), beside)
            }
        };
        device.obey(self.stop.clone());
        let channels = device.channels().to_vec();
        locked(&self.shared.devices).insert(name.to_owned(), device);
        locked(&self.shared.besides).insert(name.to_owned(), beside);
        self.opened.insert(name.to_owned(), Opening { kind: kind.to_owned(), options, description: description.clone() });
        Ok(Answer::Opened { channels, description })
    }

    /// Carries out a service of a driver on a separate thread, because it may take a long time; orders are processed in the meantime.
    fn serve(&self, ticket: u64, device: &str, service: String, arguments: String) {
        let Some(beside) = locked(&self.shared.besides).get(device).cloned() else {
            return self.answer(ticket, Answer::Refused(format!("device '{device}' is not open there")));
        };
        let (link, stop) = (self.shared.link.clone(), self.stop.clone());
        let carry_out = move || {
            let served = serde_json::from_str(&arguments)
                .map_err(|why| ServiceError::Arguments(format!("the arguments of service '{service}' are not JSON: {why}")))
                .and_then(|arguments| beside.serve(&service, &arguments, &|| stop.load(Ordering::Acquire)));
            let answer = Answer::Served(served.map(|answer| answer.to_string()));
            // If the link is broken, the next `receive` reports it.
            let _heard = link.send(&frame(&News::Answer { ticket, answer }));
        };
        if let Err(why) = std::thread::Builder::new().name("service".into()).spawn(carry_out) {
            self.answer(ticket, Answer::Refused(format!("cannot start a thread for the service: {why}")));
        }
    }

    /// Returns true if a device of that name still belongs to processes of the earlier commander.
    fn is_before(&self, name: &str) -> bool {
        self.before.as_ref().is_some_and(|before| before.opened.contains_key(name))
    }

    /// Opens the heir of the device with this name that already runs here. Fails with a message if it is a different device.
    fn open_heir(&self, name: &str, kind: &str, options: &serde_json::Value) -> Result<Option<(Arc<Device>, String, Beside)>, String> {
        let Some(before) = &self.before else { return Ok(None) };
        let device = locked(&before.shared.devices).get(name).cloned();
        let (Some(device), Some(opening)) = (device, before.opened.get(name)) else { return Ok(None) };
        if opening.kind != kind || opening.options != *options {
            return Err(format!(
                "device '{name}' runs there with driver '{}' and {}, but is to be taken over with driver '{kind}' and {options}; open it as before",
                opening.kind, opening.options
            ));
        }
        let heir = runtime::heir(&device).map_err(|why| why.message)?;
        let beside = locked(&before.shared.besides).get(name).cloned().unwrap_or_default();
        Ok(Some((heir, opening.description.clone(), beside)))
    }
}

fn greet(link: &Arc<dyn Link>) -> Result<(i64, String), String> {
    const GREETING: Duration = Duration::from_secs(30);
    let greeting = link.receive(GREETING).map_err(|why| why.to_string())?.ok_or("no supervisor has greeted this processor for 30 s")?;
    let Order::Greet { version, abi, processor, epoch_ns, .. } = opened(&greeting)? else { return Err("the first frame is not a greeting".to_owned()) };
    let refused = match (version == VERSION, abi == ABI_VERSION) {
        (true, true) => None,
        (false, _) => {
            Some(format!("it speaks version {VERSION} of the protocol, but the system speaks version {version}: install the same release on both sides"))
        }
        (_, false) => {
            Some(format!("its blocks have ABI version {ABI_VERSION}, but those of the system have version {abi}: install the same release on both sides"))
        }
    };
    let target = format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS);
    let welcome = News::Welcome { version: VERSION, abi: ABI_VERSION, target, pid: std::process::id(), refused: refused.clone() };
    link.send(&frame(&welcome)).map_err(|why| why.to_string())?;
    refused.map_or(Ok((epoch_ns, processor)), Err)
}
