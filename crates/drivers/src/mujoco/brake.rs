// SPDX-License-Identifier: Apache-2.0
//! Spring-applied brakes: a joint that nobody commands does not move, and carries what the joints that move do to it.

/// Room for the equations of n degrees of freedom; nothing is allocated after `new`.
pub(super) struct Brakes {
    /// Factor of the inertia among the free degrees of freedom, row-major n by n.
    factor: Vec<f64>,
    acceleration: Vec<f64>,
}

impl Brakes {
    pub fn new(n: usize) -> Brakes {
        Brakes { factor: vec![0.0; n * n], acceleration: vec![0.0; n] }
    }

    /// Sets `effort[b]` of each braked degree of freedom to what keeps it at rest: M q'' = effort + drift with q''_b = 0.
    ///
    /// `inertia`: M, row-major; `drift`: every force but the efforts. The braked ones have q''_b = 0, so the free ones obey
    /// M_ff q''_f = effort_f + drift_f, and effort_b = M_bf q''_f - drift_b.
    pub fn hold(&mut self, inertia: &[f64], drift: &[f64], braked: &[bool], effort: &mut [f64]) {
        let n = drift.len();
        for i in 0..n {
            self.acceleration[i] = if braked[i] { 0.0 } else { effort[i] + drift[i] };
        }
        self.factorise(inertia, braked, n);
        self.solve(braked, n);
        for b in (0..n).filter(|i| braked[*i]) {
            effort[b] = (0..n).map(|f| inertia[b * n + f] * self.acceleration[f]).sum::<f64>() - drift[b];
        }
    }

    /// Cholesky: M_ff = L L'. A row of a braked degree of freedom is left out.
    fn factorise(&mut self, inertia: &[f64], braked: &[bool], n: usize) {
        for i in (0..n).filter(|i| !braked[*i]) {
            for j in (0..=i).filter(|j| !braked[*j]) {
                let inner: f64 = (0..j).filter(|k| !braked[*k]).map(|k| self.factor[i * n + k] * self.factor[j * n + k]).sum();
                let rest = inertia[i * n + j] - inner;
                self.factor[i * n + j] = if i == j { rest.sqrt() } else { rest / self.factor[j * n + j] };
            }
        }
    }

    /// Solves L L' x = acceleration in place.
    fn solve(&mut self, braked: &[bool], n: usize) {
        for i in (0..n).filter(|i| !braked[*i]) {
            let inner: f64 = (0..i).filter(|k| !braked[*k]).map(|k| self.factor[i * n + k] * self.acceleration[k]).sum();
            self.acceleration[i] = (self.acceleration[i] - inner) / self.factor[i * n + i];
        }
        for i in (0..n).rev().filter(|i| !braked[*i]) {
            let inner: f64 = (i + 1..n).filter(|k| !braked[*k]).map(|k| self.factor[k * n + i] * self.acceleration[k]).sum();
            self.acceleration[i] = (self.acceleration[i] - inner) / self.factor[i * n + i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_braked_joint_has_no_acceleration_and_the_free_one_obeys_newton() {
        let inertia = [3.0, 1.0, 0.5, 1.0, 2.0, 0.3, 0.5, 0.3, 1.0];
        let drift = [-4.0, 2.0, 0.5];
        let mut effort = [1.5, 0.0, -0.25];
        Brakes::new(3).hold(&inertia, &drift, &[false, true, false], &mut effort);
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
        Brakes::new(2).hold(&[2.0, 0.1, 0.1, 1.0], &[3.0, -1.0], &[true, true], &mut effort);
        assert_eq!(effort, [-3.0, 1.0]);
    }
}
