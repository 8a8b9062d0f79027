// SPDX-License-Identifier: Apache-2.0
//! Course of the tool: a straight line or a circular arc along which the tool may turn, in closed form as a function of a coordinate from
//! 0 to 1.
//!
//! An arc is described by angles at its points and not by its centre: the centre of three nearly collinear points is far away and
//! ill-conditioned, but the tangent and the length are well-conditioned. With φ = angle · s, the position is start + along s sin(φ)/φ +
//! across s (1 - cos φ)/φ, which is the straight line if the angle is 0. The orientation at s is that at the start, rotated by the
//! rotation vector turn s + bend s².
use super::pose::{Numbers, Pose, add, cross, length, of_rotation_vector, product, scale, subtract, unit};
use crate::profile::Limits;
use opengpac::Type;
use std::f64::consts::{PI, TAU};

/// Distance below which points of an arc count as coincident, m.
const SAME: f64 = 1e-6;
/// Deviation from a straight line that an arm cannot resolve, m.
const FLAT: f64 = 5e-7;
/// Radius above which no arm can follow more than half of a circle, m.
const RADIUS_MAX: f64 = 10.0;
/// Fraction of the acceleration that the centripetal acceleration may use; the rest is for the acceleration along the circle.
const ROUND: f64 = 0.8;
/// Bend below which a turn counts as uniform, rad.
const UNBENT: f64 = 1e-9;

/// Course of the tool for s from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Type)]
#[repr(C)]
pub struct Course {
    /// Pose of the tool at the start.
    pub start: Numbers,
    /// Displacement along the tangent at the start, m.
    pub along: [f64; 3],
    /// Displacement of the same length towards the centre of the circle, m; 0 for a straight line.
    pub across: [f64; 3],
    /// Angle of the arc, rad; 0 for a straight line.
    pub angle: f64,
    /// Rotation vector of the turn per unit of s, rad.
    pub turn: [f64; 3],
    /// Rotation vector of the bend per unit of s², rad.
    pub bend: [f64; 3],
}

/// Orientation of the tool along an arc.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Orientation {
    /// Matches the orientations of the start, the via pose and the goal at those poses.
    Via,
    /// Turns uniformly from the orientation of the start to that of the goal.
    Goal,
    /// Keeps the orientation relative to the path.
    Path,
}

impl Orientation {
    /// Returns the orientation with this number: 0, 1, 2.
    pub fn of(number: i32) -> Option<Orientation> {
        [Orientation::Via, Orientation::Goal, Orientation::Path].get(usize::try_from(number).ok()?).copied()
    }
}

/// Reason why three poses do not define an arc. The numbers are the values of a condition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoArc {
    /// The via pose coincides with the tool.
    ViaAtStart = 1,
    /// The via pose coincides with the goal.
    ViaAtGoal = 2,
    /// The goal coincides with the tool.
    GoalAtStart = 3,
    /// The three poses are on a straight line, and the via pose is not between the other two.
    ViaBeyond = 4,
    /// The three poses are on a straight line, and an angle is requested.
    Straight = 5,
    /// The angle ends before the via pose, whose orientation is requested.
    ViaAfterEnd = 6,
}

/// Request for an arc.
#[derive(Clone, Copy, Debug)]
pub struct Arc {
    pub via: Pose,
    pub goal: Pose,
    /// Angle at which the arc ends, rad; `None` if it ends at the goal.
    pub angle: Option<f64>,
    pub orientation: Orientation,
}

impl Course {
    /// Returns the straight line from one pose to another, with a uniform rotation about one axis.
    pub fn straight(start: &Pose, goal: &Pose) -> Course {
        let (along, turn) = start.to(goal);
        Course { start: start.numbers(), along, turn, ..<Course as Type>::zero() }
    }

    /// Returns the circular arc from a pose through another pose.
    pub fn arc(start: &Pose, arc: &Arc) -> Result<Course, NoArc> {
        let (to_via, to_goal) = (subtract(arc.via.position, start.position), subtract(arc.goal.position, start.position));
        let on = subtract(to_goal, to_via);
        for (way, reason) in [(to_via, NoArc::ViaAtStart), (on, NoArc::ViaAtGoal), (to_goal, NoArc::GoalAtStart)] {
            if length(way) < SAME {
                return Err(reason);
            }
        }
        let (course, via_share) = match round(to_via, to_goal, on) {
            Some((circle, axis)) => {
                let angle = arc.angle.unwrap_or(circle.to_goal);
                let whole = angle * circle.radius;
                let across = scale(cross(axis, circle.tangent), whole);
                let turn = if arc.orientation == Orientation::Path { scale(axis, angle) } else { [0.0; 3] };
                (Course { along: scale(circle.tangent, whole), across, angle, turn, ..<Course as Type>::zero() }, circle.to_via / angle)
            }
            None if dot(to_via, on) < 0.0 => return Err(NoArc::ViaBeyond),
            None if arc.angle.is_some() => return Err(NoArc::Straight),
            None => (Course { along: to_goal, ..<Course as Type>::zero() }, length(to_via) / length(to_goal)),
        };
        let (turn, bend) = match arc.orientation {
            Orientation::Path => (course.turn, [0.0; 3]),
            Orientation::Goal => (start.to(&arc.goal).1, [0.0; 3]),
            Orientation::Via if via_share >= 1.0 => return Err(NoArc::ViaAfterEnd),
            Orientation::Via => turns(start, arc, via_share),
        };
        Ok(Course { start: start.numbers(), turn, bend, ..course })
    }

    /// Returns the pose at s; `start` is the start pose of the course.
    pub fn at(&self, start: &Pose, s: f64) -> Pose {
        let half = self.angle * s / 2.0;
        let position = add(add(start.position, scale(self.along, s * sinc(self.angle * s))), scale(self.across, s * half * sinc(half) * sinc(half)));
        let turn = add(scale(self.turn, s), scale(self.bend, s * s));
        Pose { position, quaternion: unit(product(of_rotation_vector(turn), start.quaternion)) }
    }

    /// Returns true if the course is an arc or its turn is not uniform, so that it needs checks that a straight line does not need.
    pub fn is_bent(&self) -> bool {
        self.angle != 0.0 || self.turns_unevenly()
    }

    /// Returns true if the axis or the speed of the turn changes along the course.
    pub fn turns_unevenly(&self) -> bool {
        self.bend != [0.0; 3]
    }

    /// Returns the length of the course, m, and the angle of a uniform turn, rad.
    pub fn lengths(&self) -> (f64, f64) {
        (length(self.along), length(self.turn))
    }

    /// Returns the limits of the position along the course, reduced to allow for the centripetal acceleration.
    pub fn along_it(&self, linear: Limits) -> Limits {
        if self.angle == 0.0 {
            return linear;
        }
        let curvature = self.angle / length(self.along);
        let speed = linear.speed.min((ROUND * linear.acceleration / curvature).sqrt());
        let round = speed * speed * curvature / linear.acceleration;
        Limits { speed, acceleration: linear.acceleration * (1.0 - round * round).sqrt(), ..linear }
    }
}

/// Circle through three points.
struct Circle {
    /// Unit vector of the initial direction.
    tangent: [f64; 3],
    radius: f64,
    /// Angles from the start to the other two points, rad.
    to_via: f64,
    to_goal: f64,
}

/// Returns the circle from a start through two points relative to it (`on` is the displacement from the first to the second) and the unit
/// vector of its axis; `None` if the points are collinear.
fn round(to_via: [f64; 3], to_goal: [f64; 3], on: [f64; 3]) -> Option<(Circle, [f64; 3])> {
    let area = cross(to_via, to_goal);
    let longest = length(to_via).max(length(to_goal)).max(length(on));
    if length(area) <= FLAT * longest {
        return None;
    }
    let axis = scale(area, 1.0 / length(area));
    let radius = length(to_via) * length(to_goal) * length(on) / (2.0 * length(area));
    // The angle of an arc is twice the inscribed angle over its chord.
    let between = |a: [f64; 3], b: [f64; 3]| length(cross(a, b)).atan2(dot(a, b));
    let (to_via_half, to_goal_half) = (between(to_goal, on), between(to_via, on));
    if radius > RADIUS_MAX && to_goal_half > PI / 2.0 {
        return None;
    }
    let chord = scale(to_via, 1.0 / length(to_via));
    let (sine, cosine) = to_via_half.sin_cos();
    let tangent = subtract(scale(chord, cosine), scale(cross(axis, chord), sine));
    Some((Circle { tangent, radius, to_via: 2.0 * to_via_half, to_goal: 2.0 * to_goal_half }, axis))
}

/// Returns the turn and bend for which the tool has the orientation of the via pose at the fraction `share` of the course, and that of
/// the goal at its end.
fn turns(start: &Pose, arc: &Arc, share: f64) -> ([f64; 3], [f64; 3]) {
    let to_via = start.to(&arc.via).1;
    let goal = goes_on(start.to(&arc.goal).1, add(to_via, arc.via.to(&arc.goal).1));
    let bend = scale(subtract(to_via, scale(goal, share)), 1.0 / (share * share - share));
    if length(bend) < UNBENT { (goal, [0.0; 3]) } else { (subtract(goal, bend), bend) }
}

/// Returns the equivalent rotation vector that is nearest to `near`. A turn may exceed half a revolution, so the vector is not unique.
fn goes_on(turn: [f64; 3], near: [f64; 3]) -> [f64; 3] {
    let angle = length(turn);
    let axis = if angle > UNBENT { scale(turn, 1.0 / angle) } else { scale(near, -1.0 / length(near).max(UNBENT)) };
    let other = subtract(turn, scale(axis, TAU));
    if length(subtract(other, near)) < length(subtract(turn, near)) { other } else { turn }
}

/// Returns sin(x)/x.
fn sinc(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { x.sin() / x }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinematics::pose::{rotation_vector, turn as about};
    use crate::path::samples::numbers;

    const PLAIN: Orientation = Orientation::Goal;

    fn at(position: [f64; 3]) -> Pose {
        Pose { position, ..Pose::IDENTITY }
    }

    fn arc(via: [f64; 3], goal: [f64; 3], angle: Option<f64>) -> Result<Course, NoArc> {
        Course::arc(&at([0.0; 3]), &Arc { via: at(via), goal: at(goal), angle, orientation: PLAIN })
    }

    #[test]
    fn it_passes_three_points_of_any_circle_at_their_angles() {
        for seed in 0..500 {
            let mut number = numbers(seed);
            let radius = 10f64.powf(number(-4.0, 4.0));
            // Beyond half a circle only if an arm can reach that far; never so short that its points coincide or it is flat.
            let whole = number(0.0, 1.0) * if radius > 1.0 { 1.0 / radius } else { TAU - 0.2 } + if radius > 1.0 { 0.1 / radius.sqrt() } else { 0.1 };
            let share = number(0.2, 0.8);
            let axis: [f64; 3] = std::array::from_fn(|_| number(-1.0, 1.0));
            let turned = of_rotation_vector(scale(axis, 3.0 / length(axis)));
            let place = |angle: f64| crate::kinematics::pose::rotate(turned, [radius * angle.sin(), 2.0 * radius * (angle / 2.0).sin().powi(2), 0.0]);
            let course = arc(place(whole * share), place(whole), None).expect("a circle");
            assert!((course.angle / whole - 1.0).abs() < 1e-3, "{seed}: {} for {whole} at {radius} m", course.angle);
            for s in [0.0, 0.1, share, 0.9, 1.0] {
                let off = length(subtract(course.at(&Pose::IDENTITY, s).position, place(whole * s)));
                assert!(off < 1e-9, "{seed}: {off} m at {s} of {whole} rad, radius {radius} m");
            }
        }
    }

    #[test]
    fn an_angle_leads_on_and_round() {
        let (via, goal) = ([0.1, 0.1, 0.0], [0.0, 0.2, 0.0]);
        for (angle, end) in [(TAU, [0.0; 3]), (1.5 * PI, [-0.1, 0.1, 0.0]), (3.0 * PI, goal), (0.5 * PI, via)] {
            let course = arc(via, goal, Some(angle)).expect("a circle");
            assert!(length(subtract(course.at(&Pose::IDENTITY, 1.0).position, end)) < 1e-15, "{angle}");
        }
    }

    #[test]
    fn points_without_a_circle_are_told_apart() {
        let (near, far) = ([0.1, 0.0, 0.0], [0.2, 0.0, 0.0]);
        assert_eq!(arc([0.0; 3], far, None).err(), Some(NoArc::ViaAtStart));
        assert_eq!(arc(far, far, None).err(), Some(NoArc::ViaAtGoal));
        assert_eq!(arc(far, [0.0; 3], Some(TAU)).err(), Some(NoArc::GoalAtStart));
        assert_eq!(arc(far, near, None).err(), Some(NoArc::ViaBeyond));
        assert_eq!(arc([0.2, 1e-4, 0.0], near, None).err(), Some(NoArc::ViaBeyond), "a circle of 100 m");
        assert_eq!(arc([-0.1, 0.0, 0.0], near, None).err(), Some(NoArc::ViaBeyond));
        assert_eq!(arc(near, far, Some(1.0)).err(), Some(NoArc::Straight));
        let straight = arc(near, far, None).expect("a line");
        assert_eq!((straight.angle, straight.at(&Pose::IDENTITY, 1.0).position), (0.0, far));
        let oriented = Arc { via: at([0.1, 0.1, 0.0]), goal: at([0.0, 0.2, 0.0]), angle: Some(1.0), orientation: Orientation::Via };
        assert_eq!(Course::arc(&Pose::IDENTITY, &oriented).err(), Some(NoArc::ViaAfterEnd));
    }

    #[test]
    fn the_orientation_is_as_it_was_asked_for() {
        let (axis, quarter) = ([0.6, 0.0, 0.8], [0.1, 0.1, 0.0]);
        let pose = |position, angle| Pose { position, quaternion: about(axis, angle) };
        let angle_at = |course: &Course, s: f64| length(rotation_vector(course.at(&Pose::IDENTITY, s).quaternion));
        // Beyond half a turn it continues in the direction in which it passed the via pose.
        for (via, goal) in [(0.5, 1.0), (1.0, 0.4), (2.0, 4.0), (3.0, 6.0), (-1.0, 1.0), (0.0, 1.0)] {
            let arc = Arc { via: pose(quarter, via), goal: pose([0.0, 0.2, 0.0], goal), angle: None, orientation: Orientation::Via };
            let course = Course::arc(&Pose::IDENTITY, &arc).expect("a circle");
            for (s, wanted) in [(0.5, arc.via), (1.0, arc.goal)] {
                assert!(length(course.at(&Pose::IDENTITY, s).to(&wanted).1) < 1e-12, "{via} {goal} at {s}");
            }
            assert!(length(course.turn) < 8.0, "{via} {goal}: {}", length(course.turn));
        }
        let arc = Arc { via: pose(quarter, 1.5), goal: pose([0.0, 0.2, 0.0], 1.0), angle: None, orientation: Orientation::Goal };
        let even = Course::arc(&Pose::IDENTITY, &arc).expect("a circle");
        assert!((angle_at(&even, 0.3) - 0.3).abs() < 1e-12);
        // With its orientation kept relative to the path, the tool turns as the tangent does.
        let kept = Course::arc(&Pose::IDENTITY, &Arc { orientation: Orientation::Path, ..arc }).expect("a circle");
        assert!((angle_at(&kept, 0.5) - PI / 2.0).abs() < 1e-12);
    }

    #[test]
    fn the_way_round_takes_its_part_of_the_acceleration() {
        let course = arc([0.1, 0.1, 0.0], [0.0, 0.2, 0.0], None).expect("a circle of 0.1 m");
        for speed in [0.01, 0.2, 0.25, 1.0, 10.0] {
            let limits = course.along_it(Limits { speed, acceleration: 1.0, jerk: 10.0 });
            let round = limits.speed * limits.speed / 0.1;
            assert!(round.hypot(limits.acceleration) <= 1.0 + 1e-12 && limits.acceleration >= 0.6 - 1e-12, "{speed}");
        }
    }
}
