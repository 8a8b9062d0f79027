// SPDX-License-Identifier: Apache-2.0
//! Homing of an emulated drive, using methods 1, 2, 17, 18, 33, 34, 35 and 37 of CiA 402.
use super::objects::{Access, Handle, Objects};

/// Number of counts between index pulses.
const INDEX: f64 = 4096.0;

/// Positions of the machine's limit switches, in counts from the drive's initial zero position; `None` if there are no switches.
pub type Limits = Option<[f64; 2]>;

pub struct Search {
    at: Handles,
    way: Way,
    had_start: bool,
}

struct Handles {
    method: Handle,
    to_switch: Handle,
    to_zero: Handle,
    offset: Handle,
}

/// Phase of homing.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    Idle,
    /// Motion to a machine position, and from there to the next one; counts.
    Going {
        to: f64,
        then: Option<f64>,
    },
    Home,
    Failed,
}

/// Motion during a step.
pub struct HomingMotion {
    pub velocity: f64,
    /// New position value at the drive's current location.
    pub position: Option<f64>,
}

impl Search {
    pub fn new(objects: &mut Objects) -> Search {
        use Access::Written;
        let offset = objects.add(0x607C, 0, Written, &0i32.to_le_bytes());
        let method = objects.add(0x6098, 0, Written, &[35]);
        objects.add(0x6099, 0, Access::Constant, &[2]);
        let to_switch = objects.add(0x6099, 1, Written, &100_000u32.to_le_bytes());
        let to_zero = objects.add(0x6099, 2, Written, &20_000u32.to_le_bytes());
        objects.add(0x609A, 0, Written, &1_000_000u32.to_le_bytes());
        Search { at: Handles { method, to_switch, to_zero, offset }, way: Way::Idle, had_start: false }
    }

    pub fn is_home(&self) -> bool {
        self.way == Way::Home
    }

    pub fn has_failed(&self) -> bool {
        self.way == Way::Failed
    }

    /// Resets homing. Called while the drive is in another mode.
    pub fn leave(&mut self) {
        (self.way, self.had_start) = (Way::Idle, false);
    }

    /// Advances by a time span, starting from this machine position.
    pub fn step(&mut self, objects: &Objects, starts: bool, place: f64, limits: Limits, span_s: f64) -> HomingMotion {
        if starts && !self.had_start {
            self.way = way(objects.number(self.at.method) as i8, place, limits);
        } else if !starts && matches!(self.way, Way::Going { .. }) {
            self.way = Way::Idle;
        }
        self.had_start = starts;
        let Way::Going { to, then } = self.way else { return HomingMotion { velocity: 0.0, position: None } };
        let speed = f64::from(objects.bits(if then.is_some() { self.at.to_switch } else { self.at.to_zero }));
        if (to - place).abs() > speed * span_s {
            return HomingMotion { velocity: speed.copysign(to - place), position: None };
        }
        self.way = then.map_or(Way::Home, |next| Way::Going { to: next, then: None });
        let velocity = if span_s > 0.0 { (to - place) / span_s } else { 0.0 };
        let position = self.is_home().then(|| objects.number(self.at.offset) as f64);
        HomingMotion { velocity, position }
    }
}

fn way(method: i8, place: f64, limits: Limits) -> Way {
    let index = |from: f64, up: bool| if up { (from / INDEX).floor() * INDEX + INDEX } else { (from / INDEX).ceil() * INDEX - INDEX };
    let to = |to: f64, then: Option<f64>| Way::Going { to, then };
    match (method, limits) {
        // The search goes to a switch, and back to the next pulse.
        (1, Some([minimum, _])) => to(minimum, Some(index(minimum, true))),
        (2, Some([_, maximum])) => to(maximum, Some(index(maximum, false))),
        (17, Some([minimum, _])) => to(minimum, Some(minimum)),
        (18, Some([_, maximum])) => to(maximum, Some(maximum)),
        (33, _) => to(index(place, false), None),
        (34, _) => to(index(place, true), None),
        (35 | 37, _) => to(place, None),
        _ => Way::Failed,
    }
}
