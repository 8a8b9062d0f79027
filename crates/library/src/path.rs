// SPDX-License-Identifier: Apache-2.0
//! A motion of several joints through way-points: straight lines in joint space, joined by parabolic blends.
//!
//! Around a way-point the corner is cut by a parabola that begins and ends at the distance d from it. At the constant rate w along it
//! each joint has a constant acceleration (u₂ - u₁) w²/(2 d), u₁ and u₂ being the directions of the lines, and the path passes the
//! way-point at d/4 |u₂ - u₁| (Craig, *Introduction to Robotics*, section 7.4: linear paths with parabolic blends). Along a line the
//! rate speeds up, is constant and slows down. The rates at the blends are the maximum that every joint's limits and the lines
//! between them allow: one pass forward, one backward. So no limit is exceeded anywhere, and the last way-point is reached exactly.
use crate::profile::{JOINTS_MAX, Limits};
use opengpac::Type;

/// The maximum number of way-points of one motion, without its start.
pub const POINTS_MAX: usize = 64;
/// With it.
const ALL: usize = POINTS_MAX + 1;
/// Way-points nearer than this in every joint are one, rad or m.
const SAME: f64 = 1e-12;

/// A planned path. Entry k of each list belongs to way-point k, 0 being the start.
#[derive(Clone, Copy, Debug, PartialEq, Type)]
#[repr(C)]
pub struct Path {
    /// Number of the plan: 1, 2, …; 0: none yet.
    pub plan: f64,
    /// Number of joints.
    pub joints: i32,
    /// Number of way-points with the start; of those that were one, one is left.
    pub points: i32,
    /// Number of coordinates, the first ones, that are a position in space and are measured together; 0: each is a joint.
    pub space: i32,
    /// Planned duration, s.
    pub duration: f64,
    /// Joint positions.
    pub q: [[f64; JOINTS_MAX]; ALL],
    /// Distance from the way-point at which its blend begins and ends, in the distance of joint space.
    pub reach: [f64; ALL],
    /// Rate along the path at the blend, 1/s of that distance.
    pub through: [f64; ALL],
    /// Maximum rate on the line that follows.
    pub top: [f64; ALL],
    /// Maximum acceleration on it.
    pub slope: [f64; ALL],
    /// When that line begins, s.
    pub begin: [f64; ALL],
}

/// Closest distance of the path to a way-point, and its speed there.
#[derive(Clone, Copy, Debug)]
pub struct Passing {
    /// Maximum distance of a joint from the way-point, rad or m; 0: it stops there.
    pub blend: f64,
    /// Maximum speed of a joint on the line to the way-point, rad/s or m/s.
    pub speed: f64,
}

/// A part of a path, and how much of it is done, 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Part {
    /// On the line after a way-point; the share is of the whole line, blends included.
    Line { after: usize, share: f64 },
    /// In the blend of a way-point, which begins at the share `before` of the line before it and ends at `behind` of that after it.
    Blend { at: usize, share: f64, before: f64, behind: f64 },
}

/// One line between two way-points.
struct Line {
    direction: [f64; JOINTS_MAX],
    /// Of the whole line, and of what its blends leave.
    whole: f64,
    rest: f64,
    /// Rates at the beginning, at the most, at the end, and the times of speeding up, constant rate and slowing down.
    rates: [f64; 3],
    times: [f64; 3],
}

/// Plans path number `plan` (from 1) from `start` through `points`, `passing` one by one. The three lists of joints have one length, at most
/// [`JOINTS_MAX`]; there are at most [`POINTS_MAX`] points; every number is finite, blends are not below 0, every limit is positive:
/// the caller has checked. The jerk of `limits` is not used: the acceleration is constant in each part.
pub fn plan(plan: f64, start: &[f64], points: &[[f64; JOINTS_MAX]], passing: &[Passing], limits: &[Limits]) -> Path {
    plan_in(0, plan, start, points, passing, limits)
}

/// As [`plan`], where the first `space` coordinates are a position: their speed, acceleration and blend are those of the point, the limits the
/// first ones; a way-point's speed and blend are the position's only.
pub fn plan_in(space: usize, plan: f64, start: &[f64], points: &[[f64; JOINTS_MAX]], passing: &[Passing], limits: &[Limits]) -> Path {
    let n = start.len();
    let mut path = <Path as Type>::zero();
    (path.plan, path.joints, path.space) = (plan, n as i32, space as i32);
    path.q[0][..n].copy_from_slice(start);
    let mut blends = [0.0; ALL];
    let mut speeds = [0.0; ALL];
    let mut last = 0;
    for (point, passing) in points.iter().zip(passing) {
        if (0..n).all(|i| (point[i] - path.q[last][i]).abs() <= SAME) {
            continue;
        }
        last += 1;
        path.q[last][..n].copy_from_slice(&point[..n]);
        (blends[last], speeds[last]) = (passing.blend, passing.speed);
    }
    path.points = last as i32 + 1;
    limit_lines(&mut path, &speeds, limits);
    cut_corners(&mut path, &blends, limits);
    match_rates(&mut path);
    for k in 0..last {
        let blend_s = if path.reach[k + 1] > 0.0 { 2.0 * path.reach[k + 1] / path.through[k + 1] } else { 0.0 };
        path.begin[k + 1] = path.begin[k] + path.line(k).times.iter().sum::<f64>() + blend_s;
    }
    path.duration = path.begin[last];
    path
}

/// The maximum rate and acceleration of each line.
fn limit_lines(path: &mut Path, speeds: &[f64; ALL], limits: &[Limits]) {
    for k in 0..path.points as usize - 1 {
        let u = path.measures(&path.direction(k).0);
        path.top[k] = speeds[k + 1] / path.maximum(&u);
        path.slope[k] = f64::INFINITY;
        for (u, limit) in u.iter().zip(limits).filter(|(u, _)| **u > 0.0) {
            path.top[k] = path.top[k].min(limit.speed / u);
            path.slope[k] = path.slope[k].min(limit.acceleration / u);
        }
    }
}

/// Finds the reach of each blend, and the maximum rate that the joints' accelerations allow there.
fn cut_corners(path: &mut Path, blends: &[f64; ALL], limits: &[Limits]) {
    for (k, blend) in blends.iter().enumerate().take(path.points as usize - 1).skip(1) {
        let ((before, long), (after, short)) = (path.direction(k - 1), path.direction(k));
        let turn = path.measures(&std::array::from_fn(|i| after[i] - before[i]));
        let most = path.maximum(&turn);
        let wished = if most > 0.0 { 4.0 * blend / most } else { f64::INFINITY };
        path.through[k] = path.top[k - 1].min(path.top[k]);
        // A longer blend than the maximum rate needs would only take longer.
        let enough = turn.iter().zip(limits).fold(0.0, |most: f64, (turn, limit)| most.max(path.through[k].powi(2) * turn / (2.0 * limit.acceleration)));
        path.reach[k] = if *blend > 0.0 { wished.min(enough).min(long / 2.0).min(short / 2.0) } else { 0.0 };
        for (turn, limit) in turn.iter().zip(limits).filter(|(turn, _)| **turn > 0.0) {
            path.through[k] = path.through[k].min((2.0 * path.reach[k] * limit.acceleration / turn).sqrt());
        }
        if *blend == 0.0 {
            path.through[k] = 0.0;
        }
    }
}

/// Lowers the rates at the blends until each line is long enough for the change of rate: forward, then backward.
fn match_rates(path: &mut Path) {
    let last = path.points as usize - 1;
    let rest = |path: &Path, k: usize| (path.direction(k).1 - path.reach[k] - path.reach[k + 1]).max(0.0);
    for k in 0..last {
        let most = (path.through[k].powi(2) + 2.0 * path.slope[k] * rest(path, k)).sqrt();
        path.through[k + 1] = path.through[k + 1].min(most);
    }
    for k in (0..last).rev() {
        let most = (path.through[k + 1].powi(2) + 2.0 * path.slope[k] * rest(path, k)).sqrt();
        path.through[k] = path.through[k].min(most);
    }
}

impl Path {
    /// Returns the part of a vector that each limit sees: of a position its length, of each other coordinate the amount.
    pub fn measures(&self, vector: &[f64; JOINTS_MAX]) -> [f64; JOINTS_MAX] {
        let space = self.space as usize;
        let mut found = vector.map(f64::abs);
        if space > 0 {
            found[0] = vector[..space].iter().map(|x| x * x).sum::<f64>().sqrt();
            found[1..space].fill(0.0);
        }
        found
    }

    /// Returns the measure of a way-point's speed and blend: that of the position, or of the joint with the most.
    fn maximum(&self, measures: &[f64; JOINTS_MAX]) -> f64 {
        if self.space > 0 { measures[0] } else { measures.iter().fold(0.0, |most: f64, x| most.max(*x)) }
    }

    /// Returns the part of the path at a time within it.
    pub fn part(&self, time_s: f64) -> Part {
        let last = (self.points as usize).saturating_sub(1);
        if last == 0 || time_s >= self.duration {
            return Part::Line { after: last.saturating_sub(1), share: 1.0 };
        }
        let k = (1..last).rev().find(|k| self.begin[*k] <= time_s).unwrap_or(0);
        let line = self.line(k);
        let (t, on_line) = ((time_s - self.begin[k]).max(0.0), line.times.iter().sum::<f64>());
        if t <= on_line || k + 1 == last || self.reach[k + 1] <= 0.0 {
            let (way, ..) = line.at(t.min(on_line), self.slope[k]);
            return Part::Line { after: k, share: (self.reach[k] + way) / line.whole };
        }
        let share = (self.through[k + 1] * (t - on_line) / (2.0 * self.reach[k + 1])).min(1.0);
        Part::Blend { at: k + 1, share, before: 1.0 - self.reach[k + 1] / line.whole, behind: self.reach[k + 1] / self.direction(k + 1).1 }
    }

    /// The same path, `factor` times slower.
    pub fn slow_down(&mut self, factor: f64) {
        self.duration *= factor;
        self.begin.iter_mut().for_each(|t| *t *= factor);
        self.through.iter_mut().chain(&mut self.top).for_each(|rate| *rate /= factor);
        self.slope.iter_mut().for_each(|slope| *slope /= factor * factor);
    }

    /// The direction (of length 1) and the length of the line after way-point k.
    fn direction(&self, k: usize) -> ([f64; JOINTS_MAX], f64) {
        let n = self.joints as usize;
        let mut u = [0.0; JOINTS_MAX];
        for (i, u) in u.iter_mut().enumerate().take(n) {
            *u = self.q[k + 1][i] - self.q[k][i];
        }
        let length = u.iter().map(|x| x * x).sum::<f64>().sqrt();
        u.iter_mut().for_each(|x| *x /= length);
        (u, length)
    }

    fn line(&self, k: usize) -> Line {
        let (direction, whole) = self.direction(k);
        let rest = (whole - self.reach[k] - self.reach[k + 1]).max(0.0);
        let (first, last, slope) = (self.through[k], self.through[k + 1], self.slope[k]);
        let peak = (slope * rest + (first * first + last * last) / 2.0).sqrt().min(self.top[k]).max(first).max(last);
        let (up, down) = ((peak - first) / slope, (peak - last) / slope);
        let constant = (rest - (peak * peak - first * first) / (2.0 * slope) - (peak * peak - last * last) / (2.0 * slope)).max(0.0);
        let cruise = if peak > 0.0 { constant / peak } else { 0.0 };
        Line { direction, whole, rest, rates: [first, peak, last], times: [up, cruise, down] }
    }

    /// Position, velocity and acceleration of each joint at `time_s`: at rest at the start before it, exactly at the last way-point
    /// from the duration on.
    pub fn evaluate(&self, time_s: f64, position: &mut [f64], velocity: &mut [f64], acceleration: &mut [f64]) {
        let last = (self.points as usize).saturating_sub(1);
        velocity.fill(0.0);
        acceleration.fill(0.0);
        if time_s >= self.duration || time_s <= 0.0 {
            let k = if time_s >= self.duration { last } else { 0 };
            position.copy_from_slice(&self.q[k][..position.len()]);
            return;
        }
        let k = (1..last).rev().find(|k| self.begin[*k] <= time_s).unwrap_or(0);
        let line = self.line(k);
        let t = time_s - self.begin[k];
        let on_line: f64 = line.times.iter().sum();
        if t <= on_line || k + 1 == last || self.reach[k + 1] <= 0.0 {
            let (way, rate, change) = line.at(t.min(on_line), self.slope[k]);
            // The distance to the nearer end is the more exact one.
            let from_start = self.reach[k] + way;
            for i in 0..position.len() {
                let (u, near_start) = (line.direction[i], from_start <= line.whole / 2.0);
                position[i] = if near_start { self.q[k][i] + u * from_start } else { self.q[k + 1][i] - u * (line.whole - from_start) };
                (velocity[i], acceleration[i]) = (u * rate, u * change);
            }
            return;
        }
        self.blend(k + 1, &line.direction, t - on_line, position, velocity, acceleration);
    }

    /// On the blend of way-point k, `t` seconds after its beginning.
    fn blend(&self, k: usize, before: &[f64; JOINTS_MAX], t: f64, position: &mut [f64], velocity: &mut [f64], acceleration: &mut [f64]) {
        let (after, _) = self.direction(k);
        let (reach, rate) = (self.reach[k], self.through[k]);
        for i in 0..position.len() {
            let change = (after[i] - before[i]) * rate * rate / (2.0 * reach);
            position[i] = self.q[k][i] + before[i] * (rate * t - reach) + change * t * t / 2.0;
            velocity[i] = before[i] * rate + change * t;
            acceleration[i] = change;
        }
    }
}

impl Line {
    /// Distance since the line's first blend, rate and acceleration, `t` seconds after it.
    fn at(&self, t: f64, slope: f64) -> (f64, f64, f64) {
        let ([first, peak, last], [up, cruise, down]) = (self.rates, self.times);
        if t <= up {
            (first * t + slope * t * t / 2.0, first + slope * t, slope)
        } else if t <= up + cruise {
            ((first + peak) / 2.0 * up + peak * (t - up), peak, 0.0)
        } else {
            let left = up + cruise + down - t;
            (self.rest - last * left - slope * left * left / 2.0, last + slope * left, -slope)
        }
    }
}

#[cfg(test)]
pub mod samples {
    use super::*;

    /// Numbers from a small generator, so that every run checks the same cases.
    pub fn numbers(seed: u64) -> impl FnMut(f64, f64) -> f64 {
        let mut x = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        move |low, high| {
            x ^= x << 13;
            x ^= x >> 7;
            x ^= x << 17;
            low + (high - low) * ((x >> 11) as f64 / (1u64 << 53) as f64)
        }
    }

    /// A path of any kind: some stops, some near points, some doubled ones.
    pub struct Case {
        pub n: usize,
        pub start: Vec<f64>,
        pub points: Vec<[f64; JOINTS_MAX]>,
        pub passing: Vec<Passing>,
        pub limits: Vec<Limits>,
    }

    pub fn case(seed: u64) -> Case {
        let mut number = numbers(seed);
        let n = 1 + seed as usize % JOINTS_MAX;
        let count = 1 + seed as usize % 9;
        let start: Vec<f64> = (0..n).map(|_| number(-2.0, 2.0)).collect();
        let mut points: Vec<[f64; JOINTS_MAX]> = (0..count).map(|_| std::array::from_fn(|i| if i < n { number(-2.0, 2.0) } else { 0.0 })).collect();
        if seed.is_multiple_of(3) && count > 1 {
            points[count - 2] = points[count - 1];
        }
        if seed.is_multiple_of(5) {
            points[0][..n].copy_from_slice(&start);
        }
        let passing = (0..count).map(|k| Passing { blend: if k % 4 == 3 { 0.0 } else { number(0.0, 0.3) }, speed: number(0.1, 2.0) }).collect();
        let limits = (0..n).map(|_| Limits { speed: number(0.3, 3.0), acceleration: number(0.5, 10.0), jerk: 1.0 }).collect();
        Case { n, start, points, passing, limits }
    }
}

#[cfg(test)]
mod tests;
