// SPDX-License-Identifier: Apache-2.0
//! The efforts that give some joints the accelerations that are asked of them, whatever the others do: brakes (none) and decoupled servos.

/// Working memory for the equations of n degrees of freedom; nothing is allocated after `new`.
pub(super) struct Prescribed {
    /// Factor of the inertia among the free degrees of freedom, row-major n by n.
    factor: Vec<f64>,
    acceleration: Vec<f64>,
}

impl Prescribed {
    pub fn new(n: usize) -> Prescribed {
        Prescribed { factor: vec![0.0; n * n], acceleration: vec![0.0; n] }
    }

    /// Sets `effort[p]` of each prescribed degree of freedom to what gives it `wanted[p]`: M q'' = effort + drift with q''_p = wanted_p.
    ///
    /// `inertia`: M, row-major; `drift`: every force but the efforts. The free ones obey M_ff q''_f = effort_f + drift_f - M_fp q''_p, and
    /// effort_p = M_pf q''_f + M_pp q''_p - drift_p.
    pub fn efforts(&mut self, inertia: &[f64], drift: &[f64], prescribed: &[bool], wanted: &[f64], effort: &mut [f64]) {
        let n = drift.len();
        for i in 0..n {
            self.acceleration[i] = if prescribed[i] {
                wanted[i]
            } else {
                let borne: f64 = (0..n).filter(|p| prescribed[*p]).map(|p| inertia[i * n + p] * wanted[p]).sum();
                effort[i] + drift[i] - borne
            };
        }
        self.factorise(inertia, prescribed, n);
        self.solve(prescribed, n);
        for p in (0..n).filter(|i| prescribed[*i]) {
            effort[p] = (0..n).map(|k| inertia[p * n + k] * self.acceleration[k]).sum::<f64>() - drift[p];
        }
    }

    /// Takes the inertia M of the degrees of freedom that are not left out, for [`Prescribed::accelerations`].
    pub fn take(&mut self, inertia: &[f64], left_out: &[bool]) {
        self.factorise(inertia, left_out, left_out.len());
    }

    /// The accelerations M^-1 `effort` by the inertia that was taken; those that were left out have none.
    pub fn accelerations(&mut self, left_out: &[bool], effort: &[f64]) -> &[f64] {
        for (i, is_left_out) in left_out.iter().enumerate() {
            self.acceleration[i] = if *is_left_out { 0.0 } else { effort[i] };
        }
        self.solve(left_out, left_out.len());
        &self.acceleration
    }

    /// Cholesky: M_ff = L L'. A row of a prescribed degree of freedom is left out.
    fn factorise(&mut self, inertia: &[f64], prescribed: &[bool], n: usize) {
        for i in (0..n).filter(|i| !prescribed[*i]) {
            for j in (0..=i).filter(|j| !prescribed[*j]) {
                let inner: f64 = (0..j).filter(|k| !prescribed[*k]).map(|k| self.factor[i * n + k] * self.factor[j * n + k]).sum();
                let rest = inertia[i * n + j] - inner;
                self.factor[i * n + j] = if i == j { rest.sqrt() } else { rest / self.factor[j * n + j] };
            }
        }
    }

    /// Solves L L' x = acceleration in place.
    fn solve(&mut self, prescribed: &[bool], n: usize) {
        for i in (0..n).filter(|i| !prescribed[*i]) {
            let inner: f64 = (0..i).filter(|k| !prescribed[*k]).map(|k| self.factor[i * n + k] * self.acceleration[k]).sum();
            self.acceleration[i] = (self.acceleration[i] - inner) / self.factor[i * n + i];
        }
        for i in (0..n).rev().filter(|i| !prescribed[*i]) {
            let inner: f64 = (i + 1..n).filter(|k| !prescribed[*k]).map(|k| self.factor[k * n + i] * self.acceleration[k]).sum();
            self.acceleration[i] = (self.acceleration[i] - inner) / self.factor[i * n + i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const INERTIA: [f64; 9] = [3.0, 1.0, 0.5, 1.0, 2.0, 0.3, 0.5, 0.3, 1.0];
    const DRIFT: [f64; 3] = [-4.0, 2.0, 0.5];

    #[test]
    fn a_braked_joint_has_no_acceleration_and_the_free_one_obeys_newton() {
        let mut effort = [1.5, 0.0, -0.25];
        Prescribed::new(3).efforts(&INERTIA, &DRIFT, &[false, true, false], &[0.0; 3], &mut effort);
        // The free pair by Cramer's rule.
        let (f0, f2) = (1.5 - 4.0, -0.25 + 0.5);
        let d = 3.0 * 1.0 - 0.5 * 0.5;
        let (a0, a2) = ((f0 * 1.0 - 0.5 * f2) / d, (3.0 * f2 - 0.5 * f0) / d);
        assert!((effort[1] - (1.0 * a0 + 0.3 * a2 - 2.0)).abs() < 1e-12, "{effort:?}");
        assert_eq!((effort[0], effort[2]), (1.5, -0.25), "a free joint keeps its effort");
    }

    #[test]
    fn with_every_joint_braked_the_brakes_carry_the_drift() {
        let mut effort = [9.0, 9.0];
        Prescribed::new(2).efforts(&[2.0, 0.1, 0.1, 1.0], &[3.0, -1.0], &[true, true], &[0.0; 2], &mut effort);
        assert_eq!(effort, [-3.0, 1.0]);
    }

    #[test]
    fn the_efforts_give_what_was_wanted() {
        let (wanted, mut effort) = ([2.0, 0.0, -3.0], [0.0, 1.25, 0.0]);
        Prescribed::new(3).efforts(&INERTIA, &DRIFT, &[true, false, true], &wanted, &mut effort);
        // Of the free one: 1 q0'' + 2 q1'' + 0.3 q2'' = 1.25 + 2.
        let free = (1.25 + 2.0 - 2.0 + 0.9) / 2.0;
        let all = [2.0, free, -3.0];
        for i in 0..3 {
            let moved: f64 = (0..3).map(|k| INERTIA[3 * i + k] * all[k]).sum();
            assert!((moved - effort[i] - DRIFT[i]).abs() < 1e-12, "row {i} of {effort:?}");
        }
    }
}
