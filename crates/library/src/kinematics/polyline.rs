// SPDX-License-Identifier: Apache-2.0
//! Straight lines of the tool through poses, joined by blends, planned as a whole before anything moves.
//!
//! The position of the tool moves along a path of four coordinates: x, y, z, and the angle rotated since the start, so that the
//! orientation has a speed and an acceleration too. On a line, the orientation turns uniformly about one axis; in a blend, it changes
//! from one rotation to the other in the same way as the position (de Casteljau's construction, with rotations in place of lines).
//! Inverse kinematics is solved along the whole path in advance, and the path is slowed down as a whole until no joint exceeds its limits
//! anywhere.
pub(crate) mod generator;
pub(crate) mod planner;
mod planning;

use super::JOINTS_MAX;
use super::follower::{Stretch, Way};
use super::pose::{Pose, length};
use crate::path::{LONG_POINTS_MAX, LongPath, POINTS_MAX, Part, Path, Table, View};
use opengpac::Type;
pub use planning::{Budget, PolylinePlanning, which};

/// Number of points within a period at which a change of the pace is checked.
const PLACES: u32 = 6;
/// Number of position coordinates; also the index of the angle.
const SPACE: usize = 3;

macro_rules! polyline {
    ($(#[$about:meta])* $name:ident, $path:ty, $all:expr) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Type)]
        #[repr(C)]
        pub struct $name {
            /// Path of x, y, z (m) and the rotated angle (rad).
            pub path: $path,
            /// Orientation at each way-point, w first.
            pub quaternion: [[f64; 4]; $all],
            /// Number of joints.
            pub joints: i32,
            /// Joint positions at the start.
            pub from: [f64; JOINTS_MAX],
            /// Joint positions at the end.
            pub to: [f64; JOINTS_MAX],
            /// Maximum acceleration of the position (m/s²) and of the angle (rad/s²).
            pub acceleration: [f64; 2],
        }

        impl $name {
            /// Returns a view for reading the path.
            pub fn view(&self) -> PolylineView<'_> {
                PolylineView { path: self.path.view(), quaternion: &self.quaternion, from: &self.from, to: &self.to, acceleration: self.acceleration }
            }

            /// Returns a table for planning the path.
            pub fn table(&mut self) -> PolylineTable<'_> {
                PolylineTable {
                    path: self.path.table(), quaternion: &mut self.quaternion, joints: &mut self.joints, from: &mut self.from, to: &mut self.to,
                    acceleration: &mut self.acceleration,
                }
            }
        }
    };
}

polyline!(
    /// A planned path of the tool.
    Polyline, Path, POINTS_MAX + 1
);
polyline!(
    /// A planned path of the tool through up to 4,096 poses; otherwise like `polyline`.
    LongPolyline, LongPath, LONG_POINTS_MAX + 1
);

/// A planned path of the tool of any length, with the field names of [`Polyline`].
#[derive(Clone, Copy, Debug)]
pub struct PolylineView<'a> {
    pub path: View<'a>,
    pub quaternion: &'a [[f64; 4]],
    pub from: &'a [f64; JOINTS_MAX],
    pub to: &'a [f64; JOINTS_MAX],
    pub acceleration: [f64; 2],
}

/// Table into which a path of straight lines is planned.
pub struct PolylineTable<'a> {
    pub path: Table<'a>,
    pub quaternion: &'a mut [[f64; 4]],
    pub joints: &'a mut i32,
    pub from: &'a mut [f64; JOINTS_MAX],
    pub to: &'a mut [f64; JOINTS_MAX],
    pub acceleration: &'a mut [f64; 2],
}

impl PolylineView<'_> {
    /// Returns the way-point at the end of the line at a time.
    fn before(&self, time_s: f64) -> usize {
        match self.path.part(time_s) {
            Part::Line { after, .. } => after + 1,
            Part::Blend { at, .. } => at,
        }
    }

    /// Returns the orientation at a fraction of the line after a way-point.
    fn turned(&self, after: usize, share: f64) -> [f64; 4] {
        if self.path.points < 2 { self.quaternion[0] } else { between(self.quaternion[after], self.quaternion[after + 1], share) }
    }

    /// Returns the velocity and acceleration of the position and of the angle at a time, in the quantities to which the limits apply.
    fn motion(&self, time_s: f64) -> ([f64; 4], [f64; 4]) {
        let (mut velocity, mut acceleration) = ([0.0; 4], [0.0; 4]);
        self.path.evaluate(time_s, &mut [0.0; 4], &mut velocity, &mut acceleration);
        (velocity, acceleration)
    }

    /// Returns true if the limits allow the planned motion at a time to be executed at a pace that changes at `slope`.
    fn fits(&self, time_s: f64, pace: f64, slope: f64) -> bool {
        let (velocity, planned) = self.motion(time_s);
        let together = crate::pace::acceleration;
        let space: [f64; SPACE] = std::array::from_fn(|i| together(velocity[i], planned[i], pace, slope));
        let angle = together(velocity[SPACE], planned[SPACE], pace, slope);
        crate::pace::within(length(space), self.acceleration[0]) && crate::pace::within(angle, self.acceleration[1])
    }
}

impl Way for PolylineView<'_> {
    fn plan(&self) -> f64 {
        self.path.plan
    }

    fn ends(&self) -> (&[f64; JOINTS_MAX], &[f64; JOINTS_MAX]) {
        (self.from, self.to)
    }

    fn duration_s(&self) -> f64 {
        self.path.duration
    }

    fn progress(&self, time_s: f64) -> f64 {
        if time_s >= self.path.duration { 1.0 } else { time_s / self.path.duration }
    }

    fn pose(&self, time_s: f64) -> Pose {
        let mut place = [0.0; SPACE + 1];
        self.path.evaluate(time_s, &mut place, &mut [0.0; SPACE + 1], &mut [0.0; SPACE + 1]);
        let quaternion = match self.path.part(time_s) {
            Part::Line { after, share } => self.turned(after, share),
            Part::Blend { at, share, before, behind } => {
                let (begin, end) = (self.turned(at - 1, before), self.turned(at, behind));
                let corner = self.quaternion[at];
                between(between(begin, corner, share), between(corner, end, share), share)
            }
        };
        Pose { position: [place[0], place[1], place[2]], quaternion }
    }

    fn allows(&self, stretch: Stretch) -> bool {
        (0..=PLACES).all(|k| {
            let share = f64::from(k) / f64::from(PLACES);
            self.fits(stretch.time_s + stretch.way_s * share, stretch.pace + (stretch.after - stretch.pace) * share, stretch.slope)
        })
    }
}

/// Interpolates between two orientations by a fraction of the shorter rotation.
fn between(from: [f64; 4], to: [f64; 4], share: f64) -> [f64; 4] {
    let (from, to) = (Pose { quaternion: from, ..Pose::IDENTITY }, Pose { quaternion: to, ..Pose::IDENTITY });
    from.along(from.to(&to), share).quaternion
}
