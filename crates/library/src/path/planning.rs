// SPDX-License-Identifier: Apache-2.0
//! Planning of paths: adds way-points one by one, then makes several passes over them, in portions that fit into an invocation.
use super::view::View;
use super::{BEING_PLANNED, Passing, SAME};
use crate::profile::{JOINTS_MAX, Limits};

/// A path of any length while it is being planned, with the field names of [`Path`](super::Path).
pub struct Table<'a> {
    pub plan: &'a mut f64,
    pub joints: &'a mut i32,
    pub points: &'a mut i32,
    pub space: &'a mut i32,
    pub duration: &'a mut f64,
    pub q: &'a mut [[f64; JOINTS_MAX]],
    pub reach: &'a mut [f64],
    pub through: &'a mut [f64],
    pub top: &'a mut [f64],
    pub slope: &'a mut [f64],
    pub begin: &'a mut [f64],
}

/// Fractions of a line that the blend at one of its ends may use; the one that gives the shorter motion is chosen. If blends use up a
/// whole line, the rate cannot rise along it. This suits a few way-points, which are usually far apart, so that the limits of the joints
/// are reached sooner; but a path with many close way-points would creep.
pub const BLEND_SHARES: &[f64] = &[0.5, 0.25];
/// Fraction of a line that a blend of a long path may use, because its way-points are close together.
pub const LONG_BLEND_SHARES: &[f64] = &[0.25];

/// Progress of planning a path. The default is idle.
#[derive(Clone, Copy, Debug, Default)]
pub struct Planning {
    pass: Pass,
    /// Fraction of a line that one blend may use.
    share: f64,
    /// Fraction of a line to try next.
    other: Option<f64>,
    /// Fraction that has been tried, and the resulting duration, s.
    tried: Option<(f64, f64)>,
    /// Partial sum of the duration with the current fraction, s.
    sum_s: f64,
    /// Number of steps completed in this pass.
    at: usize,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Pass {
    #[default]
    None,
    /// Computes the maximum rate and acceleration of each line.
    Lines,
    /// Computes the reach of each blend, and the maximum rate that the joints' accelerations allow there.
    Corners,
    /// Reduces the rates at the blends until each line is long enough to speed up.
    Forward,
    /// Reduces the rates at the blends until each line is long enough to slow down.
    Backward,
    /// Sums up the duration, if the other fraction of the lines is also tried.
    Sum,
    /// Computes the start time of each line.
    Times,
}

impl Planning {
    /// Begins a path from `start`. The first `space` coordinates form a position: its speed, acceleration and blend are those of the
    /// point as a whole, and its limits are the first ones. One blend uses at most a fraction of a line, the better one of up to two
    /// `shares`. The way-points are added next; then [`advance`](Planning::advance) plans the path.
    pub fn begin(table: &mut Table, space: usize, start: &[f64], shares: &[f64]) -> Planning {
        (*table.plan, *table.joints, *table.points, *table.space) = (BEING_PLANNED, start.len() as i32, 1, space as i32);
        table.q[0][..start.len()].copy_from_slice(start);
        (table.reach[0], table.through[0], table.begin[0]) = (0.0, 0.0, 0.0);
        Planning { pass: Pass::Lines, share: shares[0], other: shares.get(1).copied(), ..Planning::default() }
    }

    /// Returns true if a path has been begun but is not ready yet.
    pub fn is_under_way(&self) -> bool {
        self.pass != Pass::None
    }

    /// Continues planning by at most `budget` way-point steps, and decrements `budget` accordingly. Returns true if the path is ready
    /// except for its number. `limits` has one element per coordinate, all above 0; their jerk is not used, because the acceleration is
    /// constant in each part.
    pub fn advance(&mut self, table: &mut Table, limits: &[Limits], budget: &mut usize) -> bool {
        let last = *table.points as usize - 1;
        while self.pass != Pass::None {
            let steps = if self.pass == Pass::Corners { last.saturating_sub(1) } else { last };
            let end = steps.min(self.at.saturating_add(*budget));
            for k in self.at..end {
                match self.pass {
                    Pass::Lines => table.limit_line(k, limits),
                    Pass::Corners => table.cut_corner(k + 1, self.share, limits),
                    Pass::Forward => table.speed_up(k),
                    Pass::Backward => table.slow_down(last - 1 - k),
                    Pass::Sum => self.sum_s += table.passing_s(k),
                    _ => table.time(k),
                }
            }
            *budget -= end - self.at;
            self.at = end;
            if end < steps {
                return false;
            }
            if self.pass == Pass::Corners {
                (table.reach[last], table.through[last]) = (0.0, 0.0);
            }
            self.at = 0;
            self.pass = self.next();
        }
        *table.duration = table.begin[last];
        true
    }
}

impl Planning {
    fn next(&mut self) -> Pass {
        match self.pass {
            Pass::Lines => Pass::Corners,
            Pass::Corners => Pass::Forward,
            Pass::Forward => Pass::Backward,
            Pass::Backward if self.other.is_some() || self.tried.is_some() => Pass::Sum,
            Pass::Sum => self.chosen(),
            Pass::Backward => Pass::Times,
            Pass::Times | Pass::None => Pass::None,
        }
    }

    /// Continues with the other fraction of a line, or returns to the first one if it gave a shorter motion.
    fn chosen(&mut self) -> Pass {
        let duration_s = std::mem::take(&mut self.sum_s);
        if let Some(other) = self.other.take() {
            self.tried = Some((self.share, duration_s));
            self.share = other;
            return Pass::Corners;
        }
        match self.tried.take() {
            Some((share, shorter_s)) if shorter_s <= duration_s => {
                self.share = share;
                Pass::Corners
            }
            _ => Pass::Times,
        }
    }
}

impl Table<'_> {
    /// Adds a way-point; ignores it if it coincides with the previous one. The caller must have checked that the table has space for it.
    pub fn add(&mut self, point: &[f64], passing: Passing) {
        let (n, last) = (*self.joints as usize, *self.points as usize - 1);
        if (0..n).all(|i| (point[i] - self.q[last][i]).abs() <= SAME) {
            return;
        }
        self.q[last + 1][..n].copy_from_slice(&point[..n]);
        // The passes below replace these two values by their results: the value of the last way-point by that of the blend.
        (self.begin[last + 1], self.top[last]) = (passing.blend, passing.speed);
        *self.points += 1;
    }

    /// Returns a view for reading the path.
    pub fn view(&self) -> View<'_> {
        View {
            plan: *self.plan,
            joints: *self.joints as usize,
            points: *self.points as usize,
            space: *self.space as usize,
            duration: *self.duration,
            q: self.q,
            reach: self.reach,
            through: self.through,
            top: self.top,
            slope: self.slope,
            begin: self.begin,
        }
    }

    fn limit_line(&mut self, k: usize, limits: &[Limits]) {
        let view = self.view();
        let u = view.measures(&view.direction(k).0);
        let (mut top, mut slope) = (view.top[k] / view.maximum(&u), f64::INFINITY);
        for (u, limit) in u.iter().zip(limits).filter(|(u, _)| **u > 0.0) {
            top = top.min(limit.speed / u);
            slope = slope.min(limit.acceleration / u);
        }
        (self.top[k], self.slope[k]) = (top, slope);
    }

    fn cut_corner(&mut self, k: usize, share: f64, limits: &[Limits]) {
        let view = self.view();
        let blend = view.begin[k];
        let ((before, long), (after, short)) = (view.direction(k - 1), view.direction(k));
        let turn = view.measures(&std::array::from_fn(|i| after[i] - before[i]));
        let most = view.maximum(&turn);
        let wished = if most > 0.0 { 4.0 * blend / most } else { f64::INFINITY };
        let mut through = view.top[k - 1].min(view.top[k]);
        // A longer blend than the maximum rate needs would only slow the motion down.
        let enough = turn.iter().zip(limits).fold(0.0, |most: f64, (turn, limit)| most.max(through.powi(2) * turn / (2.0 * limit.acceleration)));
        let reach = if blend > 0.0 { wished.min(enough).min(long * share).min(short * share) } else { 0.0 };
        for (turn, limit) in turn.iter().zip(limits).filter(|(turn, _)| **turn > 0.0) {
            through = through.min((2.0 * reach * limit.acceleration / turn).sqrt());
        }
        (self.reach[k], self.through[k]) = (reach, if blend == 0.0 { 0.0 } else { through });
    }

    /// Returns the maximum rate at the other end of the line after way-point k, for the rate at one end.
    fn reachable(&self, k: usize, rate: f64) -> f64 {
        let rest = (self.view().direction(k).1 - self.reach[k] - self.reach[k + 1]).max(0.0);
        (rate.powi(2) + 2.0 * self.slope[k] * rest).sqrt()
    }

    fn speed_up(&mut self, k: usize) {
        self.through[k + 1] = self.through[k + 1].min(self.reachable(k, self.through[k]));
    }

    fn slow_down(&mut self, k: usize) {
        self.through[k] = self.through[k].min(self.reachable(k, self.through[k + 1]));
    }

    fn time(&mut self, k: usize) {
        let blend_s = self.blend_s(k);
        self.begin[k + 1] = self.begin[k] + self.view().line(k).times.iter().sum::<f64>() + blend_s;
    }

    /// Returns the duration from the line after way-point k to the next line, s.
    fn passing_s(&self, k: usize) -> f64 {
        self.view().line(k).times.iter().sum::<f64>() + self.blend_s(k)
    }

    fn blend_s(&self, k: usize) -> f64 {
        if self.reach[k + 1] > 0.0 { 2.0 * self.reach[k + 1] / self.through[k + 1] } else { 0.0 }
    }

    /// Slows the path down by `factor`.
    pub fn stretch(&mut self, factor: f64) {
        let points = *self.points as usize;
        *self.duration *= factor;
        self.begin[..points].iter_mut().for_each(|t| *t *= factor);
        self.through[..points].iter_mut().chain(&mut self.top[..points]).for_each(|rate| *rate /= factor);
        self.slope[..points].iter_mut().for_each(|slope| *slope /= factor * factor);
    }
}
