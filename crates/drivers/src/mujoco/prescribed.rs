// SPDX-License-Identifier: Apache-2.0
//! Computes the efforts that give some joints prescribed accelerations, whatever the others do: zero for brakes, and the requested
//! acceleration for decoupled servos.
//!
//! Dry friction of the others is a force between -f and f that brings the joint to rest at the end of the time step, if it can: s =
//! clamp(-v+ / (h A), ±f), with the velocity v+ = v + h q'' at the end of a step h. The frictions are coupled by A = M_ff^-1, so they are
//! solved for by projected Gauss-Seidel (E. Catto, Iterative Dynamics with Temporal Coherence, 2005), which converges because A is
//! positive definite.

/// Maximum number of iterations over all frictions of a time step; also the change of a force, relative to its limit, at which they end.
const ROUNDS_MAX: usize = 64;
const TOLERANCE: f64 = 1e-9;

/// Equations of motion in one time step: M q'' = effort + drift + friction.
pub(super) struct Equations<'a> {
    /// M, row-major.
    pub inertia: &'a [f64],
    /// All forces except efforts and dry friction.
    pub drift: &'a [f64],
    /// Limit of the dry friction of each degree of freedom; 0 if it has none.
    pub friction: &'a [f64],
    pub velocity: &'a [f64],
    pub step_s: f64,
}

/// Scratch buffers for the equations of n degrees of freedom; nothing is allocated after `new`.
pub(super) struct PrescribedSolver {
    /// Cholesky factor of the inertia of the free degrees of freedom, row-major n by n.
    factor: Vec<f64>,
    acceleration: Vec<f64>,
    /// Rows of M_ff^-1 for the degrees of freedom with friction.
    response: Vec<f64>,
    /// Scratch buffer for one row of `response`.
    column: Vec<f64>,
}

impl PrescribedSolver {
    pub fn new(n: usize) -> PrescribedSolver {
        PrescribedSolver { factor: vec![0.0; n * n], acceleration: vec![0.0; n], response: vec![0.0; n * n], column: vec![0.0; n] }
    }

    /// Sets `effort[p]` of each prescribed degree of freedom to the effort that gives it the acceleration `wanted[p]`, and `rubbing[i]`
    /// of every other degree of freedom to its friction.
    ///
    /// The free ones obey M_ff q''_f = effort_f + drift_f + rubbing_f - M_fp q''_p, and effort_p = M_pf q''_f + M_pp q''_p - drift_p.
    pub fn efforts(&mut self, of: &Equations, prescribed: &[bool], wanted: &[f64], effort: &mut [f64], rubbing: &mut [f64]) {
        let n = of.drift.len();
        for i in 0..n {
            self.acceleration[i] = if prescribed[i] {
                wanted[i]
            } else {
                let borne: f64 = (0..n).filter(|p| prescribed[*p]).map(|p| of.inertia[i * n + p] * wanted[p]).sum();
                effort[i] + of.drift[i] - borne
            };
        }
        self.factorise(of.inertia, prescribed, n);
        solve(&self.factor, &mut self.acceleration, prescribed);
        if (0..n).any(|i| !prescribed[i] && of.friction[i] > 0.0) {
            self.rub(of, prescribed, rubbing);
        }
        for p in (0..n).filter(|i| prescribed[*i]) {
            effort[p] = (0..n).map(|k| of.inertia[p * n + k] * self.acceleration[k]).sum::<f64>() - of.drift[p];
        }
    }

    /// Factorises the inertia M of the degrees of freedom that are not excluded, for [`PrescribedSolver::accelerations`].
    pub fn take(&mut self, inertia: &[f64], left_out: &[bool]) {
        self.factorise(inertia, left_out, left_out.len());
    }

    /// Returns the accelerations M^-1 `effort` for the factorised inertia; 0 for excluded degrees of freedom.
    pub fn accelerations(&mut self, left_out: &[bool], effort: &[f64]) -> &[f64] {
        for (i, is_left_out) in left_out.iter().enumerate() {
            self.acceleration[i] = if *is_left_out { 0.0 } else { effort[i] };
        }
        solve(&self.factor, &mut self.acceleration, left_out);
        &self.acceleration
    }

    /// Computes the friction of the free degrees of freedom, and updates their accelerations.
    fn rub(&mut self, of: &Equations, prescribed: &[bool], rubbing: &mut [f64]) {
        let n = of.drift.len();
        for i in (0..n).filter(|i| !prescribed[*i] && of.friction[*i] > 0.0) {
            self.column.fill(0.0);
            self.column[i] = 1.0;
            solve(&self.factor, &mut self.column, prescribed);
            self.response[i * n..][..n].copy_from_slice(&self.column);
            rubbing[i] = 0.0;
        }
        for _ in 0..ROUNDS_MAX {
            let mut is_settled = true;
            for i in (0..n).filter(|i| !prescribed[*i] && of.friction[*i] > 0.0) {
                let response = &self.response[i * n..][..n];
                let stopping = rubbing[i] - (self.acceleration[i] + of.velocity[i] / of.step_s) / response[i];
                let change = stopping.clamp(-of.friction[i], of.friction[i]) - rubbing[i];
                rubbing[i] += change;
                for k in (0..n).filter(|k| !prescribed[*k]) {
                    self.acceleration[k] += response[k] * change;
                }
                is_settled &= change.abs() <= TOLERANCE * of.friction[i];
            }
            if is_settled {
                break;
            }
        }
    }

    /// Computes the Cholesky factorisation M_ff = L L'. Rows of prescribed degrees of freedom are excluded.
    fn factorise(&mut self, inertia: &[f64], prescribed: &[bool], n: usize) {
        for i in (0..n).filter(|i| !prescribed[*i]) {
            for j in (0..=i).filter(|j| !prescribed[*j]) {
                let inner: f64 = (0..j).filter(|k| !prescribed[*k]).map(|k| self.factor[i * n + k] * self.factor[j * n + k]).sum();
                let rest = inertia[i * n + j] - inner;
                self.factor[i * n + j] = if i == j { rest.sqrt() } else { rest / self.factor[j * n + j] };
            }
        }
    }
}

/// Solves L L' x = x in place, except for the prescribed degrees of freedom.
fn solve(factor: &[f64], x: &mut [f64], prescribed: &[bool]) {
    let n = x.len();
    for i in (0..n).filter(|i| !prescribed[*i]) {
        let inner: f64 = (0..i).filter(|k| !prescribed[*k]).map(|k| factor[i * n + k] * x[k]).sum();
        x[i] = (x[i] - inner) / factor[i * n + i];
    }
    for i in (0..n).rev().filter(|i| !prescribed[*i]) {
        let inner: f64 = (i + 1..n).filter(|k| !prescribed[*k]).map(|k| factor[k * n + i] * x[k]).sum();
        x[i] = (x[i] - inner) / factor[i * n + i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const INERTIA: [f64; 9] = [3.0, 1.0, 0.5, 1.0, 2.0, 0.3, 0.5, 0.3, 1.0];
    const DRIFT: [f64; 3] = [-4.0, 2.0, 0.5];

    fn smooth<'a>(inertia: &'a [f64], drift: &'a [f64]) -> Equations<'a> {
        Equations { inertia, drift, friction: &[0.0; 3][..drift.len()], velocity: &[0.0; 3][..drift.len()], step_s: 1e-3 }
    }

    #[test]
    fn a_braked_joint_has_no_acceleration_and_the_free_one_obeys_newton() {
        let mut effort = [1.5, 0.0, -0.25];
        PrescribedSolver::new(3).efforts(&smooth(&INERTIA, &DRIFT), &[false, true, false], &[0.0; 3], &mut effort, &mut [0.0; 3]);
        // The free pair, by Cramer's rule.
        let (f0, f2) = (1.5 - 4.0, -0.25 + 0.5);
        let d = 3.0 * 1.0 - 0.5 * 0.5;
        let (a0, a2) = ((f0 * 1.0 - 0.5 * f2) / d, (3.0 * f2 - 0.5 * f0) / d);
        assert!((effort[1] - (1.0 * a0 + 0.3 * a2 - 2.0)).abs() < 1e-12, "{effort:?}");
        assert_eq!((effort[0], effort[2]), (1.5, -0.25), "a free joint keeps its effort");
    }

    #[test]
    fn with_every_joint_braked_the_brakes_carry_the_drift() {
        let mut effort = [9.0, 9.0];
        PrescribedSolver::new(2).efforts(&smooth(&[2.0, 0.1, 0.1, 1.0], &[3.0, -1.0]), &[true, true], &[0.0; 2], &mut effort, &mut [0.0; 2]);
        assert_eq!(effort, [-3.0, 1.0]);
    }

    #[test]
    fn the_efforts_give_what_was_wanted() {
        let (wanted, mut effort) = ([2.0, 0.0, -3.0], [0.0, 1.25, 0.0]);
        PrescribedSolver::new(3).efforts(&smooth(&INERTIA, &DRIFT), &[true, false, true], &wanted, &mut effort, &mut [0.0; 3]);
        // For the free one: 1 q0'' + 2 q1'' + 0.3 q2'' = 1.25 + 2.
        let free = (1.25 + 2.0 - 2.0 + 0.9) / 2.0;
        let all = [2.0, free, -3.0];
        for i in 0..3 {
            let moved: f64 = (0..3).map(|k| INERTIA[3 * i + k] * all[k]).sum();
            assert!((moved - effort[i] - DRIFT[i]).abs() < 1e-12, "row {i} of {effort:?}");
        }
    }

    #[test]
    fn friction_stops_what_it_can_and_opposes_the_rest() {
        let (velocity, step_s) = ([0.0, 0.3, 0.001], 1e-3);
        let of = Equations { inertia: &INERTIA, drift: &DRIFT, friction: &[0.0, 2.0, 5.0], velocity: &velocity, step_s };
        let (mut effort, mut rubbing) = ([0.0; 3], [0.0; 3]);
        PrescribedSolver::new(3).efforts(&of, &[true, false, false], &[2.0, 0.0, 0.0], &mut effort, &mut rubbing);
        // The second one is too fast; the third one is at rest at the end of the step: its acceleration is -1.
        assert!((rubbing[1] + 2.0).abs() < 1e-12, "{rubbing:?}");
        let second = (2.0 - 2.0 - 1.0 * 2.0 + 0.3) / 2.0;
        let third = 0.5 * 2.0 + 0.3 * second - 1.0 - 0.5;
        assert!((rubbing[2] - third).abs() < 1e-6 && third.abs() < 5.0, "{rubbing:?} {third}");
        assert!((effort[0] - (3.0 * 2.0 + second - 0.5 + 4.0)).abs() < 1e-6, "the first one bears them as they really move: {effort:?}");
    }
}
