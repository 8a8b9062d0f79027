// SPDX-License-Identifier: Apache-2.0
//! Spans of a path: the joints as fifth-degree polynomials of the path coordinate, in Bézier form.
//!
//! The control points of a polynomial bound it, and their differences bound its derivatives, so the limits derived from them hold
//! everywhere, not only at samples (Farin, *Curves and Surfaces for CAGD*, 2002, chapter 5).
use crate::profile::JOINTS_MAX;
use opengpac::Type;

/// Number of control points.
const POINTS: usize = 6;

/// Positions of all joints, or their derivatives with respect to the path coordinate.
pub type Joints = [f64; JOINTS_MAX];

/// A span of the path: its control points and its length.
#[derive(Clone, Copy, Debug, PartialEq, Type)]
#[repr(C)]
pub struct Span {
    /// Control points of each joint, rad or m.
    pub points: [[f64; POINTS]; JOINTS_MAX],
    /// Length in the path coordinate.
    pub length: f64,
}

/// A place on the path: the joint positions, and their first and second derivatives with respect to the path coordinate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Place {
    pub q: Joints,
    pub first: Joints,
    pub second: Joints,
}

/// Bounds of the first, second and third derivatives of each joint with respect to the path coordinate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bounds {
    pub of: [[f64; 3]; JOINTS_MAX],
}

impl Bounds {
    /// Extends the bounds to include those of another part of the path.
    pub fn include(&mut self, other: &Bounds) {
        for (mine, theirs) in self.of.iter_mut().zip(&other.of) {
            for (mine, theirs) in mine.iter_mut().zip(theirs) {
                *mine = mine.max(*theirs);
            }
        }
    }

    /// Returns the bounds for a path coordinate in a different unit; one old unit is `scale` new ones.
    pub fn scaled(mut self, scale: f64) -> Bounds {
        for of in &mut self.of {
            *of = [of[0] / scale, of[1] / (scale * scale), of[2] / (scale * scale * scale)];
        }
        self
    }
}

impl Span {
    /// Returns the straight line in joint space between two positions.
    pub fn straight(from: &Joints, to: &Joints, length: f64) -> Span {
        let mut span = <Span as Type>::zero();
        for (points, (from, to)) in span.points.iter_mut().zip(from.iter().zip(to)) {
            for (k, point) in points.iter_mut().enumerate() {
                *point = from + (to - from) * (k as f64 / (POINTS - 1) as f64);
            }
            points[POINTS - 1] = *to;
        }
        span.length = length;
        span
    }

    /// Returns the polynomial with these places at its ends.
    pub fn between(from: &Place, to: &Place, length: f64) -> Span {
        let mut span = <Span as Type>::zero();
        let (step, bend) = (length / 5.0, length * length / 20.0);
        for (i, points) in span.points.iter_mut().enumerate() {
            let (p, v, a) = (from.q[i], from.first[i], from.second[i]);
            let (q, w, b) = (to.q[i], to.first[i], to.second[i]);
            *points = [p, p + step * v, p + 2.0 * step * v + bend * a, q - 2.0 * step * w + bend * b, q - step * w, q];
        }
        span.length = length;
        span
    }

    /// Returns the place of the first `n` joints at `s` from the start of the span; at or beyond an end, exactly the place of that end.
    pub fn at(&self, s: f64, n: usize) -> Place {
        let u = (s / self.length).clamp(0.0, 1.0);
        let w = 1.0 - u;
        let (per, per_square) = (5.0 / self.length, 20.0 / (self.length * self.length));
        let [u2, w2] = [u * u, w * w];
        let quintic = [w2 * w2 * w, 5.0 * u * w2 * w2, 10.0 * u2 * w2 * w, 10.0 * u2 * u * w2, 5.0 * u2 * u2 * w, u2 * u2 * u];
        let quartic = [w2 * w2, 4.0 * u * w2 * w, 6.0 * u2 * w2, 4.0 * u2 * u * w, u2 * u2];
        let cubic = [w2 * w, 3.0 * u * w2, 3.0 * u2 * w, u2 * u];
        let mut place = Place::default();
        for (i, p) in self.points.iter().enumerate().take(n) {
            place.q[i] = quintic.iter().zip(p).map(|(b, p)| b * p).sum();
            place.first[i] = per * (0..5).map(|k| quartic[k] * (p[k + 1] - p[k])).sum::<f64>();
            place.second[i] = per_square * (0..4).map(|k| cubic[k] * (p[k + 2] - 2.0 * p[k + 1] + p[k])).sum::<f64>();
        }
        place
    }

    /// Divides the span at `s` from its start (de Casteljau's construction).
    pub fn divided(&self, s: f64) -> [Span; 2] {
        let u = (s / self.length).clamp(0.0, 1.0);
        let [mut left, mut right] = [*self; 2];
        (left.length, right.length) = (s, self.length - s);
        for (i, points) in self.points.iter().enumerate() {
            let mut row = *points;
            for k in 0..POINTS {
                left.points[i][k] = row[0];
                right.points[i][POINTS - 1 - k] = row[POINTS - 1 - k];
                for j in 0..POINTS - 1 - k {
                    row[j] += (row[j + 1] - row[j]) * u;
                }
            }
        }
        [left, right]
    }

    /// Returns bounds of the derivatives, from the control points of the two halves.
    pub fn bounds(&self) -> Bounds {
        let mut bounds = Bounds::default();
        for half in self.divided(self.length / 2.0) {
            bounds.include(&half.rough_bounds());
        }
        bounds
    }

    fn rough_bounds(&self) -> Bounds {
        let l = self.length;
        let mut bounds = Bounds::default();
        for (of, p) in bounds.of.iter_mut().zip(&self.points) {
            for k in 0..5 {
                of[0] = of[0].max((p[k + 1] - p[k]).abs());
            }
            for k in 0..4 {
                of[1] = of[1].max((p[k + 2] - 2.0 * p[k + 1] + p[k]).abs());
            }
            for k in 0..3 {
                of[2] = of[2].max((p[k + 3] - 3.0 * (p[k + 2] - p[k + 1]) - p[k]).abs());
            }
            *of = [of[0] * 5.0 / l, of[1] * 20.0 / (l * l), of[2] * 60.0 / (l * l * l)];
        }
        bounds
    }

    /// Returns the minimum and maximum of the control points of a joint, which bound its positions.
    pub fn range(&self, joint: usize) -> (f64, f64) {
        self.points[joint].iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::samples::numbers;

    fn random(seed: u64) -> Span {
        let mut number = numbers(seed);
        let mut span = <Span as Type>::zero();
        span.points.iter_mut().flatten().for_each(|p| *p = number(-2.0, 2.0));
        span.length = number(0.1, 3.0);
        span
    }

    #[test]
    fn derivatives_are_the_slopes_and_bounds_hold() {
        for seed in 1..100 {
            let span = random(seed);
            let (bounds, h) = (span.bounds(), 1e-5 * span.length);
            for k in 1..100 {
                let s = span.length * f64::from(k) / 100.0;
                let [before, now, after] = [s - h, s, s + h].map(|s| span.at(s, JOINTS_MAX));
                for i in 0..JOINTS_MAX {
                    assert!(((after.q[i] - before.q[i]) / (2.0 * h) - now.first[i]).abs() < 1e-5 * (1.0 + now.first[i].abs() / span.length));
                    assert!(((after.first[i] - before.first[i]) / (2.0 * h) - now.second[i]).abs() < 1e-3 * (1.0 + bounds.of[i][1]));
                    let third = (after.second[i] - before.second[i]) / (2.0 * h);
                    for (value, bound) in [now.first[i], now.second[i], third].iter().zip(bounds.of[i]) {
                        assert!(value.abs() <= bound * (1.0 + 1e-6), "seed {seed}, joint {i}: {value} of {bound}");
                    }
                }
            }
        }
    }

    #[test]
    fn parts_of_a_span_are_the_span() {
        for seed in 1..100 {
            let span = random(seed);
            let cut = span.length * 0.3;
            let [left, right] = span.divided(cut);
            for k in 0..=20 {
                let s = span.length * f64::from(k) / 20.0;
                let (whole, part) = (span.at(s, JOINTS_MAX), if s < cut { left.at(s, JOINTS_MAX) } else { right.at(s - cut, JOINTS_MAX) });
                assert!((0..JOINTS_MAX).all(|i| (whole.q[i] - part.q[i]).abs() < 1e-13 && (whole.second[i] - part.second[i]).abs() < 1e-7));
            }
        }
    }

    #[test]
    fn a_span_has_the_places_at_its_ends() {
        let (whole, length) = (random(3), 0.7);
        let (from, to) = (whole.at(0.0, JOINTS_MAX), whole.at(whole.length, JOINTS_MAX));
        let span = Span::between(&from, &to, length);
        for (place, found) in [(from, span.at(0.0, JOINTS_MAX)), (to, span.at(length, JOINTS_MAX))] {
            assert_eq!(place.q, found.q);
            assert!((0..JOINTS_MAX).all(|i| (place.first[i] - found.first[i]).abs() < 1e-9 && (place.second[i] - found.second[i]).abs() < 1e-8 * (1.0 + place.second[i].abs())));
        }
    }
}
