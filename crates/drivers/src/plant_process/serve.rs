// SPDX-License-Identifier: Apache-2.0
//! Plant process: one thread that runs steps at its own pace and serves its clients between steps.
use super::plant_link::{ANSWER, LINK, SERVICES, place};
use super::plant_messages::{Answer, Ask, ChannelText, PlantDescription, PlantOrigin, PlantState, age_of};
use super::region::{Region, Shape, SharedTripleBuffer};
use device::{Driver, Slot};
use interconnect::{LinkClosed, TripleReader, TripleWriter};
use process_kit::{Listener, UnixLink, inherited, now_ns};
use scheduling::Children;
use serde_json::Value;
use std::os::fd::{AsFd, BorrowedFd};
use std::sync::atomic::Ordering;
use std::time::Duration;

const STEP_NS: i64 = 1_000_000;
/// Maximum time between two checks for client messages, however long the plant's steps are.
const HEAR_NS: i64 = 20_000_000;
/// Number of steps above which a late plant drops the missed time and continues from the current time.
const LATE_STEPS_MAX: i64 = 10;
/// Priority below the guard and above every kernel, because a machine does not wait for software.
const PRIORITY: u8 = 97;

/// Runs the plant process. Returns when it has been closed, or when no client has been connected for its linger time.
///
/// # Errors
/// Fails with a human-readable message if the process was not started by a driver.
pub fn run() -> Result<(), String> {
    forks::claim_process();
    let descriptor = inherited(LINK).map_err(|error| error.to_string())?;
    let link = UnixLink::from_descriptor(descriptor).map_err(|error| format!("the link of the plant cannot be used: {error}"))?;
    let Ok(Some((frame, _))) = link.receive_with(ANSWER) else { return Err("no request specifies which plant to create".to_owned()) };
    let Ok(Ask::Make(made)) = serde_json::from_slice(&frame) else { return Err("the first request does not specify which plant to create".to_owned()) };
    match Plant::make(made) {
        Ok(mut plant) => {
            if plant.described.made.rest_ns.is_none() {
                // Without the priority the plant is only less punctual.
                let _granted = scheduling::prioritise(PRIORITY, Children::Ordinary);
            }
            answer(&link, &Answer::Described(Box::new(plant.described.clone())), &[]);
            plant.links.push((0, link));
            if let Some(services) = inherited(SERVICES).ok().and_then(|of| UnixLink::from_descriptor(of).ok()) {
                plant.links.push((1, services));
            }
            plant.serve();
            Ok(())
        }
        Err(problem) => {
            // The requesting side reports the problem.
            answer(&link, &Answer::Refused(problem), &[]);
            Ok(())
        }
    }
}

struct Plant {
    driver: Box<dyn Driver>,
    described: PlantDescription,
    shape: Shape,
    safe_group: Vec<u8>,
    /// Slot of the age of the readings.
    age: Option<Slot>,
    taken: TakenTime,
    listener: Option<Listener>,
    /// Links to the plant's clients, each with a number.
    links: Vec<(u64, UnixLink)>,
    next_link: u64,
    session: Option<Session>,
    /// Current commands, with their claims.
    group: Vec<u8>,
    engaged: Vec<bool>,
    readings: Vec<u8>,
    /// Time of the plant itself: the sum of its steps so far.
    time_ns: i64,
    steps: u64,
    failed: Option<String>,
    /// Time at which the plant first obeyed the safe commands of this session.
    obeyed_ns: i64,
    /// Time of the last commands that claim a channel; `None` if the plant was brought to its safe state, or has received no such
    /// commands in this session.
    commanded_ns: Option<i64>,
    /// Time at which a client was last connected.
    seen_ns: i64,
    is_put_away: bool,
}

/// Time at which the machine took the newest readings.
struct TakenTime {
    /// Time reported by the driver, on the clock of its steps.
    told_ns: Option<i64>,
    /// Time on the monotonic clock of this host.
    at_ns: i64,
}

impl TakenTime {
    /// Records the time reported by the driver after the step at `time_ns`, which began at `begun_ns`. If the driver reports the same
    /// time again, the host time of the first report is kept: `time_ns` lags behind the wall clock when steps are late, so the age could
    /// not be computed from it.
    fn look(&mut self, told_ns: Option<i64>, time_ns: i64, begun_ns: i64) {
        if told_ns.is_none() || told_ns != self.told_ns {
            let old_ns = told_ns.map_or(0, |told_ns| time_ns.saturating_sub(told_ns).max(0));
            *self = TakenTime { told_ns, at_ns: begun_ns.saturating_sub(old_ns) };
        }
    }
}

/// State shared with the driver that has opened the plant.
struct Session {
    region: Region,
    commands: TripleReader<SharedTripleBuffer>,
    readings: TripleWriter<SharedTripleBuffer>,
    holder: u64,
    /// Number of safe-state requests by its driver at the last step.
    rests: u64,
}

impl Plant {
    fn make(made: PlantOrigin) -> Result<Plant, String> {
        let (mut driver, about) = device::open(&made.kind, &made.options).map_err(|error| error.to_string())?;
        driver.open(0).map_err(|error| error.message)?;
        let path = made.name.as_deref().map(place).transpose().map_err(|error| error.to_string())?;
        let listener = path.map(|path| Listener::listen(&path)).transpose().map_err(|error| format!("a plant of that name cannot be created: {error}"))?;
        let own_ns = about["timestep"].as_f64().map(|s| (s * 1e9).round() as i64);
        let step_ns = made.step_ns.or(own_ns).unwrap_or(STEP_NS);
        let counted = driver.counters().filter(|_| made.rest_ns.is_some()).map_or(0, |counters| counters.words().len());
        let shape = Shape::of(driver.channels(), counted);
        let safe_group = shape.safe_group(driver.channels());
        let channels = driver.channels().iter().map(ChannelText::from).collect();
        let age = age_of(driver.channels(), &about);
        Ok(Plant {
            age,
            taken: TakenTime { told_ns: None, at_ns: now_ns() },
            described: PlantDescription { made, channels, about, step_ns },
            group: safe_group.clone(),
            engaged: vec![false; shape.writes],
            readings: vec![0; shape.readings],
            driver,
            shape,
            safe_group,
            listener,
            links: Vec::new(),
            next_link: 2,
            session: None,
            time_ns: 0,
            steps: 0,
            failed: None,
            obeyed_ns: 0,
            commanded_ns: None,
            seen_ns: 0,
            is_put_away: false,
        })
    }

    fn serve(&mut self) {
        let step_ns = self.described.step_ns;
        let mut next_ns = now_ns();
        self.seen_ns = next_ns;
        self.step();
        while self.keep_alive() {
            next_ns = next_ns.saturating_add(step_ns);
            if now_ns() - next_ns > LATE_STEPS_MAX.saturating_mul(step_ns) {
                next_ns = now_ns();
            }
            while next_ns - now_ns() > HEAR_NS && self.keep_alive() {
                sleep_until(now_ns() + HEAR_NS);
                self.hear();
            }
            if self.keep_alive() {
                sleep_until(next_ns);
                self.step();
                self.hear();
            }
        }
        self.driver.safe_state();
        self.driver.close();
    }

    /// Returns true if the plant must keep running: a client is connected, or was connected recently.
    fn keep_alive(&mut self) -> bool {
        if !self.links.is_empty() {
            self.seen_ns = now_ns();
        }
        !self.is_put_away && (!self.links.is_empty() || now_ns() - self.seen_ns < self.described.made.linger_ns)
    }

    fn step(&mut self) {
        // A driver may fork processes of its own; a child that returns here is not a plant.
        forks::end_if_child();
        self.take_commands();
        if self.failed.is_none() {
            self.time_ns = self.time_ns.saturating_add(self.described.step_ns);
            let begun_ns = now_ns();
            let written = self.driver.write(self.time_ns, &self.group[..self.shape.commands], &self.engaged);
            if let Err(error) = written.and_then(|()| self.driver.read(self.time_ns, &mut self.readings)) {
                self.driver.safe_state();
                self.failed = Some(error.message);
            }
            if let Some(age) = self.age {
                self.taken.look(self.driver.taken_ns(), self.time_ns, begun_ns);
                age.of_mut(&mut self.readings).copy_from_slice(&self.taken.at_ns.to_ne_bytes());
            }
        }
        self.steps += 1;
        self.tell();
    }

    fn take_commands(&mut self) {
        let Some(session) = &mut self.session else { return };
        // Read before the commands, which are then those at the time of that request or newer ones.
        let rests = session.region.rests().load(Ordering::Acquire);
        let is_new = session.commands.latch();
        if is_new {
            let is_claimed = session.commands.front()[self.shape.commands..].iter().any(|byte| *byte != 0);
            self.commanded_ns = is_claimed.then(now_ns);
        }
        let timeout_ns = self.described.made.timeout_ns;
        if let (Some(timeout_ns), Some(commanded_ns)) = (timeout_ns, self.commanded_ns)
            && now_ns() - commanded_ns > timeout_ns
        {
            session.region.timed_out().store(1, Ordering::Release);
        }
        if session.region.is_safe() || session.region.timed_out().load(Ordering::Relaxed) != 0 {
            session.region.load_safe_group(&mut self.group);
            if self.obeyed_ns == 0 {
                self.obeyed_ns = now_ns();
                if self.described.made.rest_ns.is_some() {
                    self.driver.safe_state();
                }
            }
        } else if is_new {
            self.group.copy_from_slice(session.commands.front());
        }
        if std::mem::replace(&mut session.rests, rests) != rests && self.failed.is_none() {
            self.driver.safe_state();
        }
        if let (Some(rest_ns), Some(commanded_ns)) = (self.described.made.rest_ns, self.commanded_ns)
            && now_ns() - commanded_ns > rest_ns
        {
            self.commanded_ns = None;
            self.group.copy_from_slice(&self.safe_group);
            self.driver.safe_state();
        }
        self.engaged.iter_mut().zip(&self.group[self.shape.commands..]).for_each(|(engaged, byte)| *engaged = *byte != 0);
    }

    fn tell(&mut self) {
        let Some(session) = &mut self.session else { return };
        let (readings, counted) = session.readings.back().split_at_mut(self.shape.readings);
        readings.copy_from_slice(&self.readings);
        if let Some(counters) = self.driver.counters().filter(|_| !counted.is_empty()) {
            let values = counters.all().map(|(_, value)| value.to_ne_bytes());
            counted.chunks_exact_mut(8).zip(values).for_each(|(to, value)| to.copy_from_slice(&value));
        }
        session.readings.publish();
        session.region.steps().store(self.steps, Ordering::Release);
        if let Some(why) = &self.failed {
            session.region.fail(why);
        }
    }

    fn hear(&mut self) {
        // A link that cannot be accepted now will still be pending after the next step.
        if let Some(Ok(Some(link))) = self.listener.as_ref().map(Listener::accept) {
            self.links.push((self.next_link, link));
            self.next_link += 1;
        }
        let mut links = std::mem::take(&mut self.links);
        links.retain(|(number, link)| match link.receive_with(Duration::ZERO) {
            Ok(Some((frame, _))) => self.act(&frame, *number, link),
            Ok(None) => true,
            Err(LinkClosed) => false,
        });
        self.links = links;
    }

    /// Handles a message; returns false if the link is lost or the message is invalid.
    fn act(&mut self, frame: &[u8], number: u64, link: &UnixLink) -> bool {
        let Ok(ask) = serde_json::from_slice(frame) else { return false };
        let told = match ask {
            Ask::Make(_) => Answer::Refused("a plant is created only once".to_owned()),
            Ask::Describe => Answer::Described(Box::new(self.described.clone())),
            Ask::State => Answer::State(self.state()),
            Ask::Serve(service, arguments) => self.carry_out(&service, &arguments),
            // The safe state was requested after this request was admitted: no motion is started.
            Ask::Move(service, _, rests) if self.rests() != Some(rests) => {
                Answer::Refused(format!("service '{service}' moves the machine, but its device was brought to its safe state in the meantime"))
            }
            Ask::Move(service, arguments, _) => self.carry_out(&service, &arguments),
            Ask::Close => match &self.session {
                Some(session) if session.holder != number => Answer::Refused("another driver has opened it".to_owned()),
                _ => {
                    self.is_put_away = true;
                    Answer::Closed
                }
            },
            Ask::Open => match self.open(number) {
                Ok(()) => {
                    let memory = self.session.as_ref().map(|session| session.region.memory().as_fd());
                    return answer(link, &Answer::Opened, memory.as_slice());
                }
                Err(problem) => Answer::Refused(problem),
            },
        };
        answer(link, &told, &[])
    }

    /// Returns the number of safe-state requests by the driver that has opened the plant.
    fn rests(&self) -> Option<u64> {
        self.session.as_ref().map(|session| session.region.rests().load(Ordering::Acquire))
    }

    fn carry_out(&self, service: &str, arguments: &Value) -> Answer {
        match self.driver.services().map(|services| services.call(service, arguments)) {
            Some(Ok(value)) => Answer::Served(value),
            Some(Err(why)) => Answer::Refused(why.message),
            None => Answer::Refused("it has no services".to_owned()),
        }
    }

    /// Opens a new session, which is safe until commands arrive; the holder of the previous session can no longer send commands.
    fn open(&mut self, holder: u64) -> Result<(), String> {
        if let Some(why) = &self.failed {
            return Err(why.clone());
        }
        let region = Region::new(self.shape, &self.safe_group).map_err(|error| format!("cannot share memory: {error}"))?;
        let (commands, readings) = region.plant_ends();
        self.session = Some(Session { region, commands, readings, holder, rests: 0 });
        self.group.copy_from_slice(&self.safe_group);
        (self.obeyed_ns, self.commanded_ns) = (0, None);
        self.tell();
        Ok(())
    }

    fn state(&self) -> PlantState {
        PlantState {
            is_safe: self.obeyed_ns != 0,
            obeyed_ns: self.obeyed_ns,
            steps: self.steps,
            failed: self.failed.clone(),
            readings: self.readings.clone(),
            pid: std::process::id(),
        }
    }
}

/// Sends an answer; returns false if the link is lost.
fn answer(link: &UnixLink, answer: &Answer, descriptors: &[BorrowedFd<'_>]) -> bool {
    let frame = serde_json::to_vec(answer).expect("an answer has no map whose keys are not texts");
    link.send_with(&frame, descriptors, Some(Duration::from_secs(1))).is_ok()
}

fn sleep_until(time_ns: i64) {
    let until = libc::timespec { tv_sec: time_ns / 1_000_000_000, tv_nsec: time_ns % 1_000_000_000 };
    // SAFETY: the time is a local variable. A signal ends the sleep early, which makes one step early.
    unsafe { libc::clock_nanosleep(libc::CLOCK_MONOTONIC, libc::TIMER_ABSTIME, &until, std::ptr::null_mut()) };
}
