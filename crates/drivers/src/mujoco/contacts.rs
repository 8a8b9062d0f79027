// SPDX-License-Identifier: Apache-2.0
//! Contacts of a plant. With the option `contacts`, the model is loaded with an additional contact sensor, which reports the contacts
//! with the largest forces. It is placed after the model's own sensors, so that their numbers are unchanged, and it does not change the
//! motion of the plant.
use std::path::{Path, PathBuf};

/// Name of the sensor, and of the in-memory file that adds it.
pub(super) const SENSOR: &str = "opengpac.contacts";
const FILE: &str = ".opengpac-contacts.xml";
/// Maximum number of contacts.
pub(super) const CONTACTS_MAX: u32 = 64;
/// Number of values that the sensor reports per contact: force in the contact's axes; position, normal and tangent in the world frame.
pub(super) const TOLD: usize = 12;
/// Number of values in the channel per contact: position and force, in the world frame.
pub(super) const GIVEN: usize = 6;

/// Returns the path and the text of a file that includes the model at `model` and adds the sensor for this number of contacts. The file
/// is in the folder of the model, so that the model's own files are found.
pub(super) fn model_with(model: &Path, contacts: u32) -> (PathBuf, String) {
    let name = model.file_name().unwrap_or_default().to_string_lossy();
    let name = name.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
    let sensor = format!(r#"<contact name="{SENSOR}" num="{contacts}" reduce="maxforce" data="force pos normal tangent"/>"#);
    (model.with_file_name(FILE), format!(r#"<mujoco><include file="{name}"/><sensor>{sensor}</sensor></mujoco>"#))
}

/// Converts a contact to the format of the channel: its position, m, and the force of its first shape on its second, N, both in the world
/// frame.
pub(super) fn given(told: &[f64; TOLD]) -> [f64; GIVEN] {
    let [along, first, second, x, y, z, normal @ .., tx, ty, tz] = *told;
    let tangent = [tx, ty, tz];
    let [a, b] = [[1, 2, 0], [2, 0, 1]];
    let force = |k: usize| along * normal[k] + first * tangent[k] + second * (normal[a[k]] * tangent[b[k]] - normal[b[k]] * tangent[a[k]]);
    [x, y, z, force(0), force(1), force(2)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_is_told_in_the_world() {
        // A contact whose normal is y and whose tangent is z: the third axis is x.
        let told = [2.0, 3.0, 5.0, 0.1, 0.2, 0.3, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        assert_eq!(given(&told), [0.1, 0.2, 0.3, 5.0, 2.0, 3.0]);
        assert_eq!(given(&[0.0; TOLD]), [0.0; GIVEN], "none");
    }

    #[test]
    fn a_model_of_any_name_is_included() {
        let (place, text) = model_with(Path::new("/cells/a & \"b\".xml"), 8);
        assert_eq!(place, Path::new("/cells/.opengpac-contacts.xml"));
        assert!(text.contains(r#"<include file="a &amp; &quot;b&quot;.xml"/>"#) && text.contains(r#"num="8""#), "{text}");
    }
}
