// SPDX-License-Identifier: Apache-2.0
//! Position, velocity and acceleration of a planned path at a given time.
use crate::profile::JOINTS_MAX;

/// A planned path of any length, with the field names of [`Path`](super::Path).
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    pub plan: f64,
    pub joints: usize,
    pub points: usize,
    pub space: usize,
    pub duration: f64,
    pub q: &'a [[f64; JOINTS_MAX]],
    pub reach: &'a [f64],
    pub through: &'a [f64],
    pub top: &'a [f64],
    pub slope: &'a [f64],
    pub begin: &'a [f64],
}

/// A part of a path, and its completed fraction, 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Part {
    /// On the line after a way-point; `share` is the fraction of the whole line, including blends.
    Line { after: usize, share: f64 },
    /// In the blend of a way-point, which begins at the fraction `before` of the previous line and ends at `behind` of the next one.
    Blend { at: usize, share: f64, before: f64, behind: f64 },
}

/// Straight part of a path between two way-points, and its time law.
pub(super) struct Line {
    pub(super) direction: [f64; JOINTS_MAX],
    /// Length of the whole line, and of the part between its blends.
    whole: f64,
    rest: f64,
    /// Initial, maximum and final rate, and the durations of speeding up, constant rate and slowing down.
    rates: [f64; 3],
    pub(super) times: [f64; 3],
}

impl View<'_> {
    /// Returns the magnitudes of a vector to which the limits apply: the length of the position, and the absolute values of the other
    /// coordinates.
    pub fn measures(&self, vector: &[f64; JOINTS_MAX]) -> [f64; JOINTS_MAX] {
        let mut found = vector.map(f64::abs);
        if self.space > 0 {
            found[0] = vector[..self.space].iter().map(|x| x * x).sum::<f64>().sqrt();
            found[1..self.space].fill(0.0);
        }
        found
    }

    /// Returns the magnitude to which a way-point's speed and blend apply: that of the position, or the maximum over the joints.
    pub(super) fn maximum(&self, measures: &[f64; JOINTS_MAX]) -> f64 {
        if self.space > 0 { measures[0] } else { measures.iter().fold(0.0, |most: f64, x| most.max(*x)) }
    }

    /// Returns the way-point before the position at a time, which is on the line after it or in the blend at the end of that line.
    fn after(&self, time_s: f64) -> usize {
        // The times never decrease.
        self.begin[1..self.points.saturating_sub(1).max(1)].partition_point(|begin| *begin <= time_s)
    }

    /// Returns the part of the path at a given time within its duration.
    pub fn part(&self, time_s: f64) -> Part {
        let last = self.points.saturating_sub(1);
        if last == 0 || time_s >= self.duration {
            return Part::Line { after: last.saturating_sub(1), share: 1.0 };
        }
        let k = self.after(time_s);
        let line = self.line(k);
        let (t, on_line) = ((time_s - self.begin[k]).max(0.0), line.times.iter().sum::<f64>());
        if t <= on_line || k + 1 == last || self.reach[k + 1] <= 0.0 {
            let (way, ..) = line.at(t.min(on_line), self.slope[k]);
            return Part::Line { after: k, share: (self.reach[k] + way) / line.whole };
        }
        let share = (self.through[k + 1] * (t - on_line) / (2.0 * self.reach[k + 1])).min(1.0);
        Part::Blend { at: k + 1, share, before: 1.0 - self.reach[k + 1] / line.whole, behind: self.reach[k + 1] / self.direction(k + 1).1 }
    }

    /// Returns the unit vector and the length of the line after way-point k.
    pub(super) fn direction(&self, k: usize) -> ([f64; JOINTS_MAX], f64) {
        let mut u = [0.0; JOINTS_MAX];
        for (i, u) in u.iter_mut().enumerate().take(self.joints) {
            *u = self.q[k + 1][i] - self.q[k][i];
        }
        let length = u.iter().map(|x| x * x).sum::<f64>().sqrt();
        u.iter_mut().for_each(|x| *x /= length);
        (u, length)
    }

    pub(super) fn line(&self, k: usize) -> Line {
        let (direction, whole) = self.direction(k);
        let rest = (whole - self.reach[k] - self.reach[k + 1]).max(0.0);
        let (first, last, slope) = (self.through[k], self.through[k + 1], self.slope[k]);
        let peak = (slope * rest + (first * first + last * last) / 2.0).sqrt().min(self.top[k]).max(first).max(last);
        let (up, down) = ((peak - first) / slope, (peak - last) / slope);
        let constant = (rest - (peak * peak - first * first) / (2.0 * slope) - (peak * peak - last * last) / (2.0 * slope)).max(0.0);
        let cruise = if peak > 0.0 { constant / peak } else { 0.0 };
        Line { direction, whole, rest, rates: [first, peak, last], times: [up, cruise, down] }
    }

    /// Computes the position, velocity and acceleration of each joint at `time_s`. Before time 0, the joints are at rest at the start;
    /// after the duration has elapsed, they are exactly at the last way-point.
    pub fn evaluate(&self, time_s: f64, position: &mut [f64], velocity: &mut [f64], acceleration: &mut [f64]) {
        let last = self.points.saturating_sub(1);
        velocity.fill(0.0);
        acceleration.fill(0.0);
        if time_s >= self.duration || time_s <= 0.0 {
            let k = if time_s >= self.duration { last } else { 0 };
            position.copy_from_slice(&self.q[k][..position.len()]);
            return;
        }
        let k = self.after(time_s);
        let line = self.line(k);
        let t = time_s - self.begin[k];
        let on_line: f64 = line.times.iter().sum();
        if t <= on_line || k + 1 == last || self.reach[k + 1] <= 0.0 {
            let (way, rate, change) = line.at(t.min(on_line), self.slope[k]);
            // The distance to the nearer end is more accurate.
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

    /// Evaluates the blend of way-point k, `t` seconds after its start.
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
    /// Returns the distance since the line's first blend, the rate and the acceleration, `t` seconds after that blend.
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
