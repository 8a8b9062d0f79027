// SPDX-License-Identifier: Apache-2.0
//! Arms of a system, as programs describe them: the devices that move one tool, and the geometry that connects them.
use crate::refuse::{refuse, unknown};
use indexmap::IndexMap;
use library::kinematics::JOINTS_MAX;
use library::kinematics::chain::Chain;
use model::refusal::{Class, Refusals};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Maximum number of arms in a system.
pub const ARMS_MAX: usize = 64;

/// An arm: joints that together move one tool.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ArmDescription {
    pub name: String,
    /// Logical devices of the arm's joints, in the order of the chain.
    pub joints: Vec<String>,
    /// Geometry that connects the joints; null if it is unknown.
    #[serde(default)]
    pub chain: Option<ChainDescription>,
    /// Human-readable reason why the geometry is unknown; empty if it is known.
    #[serde(default)]
    pub missing: String,
}

/// Geometry of an arm, as the value of the parameter `chain` of the kinematics blocks. Poses are x y z (m), then the quaternion w x y z.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ChainDescription {
    /// Number of joints.
    pub joints: usize,
    /// Kind of each of 16 joints: 0 does not move the tool, 1 revolute, 2 prismatic.
    pub kind: Vec<i32>,
    /// Pose of the arm's base in the frame in which poses are specified.
    pub base: Vec<f64>,
    /// Pose of the flange in the frame of the base with all joints at 0.
    pub home: Vec<f64>,
    /// Pose of the tool in the frame of the flange.
    pub tool: Vec<f64>,
    /// Unit vector along the axis of each of 16 joints, in the frame of the base, with all joints at 0.
    pub axis: Vec<Vec<f64>>,
    /// Point on each of these axes, m.
    pub anchor: Vec<Vec<f64>>,
}

impl ChainDescription {
    /// Returns the chain in the format of the blocks; `None` if its lists have the wrong lengths.
    fn chain(&self) -> Option<Chain> {
        Some(Chain {
            joints: i32::try_from(self.joints).ok()?,
            kind: self.kind.clone().try_into().ok()?,
            base: self.base.clone().try_into().ok()?,
            home: self.home.clone().try_into().ok()?,
            tool: self.tool.clone().try_into().ok()?,
            axis: vectors(&self.axis)?,
            anchor: vectors(&self.anchor)?,
        })
    }
}

fn vectors(of: &[Vec<f64>]) -> Option<[[f64; 3]; JOINTS_MAX]> {
    let read: Option<Vec<[f64; 3]>> = of.iter().map(|one| one.clone().try_into().ok()).collect();
    read?.try_into().ok()
}

/// File in which the taught points of an arm are stored, as set by the program. The supervisor does not read it.
#[derive(Clone, Debug, PartialEq)]
pub struct PointFile {
    /// Name of the arm.
    pub arm: String,
    pub path: PathBuf,
    /// Identifier of the arm's mechanical model, as stored in the file.
    pub model: String,
    /// Short names of the joints, and the unit of each.
    pub joints: Vec<String>,
    pub units: Vec<String>,
    /// True if points taught with other models are accepted as well.
    pub any_model: bool,
}

/// Arms by name.
#[derive(Default)]
pub(crate) struct Arms {
    by_name: IndexMap<String, ArmDescription>,
    point_files: IndexMap<String, PointFile>,
}

impl Arms {
    /// Registers an arm, replacing any arm with the same name. Fails if its chain does not match its joints, or if there are too many
    /// arms.
    pub fn enter(&mut self, arm: ArmDescription) -> Result<(), Refusals> {
        let name = &arm.name;
        if name.is_empty() || arm.joints.is_empty() {
            return Err(refuse(Class::CallError, "an arm must have a name and at least one joint", "give both"));
        }
        let fits = |of: &ChainDescription| of.joints == arm.joints.len() && of.chain().is_some_and(|chain| chain.read(of.joints).is_some());
        if !arm.chain.as_ref().is_none_or(fits) {
            let remedy = "give unit vectors as axes, poses as frames, and lists for 16 joints";
            return Err(refuse(Class::CallError, format!("the chain of arm '{name}' does not match its {} joints", arm.joints.len()), remedy));
        }
        if self.by_name.len() == ARMS_MAX && !self.by_name.contains_key(name) {
            return Err(refuse(Class::LimitExceeded, format!("there are already {ARMS_MAX} arms"), "describe fewer arms"));
        }
        self.by_name.insert(name.clone(), arm);
        Ok(())
    }

    /// Sets the file in which the taught points of an arm are stored, replacing the previous one.
    pub fn enter_points(&mut self, file: PointFile) {
        self.point_files.insert(file.arm.clone(), file);
    }

    /// Returns the file in which the taught points of an arm are stored. Fails if no program has set one.
    pub fn points(&self, arm: &str) -> Result<&PointFile, Refusals> {
        self.point_files.get(arm).ok_or_else(|| unknown("file of taught points for arm", arm, self.point_files.keys().map(String::as_str)))
    }

    /// Returns the arms whose joints all exist, in the order in which the arms were described.
    pub fn present(&self, is_there: impl Fn(&str) -> bool) -> Vec<ArmDescription> {
        self.by_name.values().filter(|arm| arm.joints.iter().all(|joint| is_there(joint))).cloned().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_joints() -> ArmDescription {
        let (nothing, stands) = (vec![0.0; 3], vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
        let mut axis = vec![nothing.clone(); JOINTS_MAX];
        axis[0] = vec![0.0, 0.0, 1.0];
        axis[1] = vec![0.0, 1.0, 0.0];
        let mut kind = vec![0; JOINTS_MAX];
        kind[..2].fill(1);
        let chain = ChainDescription { joints: 2, kind, base: stands.clone(), home: stands.clone(), tool: stands, axis, anchor: vec![nothing; JOINTS_MAX] };
        ArmDescription { name: "arm".to_owned(), joints: vec!["arm.first".to_owned(), "arm.second".to_owned()], chain: Some(chain), missing: String::new() }
    }

    fn refused(change: impl FnOnce(&mut ArmDescription)) -> String {
        let mut arm = two_joints();
        change(&mut arm);
        Arms::default().enter(arm).expect_err("it is refused")[0].message.clone()
    }

    #[test]
    fn an_arm_is_there_as_long_as_its_joints_are() {
        let mut arms = Arms::default();
        arms.enter(two_joints()).expect("an arm");
        assert_eq!(arms.present(|_| true), [two_joints()]);
        assert_eq!(arms.present(|joint| joint != "arm.second"), []);
        let unknown = ArmDescription { chain: None, missing: "it has no model".to_owned(), ..two_joints() };
        arms.enter(unknown.clone()).expect("an arm without geometry");
        assert_eq!(arms.present(|_| true), [unknown], "the last description counts");
    }

    #[test]
    fn a_chain_is_one_of_the_joints_of_its_arm() {
        let fits_not = "the chain of arm 'arm' does not match its 2 joints";
        assert_eq!(refused(|arm| arm.chain.as_mut().expect("a chain").joints = 3), fits_not);
        assert_eq!(refused(|arm| arm.chain.as_mut().expect("a chain").axis[1] = vec![0.0, 2.0, 0.0]), fits_not);
        assert_eq!(refused(|arm| arm.chain.as_mut().expect("a chain").home[3] = f64::NAN), fits_not);
        assert_eq!(refused(|arm| arm.chain.as_mut().expect("a chain").anchor.truncate(2)), fits_not);
        assert_eq!(refused(|arm| arm.joints.clear()), "an arm must have a name and at least one joint");
    }

    #[test]
    fn there_are_so_many_arms_and_no_more() {
        let mut arms = Arms::default();
        for number in 0..ARMS_MAX {
            arms.enter(ArmDescription { name: number.to_string(), ..two_joints() }).expect("room");
        }
        assert_eq!(arms.enter(two_joints()).expect_err("no room")[0].class, Class::LimitExceeded);
        arms.enter(ArmDescription { name: "0".to_owned(), ..two_joints() }).expect("one that is there");
    }
}
