// SPDX-License-Identifier: Apache-2.0
//! Motions that take over from each other at any instant stay within the joint's limits of speed, acceleration and jerk. So do the servo
//! of a joint whose motion is taken away, and the motion that starts from there.
//!
//! `make test` tries a thousand takeovers, different ones each day; `OPENGPAC_TAKEOVERS` sets the number, and `OPENGPAC_SEED` the first
//! seed.
use library::reference::Braking;
use library::reference::{Approach, ReferenceInputs};
use opengpac::Invocation;
use opengpac::read::{BlockFace, TypeFace};
use opengpac::trial::Trial;
use std::time::SystemTime;

const SPEED: f64 = 2.0;
const ACCELERATION: f64 = 5.0;
const JERK: f64 = 50.0;
/// Number of takeovers in one sequence.
const CHAIN: u64 = 20;

/// Pseudo-random numbers from a seed.
struct Numbers(u64);

impl Numbers {
    fn of(seed: u64) -> Numbers {
        Numbers(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        low + (high - low) * ((self.0 >> 11) as f64 / (1u64 << 53) as f64)
    }
}

/// Set-points, one per cycle, and their differences.
struct Watch {
    cycle_s: f64,
    last: [f64; 4],
    count: u32,
}

impl Watch {
    /// Adds a set-point; returns a description of the first one that breaks a limit.
    fn push(&mut self, setpoint: f64) -> Result<(), String> {
        self.last.rotate_right(1);
        self.last[0] = setpoint;
        self.count += 1;
        if self.count < 4 {
            return Ok(());
        }
        let ([a, b, c, d], t) = (self.last, self.cycle_s);
        // Positions are rounded to about 1e-15 rad.
        let looks = [
            ("speed", (a - b) / t, SPEED, 1e-14 / t),
            ("acceleration", (a - 2.0 * b + c) / (t * t), ACCELERATION, 1e-14 / (t * t)),
            ("jerk", (a - 3.0 * b + 3.0 * c - d) / (t * t * t), JERK, 1e-14 / (t * t * t)),
        ];
        match looks.iter().find(|(_, found, most, rounding)| found.abs() > most * (1.0 + 1e-6) + rounding) {
            Some((what, found, most, _)) => Err(format!("{what} {found} of {most}")),
            None => Ok(()),
        }
    }
}

fn face(name: &str) -> BlockFace {
    let types: Vec<TypeFace> = library::types().into_iter().map(|ty| TypeFace::read(ty).expect("a type of the derive")).collect();
    let mut faces = library::blocks().into_iter().map(|descriptor| BlockFace::read(descriptor, &types).expect("a descriptor of the derive"));
    faces.find(|face| face.name == name).expect("it is registered")
}

/// State at the start of a motion.
#[derive(Clone, Copy)]
struct Start {
    position: f64,
    velocity: f64,
    acceleration: f64,
    /// Time of the set-point, and the servo's braking since; ns, relative to the start of the motion at 0.
    time_ns: i64,
    braking: Braking,
}

/// The generators, one of each kind.
const KINDS: [&str; 3] = ["motion_generator", "velocity_generator", "gear_generator"];

/// Creates a generator that takes over from `last`.
fn begun(face: &BlockFace, last: Start, cycle_s: f64, numbers: &mut Numbers) -> Trial {
    let (kind, mut trial) = (face.name.as_str(), Trial::of(face.clone()));
    if kind != "gear_generator" {
        trial.set("n", &1u32.to_ne_bytes()).expect("a size");
    }
    for (name, value) in [("start", last.position), ("last_velocity", last.velocity), ("last_acceleration", last.acceleration)] {
        trial.set_numbers(name, &[value]).expect(name);
    }
    for (name, value) in [("lead", cycle_s), ("jerk", JERK)] {
        trial.set_numbers(name, &[value]).expect(name);
    }
    trial.set("last_time", &last.time_ns.to_ne_bytes()).expect("a time");
    trial.set_numbers("braking", &last.braking.numbers()).expect("four numbers");
    let share = |numbers: &mut Numbers| if numbers.between(0.0, 1.0) < 0.5 { 1.0 } else { numbers.between(0.05, 1.0) };
    let acceleration = ACCELERATION * share(numbers);
    trial.set_numbers("acceleration", &[acceleration]).expect("a limit");
    match kind {
        "motion_generator" => {
            trial.set_numbers("speed", &[SPEED * share(numbers)]).expect("a limit");
            trial.set_numbers("goal", &[last.position + numbers.between(-1.5, 1.5) * numbers.between(0.0, 1.0)]).expect("a goal");
        }
        "velocity_generator" => {
            let stops = numbers.between(0.0, 1.0) < 0.4;
            trial.set_numbers("velocity", &[if stops { 0.0 } else { numbers.between(-SPEED, SPEED) }]).expect("a velocity");
        }
        _ => {
            trial.set_numbers("speed", &[SPEED]).expect("a limit");
            trial.set_numbers("ratio", &[numbers.between(-1.5, 1.5)]).expect("a ratio");
            trial.set_numbers("deceleration", &[ACCELERATION]).expect("a limit");
        }
    }
    trial
}

/// Runs `CHAIN` consecutive motions at one cycle time, each taking over from its predecessor or starting after it was taken away; returns
/// the first violation.
fn sequence(faces: &[BlockFace; 3], seed: u64, cycle_ms: i64) -> Result<(), String> {
    let cycle_s = cycle_ms as f64 * 1e-3;
    let mut numbers = Numbers::of(seed);
    let mut watch = Watch { cycle_s, last: [0.0; 4], count: 0 };
    let mut last = Start { position: 0.0, velocity: 0.0, acceleration: 0.0, time_ns: i64::MIN, braking: Braking::default() };
    let mut servo = Servo::new(cycle_ms);
    for taken in 0..CHAIN {
        let face = &faces[(numbers.between(0.0, 3.0) as usize).min(2)];
        let kind = face.name.as_str();
        let mut generator = begun(face, last, cycle_s, &mut numbers);
        generator.period_ns = cycle_ms * 1_000_000;
        let cycles = numbers.between(1.0, 1.2 / cycle_s).powf(numbers.between(0.3, 1.0)) as u32;
        let told = |cycle: u32, wrong: String| format!("seed {seed}, {cycle_ms} ms: takeover {taken} by {kind}, cycle {cycle}: {wrong}");
        // The master of a gear moves evenly: its jumps would be the slave's too.
        let mut master = 0.0;
        for cycle in 0..cycles.max(1) {
            if kind == "gear_generator" {
                generator.set_number("master", master).expect("a position");
            }
            generator.run().map_err(|fault| format!("{kind}: {fault:?}"))?;
            master += 1.0 * cycle_s;
            let velocity = if kind == "motion_generator" { "velocity" } else { "setpoint_velocity" };
            let number = |name: &str| generator.number(name).expect("an output");
            // A trial's time starts at 0: the set-point before it is a cycle old.
            let time_ns = -cycle_ms * 1_000_000;
            last = Start {
                position: number("setpoint"),
                velocity: number(velocity),
                acceleration: number("setpoint_acceleration"),
                time_ns,
                braking: Braking::default(),
            };
            watch.push(last.position).map_err(|wrong| told(cycle, wrong))?;
            servo.follow(&last, cycle_ms).map_err(|wrong| told(cycle, wrong))?;
        }
        if numbers.between(0.0, 1.0) < 0.4 {
            let away_ms = numbers.between(0.0, 30.0).powf(numbers.between(1.0, 2.0)) as i64 + 1;
            last = servo.left_alone(last, away_ms).map_err(|wrong| told(cycles, format!("taken away for {away_ms} ms: {wrong}")))?;
            watch.count = 0;
        }
    }
    Ok(())
}

/// A servo at 1 ms: its reference, and the reference's speed.
struct Servo {
    approach: Approach,
    cycle_ms: i64,
    reference: f64,
    speed: f64,
    number: u64,
}

impl Servo {
    fn new(cycle_ms: i64) -> Servo {
        Servo { approach: Approach::default(), cycle_ms, reference: 0.0, speed: 0.0, number: 0 }
    }

    /// Follows a set-point stored now.
    fn follow(&mut self, to: &Start, span_ms: i64) -> Result<(), String> {
        let stored_ns = self.now_ns();
        (0..span_ms).try_for_each(|_| self.advance(to, stored_ns).map(|_| ()))
    }

    /// Receives no further set-point for some time after one that was followed for a cycle; returns the final state.
    fn left_alone(&mut self, last: Start, away_ms: i64) -> Result<Start, String> {
        let stored_ns = self.now_ns() - self.cycle_ms * 1_000_000;
        let mut braking = Braking::default();
        for _ in 0..away_ms {
            braking = self.advance(&last, stored_ns)?;
        }
        // A trial's time starts at 0, where 0 means that set-points lead.
        let since = |time_ns: i64| if time_ns == 0 { 0 } else { time_ns - self.now_ns() - 1 };
        Ok(Start { time_ns: since(stored_ns), braking: Braking { time_ns: since(braking.time_ns), ..braking }, ..last })
    }

    /// Runs one invocation; fails if its speed or acceleration is wrong.
    fn advance(&mut self, to: &Start, stored_ns: i64) -> Result<Braking, String> {
        let led = ReferenceInputs {
            setpoint: to.position,
            velocity: to.velocity,
            acceleration: to.acceleration,
            time_ns: stored_ns,
            speed_max: SPEED,
            acceleration_max: ACCELERATION,
            jerk_max: JERK,
            ..ReferenceInputs::default()
        };
        let invocation = Invocation { number: self.number, time_ns: self.now_ns(), now_ns: self.now_ns() };
        let now = self.approach.advance(&invocation, led, |_| self.cycle_ms as u32);
        let speed = (now.reference - self.reference) / 1e-3;
        let acceleration = (speed - self.speed) / 1e-3;
        (self.reference, self.speed, self.number) = (now.reference, speed, self.number + 1);
        if speed.abs() > SPEED * (1.0 + 1e-6) || acceleration.abs() > ACCELERATION * (1.0 + 1e-6) + 1e-8 {
            return Err(format!("its servo goes at {speed} rad/s, {acceleration} rad/s²"));
        }
        Ok(now.braking)
    }

    fn now_ns(&self) -> i64 {
        self.number as i64 * 1_000_000
    }
}

#[test]
fn a_motion_that_takes_over_keeps_to_speed_acceleration_and_jerk() {
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse().ok());
    let takeovers: u64 = number("OPENGPAC_TAKEOVERS").unwrap_or(1000);
    let day = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs() / 86_400);
    let faces = KINDS.map(face);
    let first = number("OPENGPAC_SEED").unwrap_or(day * 1000);
    let wrong: Vec<String> =
        (first..first + takeovers.div_ceil(CHAIN)).filter_map(|seed| sequence(&faces, seed, if seed.is_multiple_of(2) { 1 } else { 20 }).err()).collect();
    assert!(wrong.is_empty(), "{} of {takeovers}: {}", wrong.len(), wrong[..wrong.len().min(5)].join("\n"));
}
