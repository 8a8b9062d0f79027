// SPDX-License-Identifier: Apache-2.0
//! The processor's own side: it does what it is told.
use crate::ground::Grounds;
use crate::protocol::{Answer, News, Order, VERSION, frame, opened};
use crate::tells;
use interconnect::{Ends, Link, Memory};
use kernel::wire::{Parcel, Reader};
use kernel::{ClockKind, Device, DeviceCall, Host, SourceId};
use modules::Probe;
use opengpac::abi::ABI as ABI_VERSION;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

/// What carries connections out of the process.
#[derive(Default)]
pub struct Reaches {
    /// To other processes of this host.
    pub host: Option<Box<dyn Ends>>,
    /// To other hosts.
    pub network: Option<Box<dyn Ends>>,
}

/// Told of a device that was opened (`true`) or is closed.
pub type OnDevice = Box<dyn Fn(&Device, bool) + Send>;

/// What a processor stands on: what its process gives it.
pub struct Service {
    /// What carries connections out of the process.
    pub reaches: Reaches,
    /// Tries code modules in a process of their own.
    pub probe: Probe,
    /// The epoch of the system on this host's CLOCK_MONOTONIC, of that on the commanding host's.
    pub epoch: Box<dyn Fn(i64) -> i64 + Send>,
    /// Told of each device that is opened (`true`) or closed.
    pub device: OnDevice,
    /// Called as long as the kernels here serve, every 20 ms.
    pub beat: Box<dyn Fn() + Send>,
    /// Where whoever commands is gone without a word, the process ends here with its outputs safe and its devices open: what outlives it is
    /// found as it was by whoever comes back. For a process that has nothing else to do.
    pub leaves: bool,
    /// Where sources say which block runs, and how many bytes there are: zero, on a cache line, for as long as the process lives.
    pub black_box: Option<(*mut u8, usize)>,
}

// SAFETY: the black box is an address that the one who serves hands to its host.
unsafe impl Send for Service {}

impl Service {
    /// One that stands alone: no connections, no guard.
    pub fn new(probe: Probe) -> Service {
        let (epoch, device, beat) = (Box::new(|epoch_ns| epoch_ns), Box::new(|_: &Device, _| {}), Box::new(|| {}));
        Service { reaches: Reaches::default(), probe, epoch, device, beat, leaves: false, black_box: None }
    }
}

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
    pub ends: AtomicBool,
}

pub(crate) fn locked<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().expect("nobody panics with the lock held")
}

/// Status of a process that nobody commanded any more.
const LEFT: i32 = 3;

/// How long it waits for a frame before it looks around.
const LOOK: Duration = Duration::from_millis(100);

/// Serves until the other side closes it, or is gone and what runs here has had its farewell: then devices are safe and everything is
/// closed.
///
/// # Errors
/// In words: no greeting, another version, orders that cannot be understood.
pub fn serve(link: &Arc<dyn Link>, service: Service) -> Result<(), String> {
    let (epoch_ns, name) = greet(link)?;
    let Service { reaches, probe, epoch, device, beat, leaves, black_box } = service;
    let host = Arc::new(Host::since(ClockKind::Monotonic, Box::new(Memory), epoch(epoch_ns)));
    if let Some((memory, len)) = black_box {
        // SAFETY: what `Service` says of it.
        unsafe { host.set_black_box(memory, len) };
    }
    let shared = Arc::new(Shared {
        host: host.clone(),
        link: link.clone(),
        reader: Mutex::default(),
        devices: Arc::default(),
        sources: Mutex::default(),
        ends: AtomicBool::new(false),
    });
    let teller = {
        let shared = shared.clone();
        std::thread::Builder::new()
            .name("tells".into())
            .spawn(move || tells::run(&shared, &*beat))
            .map_err(|why| format!("processor '{name}' cannot start a thread: {why}"))?
    };
    let mut agent = Agent {
        ground: Grounds::new(host.clone(), shared.devices.clone(), reaches, probe),
        shared,
        stop: Arc::default(),
        farewells: HashMap::new(),
        patience: Duration::ZERO,
        count: 0,
        passed: HashSet::new(),
        device,
        leaves,
    };
    let served = agent.run();
    agent.shared.ends.store(true, Ordering::Release);
    host.unpark();
    let _joined = teller.join();
    host.close();
    link.close();
    served
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

struct Agent {
    shared: Arc<Shared>,
    ground: Grounds,
    /// While it is set, every write of a device is the safe one.
    stop: Arc<AtomicBool>,
    farewells: HashMap<(u64, SourceId), Option<Parcel>>,
    patience: Duration,
    /// Sources of the system so far, here or not.
    count: u32,
    /// Sources elsewhere that channels here raise.
    passed: HashSet<SourceId>,
    device: OnDevice,
    leaves: bool,
}

impl Agent {
    fn run(&mut self) -> Result<(), String> {
        loop {
            match self.shared.link.receive(LOOK) {
                Ok(None) => {}
                Ok(Some(bytes)) => {
                    let order = opened::<Order>(&bytes).and_then(|order| self.obey(order));
                    match order {
                        Ok(true) => return Ok(()),
                        Ok(false) => {}
                        Err(message) => {
                            self.say(&News::Broken { message: message.clone() });
                            self.part();
                            return Err(message);
                        }
                    }
                }
                Err(_) => {
                    self.part();
                    if self.leaves {
                        // Every output is safe before it goes.
                        self.stop.store(true, Ordering::Release);
                        std::thread::sleep(LOOK);
                        std::process::exit(LEFT);
                    }
                    return Ok(());
                }
            }
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
                if let Some(device) = locked(&self.shared.devices).remove(&device) {
                    (self.device)(&device, false);
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
            Order::Patience { ms } => self.patience = Duration::from_millis(ms),
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
        let options = serde_json::from_str(options).map_err(|why| format!("the options of device '{name}' are no JSON: {why}"))?;
        let (driver, description) = drivers::open(kind, &options).map_err(|why| why.to_string())?;
        let device = Device::open(name, driver, self.shared.host.now_ns()).map_err(|why| why.message)?;
        device.obey(self.stop.clone());
        (self.device)(&device, true);
        let channels = device.channels().to_vec();
        locked(&self.shared.devices).insert(name.to_owned(), device);
        Ok(Answer::Opened { channels, description: description.to_string() })
    }

    /// Whoever commanded is gone: each process gets its farewell; what has none goes on as long as the patience lasts.
    fn part(&mut self) {
        let mut goes_on = false;
        for ((process, source), parcel) in std::mem::take(&mut self.farewells) {
            let Some(parcel) = parcel else {
                goes_on = true;
                continue;
            };
            let mut reader = locked(&self.shared.reader);
            // What cannot be understood was so when it came: then everything is made safe below.
            let Ok(script) = reader.open(0, parcel, &mut self.ground) else { continue };
            if let Some(process) = reader.process_of(process) {
                process.take(process.now().0, true);
                self.shared.host.submit(source, script);
            }
        }
        let until = Instant::now() + self.patience;
        while goes_on && Instant::now() < until {
            std::thread::sleep(LOOK.min(until.saturating_duration_since(Instant::now())));
        }
    }
}
