// SPDX-License-Identifier: Apache-2.0
//! Planned paths as exchanged between blocks: tables of two lengths, a short one that is copied in each invocation and a long one that is
//! used in place.
use super::planning::Table;
use super::view::View;
use super::{LONG_POINTS_MAX, POINTS_MAX};
use crate::profile::JOINTS_MAX;
use opengpac::Type;

macro_rules! path {
    ($(#[$about:meta])* $name:ident, $all:expr) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Type)]
        #[repr(C)]
        pub struct $name {
            /// Number of the plan: 1, 2, …; 0 if there is none yet; -1 while it is being planned.
            pub plan: f64,
            /// Number of joints.
            pub joints: i32,
            /// Number of way-points including the start; coincident ones are merged.
            pub points: i32,
            /// Number of leading coordinates that form a position in space and are measured together; 0 if each coordinate is a joint.
            pub space: i32,
            /// Duration, s.
            pub duration: f64,
            /// Joint positions.
            pub q: [[f64; JOINTS_MAX]; $all],
            /// Distance from the way-point at which its blend begins and ends, in joint space.
            pub reach: [f64; $all],
            /// Rate along the path at the blend, 1/s of that distance.
            pub through: [f64; $all],
            /// Maximum rate on the next line.
            pub top: [f64; $all],
            /// Maximum acceleration on the next line.
            pub slope: [f64; $all],
            /// Time at which the next line begins, s.
            pub begin: [f64; $all],
        }

        impl $name {
            /// Returns a view for reading the path.
            pub fn view(&self) -> View<'_> {
                View {
                    plan: self.plan, joints: self.joints as usize, points: self.points as usize, space: self.space as usize, duration: self.duration,
                    q: &self.q, reach: &self.reach, through: &self.through, top: &self.top, slope: &self.slope, begin: &self.begin,
                }
            }

            /// Returns a table for planning the path.
            pub fn table(&mut self) -> Table<'_> {
                Table {
                    plan: &mut self.plan, joints: &mut self.joints, points: &mut self.points, space: &mut self.space, duration: &mut self.duration,
                    q: &mut self.q, reach: &mut self.reach, through: &mut self.through, top: &mut self.top, slope: &mut self.slope, begin: &mut self.begin,
                }
            }
        }
    };
}

path!(
    /// A planned path. Entry k of each list belongs to way-point k; entry 0 is the start.
    Path, POINTS_MAX + 1
);
path!(
    /// A planned path of up to 4,096 way-points; otherwise like `path`.
    LongPath, LONG_POINTS_MAX + 1
);
