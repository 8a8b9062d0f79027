// SPDX-License-Identifier: Apache-2.0
//! Start-up of an arm that is to follow: connection, recipes, power, remote control, program. It runs off the cycle, so it may block.
use super::dashboard::Dashboard;
use super::link::{Link, LinkError};
use super::options::Options;
use super::rtde::{self, Message, kind, request};
use super::sample::{INPUTS, JOINTS, OUTPUTS, Sample, ScriptInputs, recipe};
use super::script::{CYCLE_NS, Program};
use super::states::{hindrance, interruption, is_off};
use device::DeviceError;
use forks::Device;
use std::io::Write;
use std::net::{IpAddr, SocketAddr, TcpStream};
use std::time::{Duration, Instant, SystemTime};

/// Time limit for an answer of a connected controller.
const ANSWER: Duration = Duration::from_secs(10);
/// Time limit for an answer in lockstep, in which nothing depends on speed; only intended to catch a controller that never answers.
const ANSWER_IN_LOCKSTEP: Duration = Duration::from_secs(120);
/// Minimum time limit for an arm whose controller is present, even if a shorter one is set.
const LEAST: Duration = Duration::from_secs(1);
const RETRY: Duration = Duration::from_millis(50);
/// Packages per second.
const FREQUENCY: f64 = 1e9 / CYCLE_NS as f64;
const FIRST_E_SERIES: u32 = 5;

/// Session of an arm that follows.
pub(super) struct Session {
    link: Link,
    recipes: [u8; 2],
    /// Number by which the program recognises the goals of this session.
    pub number: i32,
    pub sample: Sample,
    pub told: ScriptInputs,
    /// Number of received messages that were not a package of the recipe.
    pub refused: u64,
    /// Time limit for an answer.
    pub answer: Duration,
    /// Time by which the arm must follow.
    deadline: Instant,
}

impl Session {
    /// Makes the arm follow goals. It does not move until it receives any.
    pub fn begin(options: &Options, address: IpAddr) -> Result<Session, DeviceError> {
        let wait = Duration::from_nanos(options.wait_ns().unsigned_abs());
        let deadline = Instant::now() + if options.lockstep { wait.max(ANSWER_IN_LOCKSTEP) } else { wait.max(LEAST) };
        Self::try_to(options, address, deadline).map_err(|why| {
            let is_late = !wait.is_zero() && Instant::now() >= deadline;
            let message = if is_late { format!("{why} (waited for {} s, option wait)", wait.as_secs_f64()) } else { why };
            DeviceError { message }
        })
    }

    fn try_to(options: &Options, address: IpAddr, deadline: Instant) -> Result<Session, String> {
        let mut session = Self::connected(options, SocketAddr::new(address, options.rtde_port), deadline)?;
        session.exchange()?;
        let mut dashboard = None;
        if options.power_on && is_off(&session.sample) {
            let dashboard = Self::dashboard(&mut dashboard, options, address, deadline)?;
            for command in ["power on", "brake release"] {
                dashboard.ask(command).map_err(|why| format!("the dashboard did not answer '{command}': {why}"))?;
            }
            session.until(|sample| !is_off(sample))?.then_some(()).ok_or("the arm was switched on but is not powered yet")?;
        }
        if let Some(why) = hindrance(&session.sample) {
            return Err(why.to_owned());
        }
        let answer = Self::dashboard(&mut dashboard, options, address, deadline)?.ask("is in remote control");
        if answer.as_deref().map(str::to_lowercase).is_ok_and(|answer| answer == "false") {
            return Err("remote control is not enabled: choose it on the pendant, at its upper right corner".to_owned());
        }
        session.start_program(options, SocketAddr::new(address, options.script_port))?;
        Ok(session)
    }

    fn dashboard<'a>(open: &'a mut Option<Dashboard>, options: &Options, address: IpAddr, deadline: Instant) -> Result<&'a mut Dashboard, String> {
        let to = SocketAddr::new(address, options.dashboard_port);
        if open.is_none() {
            *open = Some(
                Dashboard::connect(to, left(deadline)).map_err(|why| format!("no dashboard answers at {to}: {why}; enable it in the controller's services"))?,
            );
        }
        open.as_mut().ok_or_else(String::new)
    }

    /// Returns a connection whose recipes the controller has accepted; until the deadline, retries while the controller is not available.
    fn connected(options: &Options, to: SocketAddr, deadline: Instant) -> Result<Session, String> {
        let tries_until = Instant::now() + Duration::from_nanos(options.wait_ns().unsigned_abs());
        let answer = if options.lockstep { ANSWER_IN_LOCKSTEP } else { ANSWER };
        loop {
            let link = Link::connect(to, LEAST);
            let made = link.map_err(|why| Failure::NotThere(format!("no controller answers at {to}: {why}; check that it is on and that this is its address")));
            match made.and_then(|link| Self::agreed(link, answer, deadline)) {
                Ok(session) => return Ok(session),
                Err(Failure::NotThere(_)) if Instant::now() < tries_until => std::thread::sleep(RETRY),
                Err(Failure::NotThere(why) | Failure::Refused(why)) => return Err(why),
            }
        }
    }

    fn agreed(mut link: Link, answer: Duration, deadline: Instant) -> Result<Session, Failure> {
        let mut ask = |kind: u8, contents: &[u8], pick: &dyn Fn(Message<'_>) -> Option<Answer>| -> Result<Answer, Failure> {
            link.send(&request(kind, contents))?;
            let (mut found, until) = (None, deadline.min(Instant::now() + answer));
            while found.is_none() {
                if !link.wait(until).map_err(LinkError::from)? {
                    return Err(Failure::NotThere(format!("the controller did not answer the RTDE request '{}'", char::from(kind))));
                }
                link.receive(|message| found = found.take().or_else(|| pick(message)))?;
            }
            found.ok_or_else(|| Failure::NotThere(String::new()))
        };
        let agreed = |is: bool| Answer { number: u32::from(is), text: String::new() };
        let version = ask(kind::VERSION, &rtde::PROTOCOL.to_be_bytes(), &|m| if let Message::Version(is) = m { Some(agreed(is)) } else { None })?;
        if version.number == 0 {
            return Err(Failure::Refused("the controller does not speak version 2 of RTDE: its software is too old".to_owned()));
        }
        let major = |m: Message<'_>| if let Message::Controller([major, ..]) = m { Some(Answer { number: major, text: String::new() }) } else { None };
        let controller = ask(kind::CONTROLLER, &[], &major)?;
        if controller.number < FIRST_E_SERIES {
            let problem = format!("its software is version {}, but this driver needs 5 or later: an e-series", controller.number);
            return Err(Failure::Refused(problem));
        }
        let (names, types) = recipe(&OUTPUTS);
        let outputs =
            |m: Message<'_>| if let Message::Outputs { recipe, types } = m { Some(Answer { number: recipe.into(), text: types.to_owned() }) } else { None };
        let outputs = ask(kind::OUTPUTS, &[&FREQUENCY.to_be_bytes()[..], names.as_bytes()].concat(), &outputs)?;
        agree(&OUTPUTS, &types, &outputs.text)?;
        let (names, types) = recipe(&INPUTS);
        let inputs =
            |m: Message<'_>| if let Message::Inputs { recipe, types } = m { Some(Answer { number: recipe.into(), text: types.to_owned() }) } else { None };
        let inputs = ask(kind::INPUTS, names.as_bytes(), &inputs)?;
        agree(&INPUTS, &types, &inputs.text)?;
        let started = ask(kind::START, &[], &|m| if let Message::Started(is) = m { Some(agreed(is)) } else { None })?;
        if started.number == 0 {
            return Err(Failure::Refused("the controller does not start RTDE".to_owned()));
        }
        let recipes = [outputs.number, inputs.number].map(|number| number as u8);
        Ok(Session { link, recipes, number: number(), sample: Sample::default(), told: ScriptInputs::default(), refused: 0, answer, deadline })
    }

    /// Starts the program, at rest, and waits until it reports that it runs.
    fn start_program(&mut self, options: &Options, to: SocketAddr) -> Result<(), String> {
        let program = Program {
            session: self.number,
            patience: options.timeout_ns / CYCLE_NS,
            lookahead_s: options.lookahead,
            gain: options.gain,
            deceleration: options.deceleration,
        };
        let failed = |why: std::io::Error| format!("no program can be sent to {to}: {why}; enable the secondary interface in the controller's services");
        let mut stream = Device::new(TcpStream::connect_timeout(&to, left(self.deadline).min(ANSWER)).map_err(failed)?);
        stream.set_write_timeout(Some(left(self.deadline).min(ANSWER))).map_err(failed)?;
        stream.write_all(program.text().as_bytes()).map_err(failed)?;
        let number = self.number;
        let runs = self.until(|sample| hindrance(sample).is_some() || interruption(sample, number).is_none())?;
        match hindrance(&self.sample) {
            Some(why) => Err(why.to_owned()),
            None if runs => Ok(()),
            None => Err("the controller has not begun the program that it was sent: check the log of its pendant".to_owned()),
        }
    }

    /// Exchanges packages until a condition holds; returns false if it did not hold in time.
    fn until(&mut self, holds: impl Fn(&Sample) -> bool) -> Result<bool, String> {
        while !holds(&self.sample) {
            if Instant::now() > self.deadline {
                return Ok(false);
            }
            self.exchange()?;
        }
        Ok(true)
    }

    /// Exchanges one package in each direction, with the arm at rest.
    fn exchange(&mut self) -> Result<(), String> {
        (self.told.mode, self.told.mask) = (0, 0);
        self.send().map_err(|why| why.to_string())?;
        self.wait(left(self.deadline).min(self.answer)).map_err(|why| why.to_string())?.then_some(()).ok_or("the controller no longer sends anything")?;
        self.told.goals = self.sample.position;
        Ok(())
    }

    /// Waits for a package; returns false if none arrived.
    pub fn wait(&mut self, within: Duration) -> Result<bool, LinkError> {
        let deadline = Instant::now() + within;
        loop {
            if self.take()? {
                return Ok(true);
            }
            if !self.link.wait(deadline)? {
                return Ok(false);
            }
        }
    }

    /// Takes the newest received package; returns false if there is none. Real-time safe.
    pub fn take(&mut self) -> Result<bool, LinkError> {
        let (of, mut newest, mut refused) = (self.recipes[0], None, 0);
        self.link.receive(|message| {
            if let Message::Data { recipe, values } = message {
                match Sample::decode(values).filter(|_| recipe == of) {
                    Some(sample) => newest = Some(sample),
                    None => refused += 1,
                }
            }
        })?;
        self.refused += refused;
        self.sample = newest.unwrap_or(self.sample);
        Ok(newest.is_some())
    }

    /// Sends the current inputs of the script; returns false if the connection has not accepted the previous package. Real-time safe.
    pub fn send(&mut self) -> Result<bool, LinkError> {
        self.told.beat = self.told.beat.wrapping_add(1);
        self.link.send(&self.told.encode(self.recipes[1]))
    }

    /// Commands the arm to stay at rest at its current position.
    pub fn rest(&mut self) {
        let goals: [f64; JOINTS] = self.sample.position;
        (self.told.mode, self.told.goals) = (0, goals);
    }
}

/// Returns the time left until a deadline, at least 1 ms, because sockets do not accept a timeout of 0.
fn left(deadline: Instant) -> Duration {
    deadline.saturating_duration_since(Instant::now()).max(Duration::from_millis(1))
}

/// Answer to a request.
struct Answer {
    number: u32,
    text: String,
}

/// Reason why a connection could not be established.
enum Failure {
    /// The controller is not available, but may become so later.
    NotThere(String),
    Refused(String),
}

impl From<LinkError> for Failure {
    fn from(why: LinkError) -> Failure {
        Failure::NotThere(why.to_string())
    }
}

/// Returns an error that names the first value of a recipe that the controller does not have, or that is in use by another program.
fn agree(of: &[(&str, &str)], asked: &str, answered: &str) -> Result<(), Failure> {
    if asked == answered {
        return Ok(());
    }
    let wrong = of.iter().zip(answered.split(',')).find(|((_, kind), answer)| kind != answer);
    Err(Failure::Refused(match wrong {
        Some(((name, _), "IN_USE")) => format!("another program commands '{name}' of the controller: end it, or disable the fieldbus that does"),
        Some(((name, _), answer)) => format!("the controller does not offer '{name}' in the form needed: {answer}"),
        None => format!("the controller answered '{answered}' where '{asked}' was expected"),
    }))
}

/// Returns a number that is unlikely to be used by another session.
fn number() -> i32 {
    let nanos = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.subsec_nanos() ^ since.as_secs() as u32);
    1 + (nanos & 0x3fff_ffff) as i32
}
