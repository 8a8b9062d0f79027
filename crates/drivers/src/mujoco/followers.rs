// SPDX-License-Identifier: Apache-2.0
//! Followers: joints that an equality constraint couples to another joint (mimic joints, fingers of a gripper).
//!
//! MuJoCo enforces the coupling by a constraint that is solved after the drives have produced their efforts. The equations for drives,
//! brakes and friction treat the coupling as rigid instead: with q_f' = r q_p', a follower's inertia and forces are added to its
//! leader's, M <- G' M G with q' = G q'_p. Otherwise, a drive would compute with a finger that falls freely, and the constraint that
//! actually holds it would act on the arm as an external force.
use super::arm::{Follower, Joint, TERMS};
use super::fields::Fields;

/// `mjtEq` of two joints.
const EQUALITY_OF_JOINTS: i32 = 2;
/// Minimum ratio at which a joint still counts as the leader of the joint that its equality names first.
const RATIO_MIN: f64 = 1e-6;

impl Follower {
    /// Returns the ratio of the follower's velocity to its leader's.
    fn ratio(&self, positions: &[f64]) -> f64 {
        let second = if self.is_second { self.position } else { self.leader.1 };
        let x = positions[second] - self.rest.1;
        let slope = (1..TERMS).rev().fold(0.0, |sum, k| sum * x + k as f64 * self.terms[k]);
        match self.is_second {
            false => slope,
            true if slope.abs() >= RATIO_MIN => 1.0 / slope,
            true => 0.0,
        }
    }

    /// Returns the position of the follower for that of its leader, if the equality gives it explicitly.
    pub fn place(&self, positions: &[f64]) -> Option<f64> {
        let x = positions[self.leader.1] - self.rest.1;
        (!self.is_second).then(|| self.rest.0 + self.terms.iter().rev().fold(0.0, |sum, term| sum * x + term))
    }
}

/// Returns the followers among the degrees of freedom, each before its leader. `joints` are commanded, and are therefore not followers.
pub(super) fn followers(fields: &Fields, joints: &[Joint]) -> Vec<Follower> {
    let (kinds, firsts, seconds) = (fields.ints("eq_type"), fields.ints("eq_obj1id"), fields.ints("eq_obj2id"));
    let (active, data, rest) = (fields.flags("eq_active0"), fields.reals("eq_data"), fields.reals("qpos0"));
    let (position, velocity) = (fields.ints("jnt_qposadr"), fields.ints("jnt_dofadr"));
    let is_commanded = |v: usize| joints.iter().any(|joint| joint.velocity == v);
    let columns = data.len() / kinds.len().max(1);
    let mut found: Vec<Follower> = vec![];
    for e in (0..kinds.len()).filter(|e| kinds[*e] == EQUALITY_OF_JOINTS && active[*e] && seconds[*e] >= 0) {
        let of = |joint: i32| (velocity[joint as usize] as usize, position[joint as usize] as usize);
        let (first, second) = (of(firsts[e]), of(seconds[e]));
        let is_taken = |v: usize| is_commanded(v) || found.iter().any(|other| other.velocity == v);
        let is_second = is_taken(first.0);
        let ((v, q), leader) = if is_second { (second, first) } else { (first, second) };
        if !is_taken(v) {
            let terms = std::array::from_fn(|k| data[e * columns + k]);
            found.push(Follower { velocity: v, position: q, leader, terms, rest: (rest[first.1], rest[second.1]), is_second });
        }
    }
    in_order(found)
}

/// Orders followers so that each comes before its leader; cyclic ones are omitted.
fn in_order(mut left: Vec<Follower>) -> Vec<Follower> {
    let mut ordered = Vec::with_capacity(left.len());
    while let Some(next) = left.iter().position(|one| left.iter().all(|other| other.leader.0 != one.velocity)) {
        ordered.push(left.remove(next));
    }
    ordered
}

/// Adds the inertia (row-major) and forces of the followers to those of their leaders. A follower's own inertia is uncoupled afterwards.
pub(super) fn fold(followers: &[Follower], positions: &[f64], inertia: &mut [f64], forces: &mut [f64]) {
    let n = forces.len();
    for follower in followers {
        let (f, p, ratio) = (follower.velocity, follower.leader.0, follower.ratio(positions));
        for i in 0..n {
            inertia[p * n + i] += ratio * inertia[f * n + i];
        }
        for i in 0..n {
            inertia[i * n + p] += ratio * inertia[i * n + f];
        }
        for i in 0..n {
            (inertia[f * n + i], inertia[i * n + f]) = (0.0, 0.0);
        }
        inertia[f * n + f] = 1.0;
    }
    fold_forces(followers, positions, forces);
}

/// Adds the forces of the followers to those of their leaders.
pub(super) fn fold_forces(followers: &[Follower], positions: &[f64], forces: &mut [f64]) {
    for follower in followers {
        forces[follower.leader.0] += follower.ratio(positions) * forces[follower.velocity];
        forces[follower.velocity] = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn follower(velocity: usize, leader: usize, ratio: f64) -> Follower {
        let terms = [0.0, ratio, 0.0, 0.0, 0.0];
        Follower { velocity, position: velocity, leader: (leader, leader), terms, rest: (0.0, 0.0), is_second: false }
    }

    #[test]
    fn a_leader_bears_its_followers() {
        // 1 follows 0 at -2, 2 follows 1 at 3: q' = (1, -2, -6) q_0'.
        let mut inertia = [3.0, 1.0, 0.5, 1.0, 2.0, 0.3, 0.5, 0.3, 1.0];
        let way = [1.0, -2.0, -6.0];
        let whole: f64 = (0..9).map(|k| inertia[k] * way[k / 3] * way[k % 3]).sum();
        let mut forces = [4.0, 5.0, 6.0];
        let ordered = in_order(vec![follower(1, 0, -2.0), follower(2, 1, 3.0)]);
        fold(&ordered, &[0.0; 3], &mut inertia, &mut forces);
        assert!((inertia[0] - whole).abs() < 1e-12, "{inertia:?}");
        assert!((forces[0] - (4.0 - 10.0 - 36.0)).abs() < 1e-12, "{forces:?}");
        assert_eq!((&inertia[1..4], inertia[4], inertia[8]), (&[0.0; 3][..], 1.0, 1.0), "followers are coupled to nothing");
    }

    #[test]
    fn those_that_follow_each_other_are_left_out() {
        assert_eq!(in_order(vec![follower(0, 1, 1.0), follower(1, 0, 1.0), follower(2, 3, 1.0)]).len(), 1);
    }

    #[test]
    fn the_ratio_is_the_slope_either_way() {
        let mut one = Follower { terms: [0.5, 2.0, 3.0, 0.0, 0.0], rest: (0.0, 0.1), ..follower(0, 1, 0.0) };
        assert!((one.ratio(&[0.0, 0.3]) - (2.0 + 6.0 * 0.2)).abs() < 1e-12);
        assert!((one.place(&[0.0, 0.3]).expect("it is the first") - (0.5 + 2.0 * 0.2 + 3.0 * 0.04)).abs() < 1e-12);
        one.is_second = true;
        assert!((one.ratio(&[0.3, 0.0]) - 1.0 / 3.2).abs() < 1e-12);
    }
}
