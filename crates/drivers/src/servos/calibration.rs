// SPDX-License-Identifier: Apache-2.0
//! Where the joints of an arm have their zero and their ends: a file that is in the form of lerobot's calibrations.
//!
//! A JSON table: each joint's name with `id`, `drive_mode` (1: it counts the other way), `homing_offset` (what the servo itself adds, for
//! comparison), `range_min` and `range_max` (counts). The zero is the middle of the range, as lerobot counts degrees; where another was
//! recorded it is `zero` (counts), which lerobot does not know.
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::path::Path;

/// A joint's entry.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Entry {
    pub(super) id: u8,
    #[serde(default)]
    pub(super) drive_mode: u8,
    #[serde(default)]
    pub(super) homing_offset: i64,
    pub(super) range_min: f64,
    pub(super) range_max: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) zero: Option<f64>,
}

/// A file's entries by the names of the joints.
pub(super) type Calibration = BTreeMap<String, Entry>;

impl Entry {
    pub(super) fn direction(&self) -> f64 {
        if self.drive_mode == 1 { -1.0 } else { 1.0 }
    }

    /// Counts at 0 rad.
    pub(super) fn zero(&self) -> f64 {
        self.zero.unwrap_or(0.5 * (self.range_min + self.range_max))
    }
}

/// Reads a file.
///
/// # Errors
/// For people: what is wrong with it.
pub(super) fn read(path: &Path) -> Result<Calibration, String> {
    let text = std::fs::read_to_string(path).map_err(|why| why.to_string())?;
    let entries: Calibration = serde_json::from_str(&text).map_err(|why| why.to_string())?;
    for (name, entry) in &entries {
        if entry.range_min.partial_cmp(&entry.range_max) != Some(Ordering::Less) {
            return Err(format!("the range of '{name}', {} to {}, is empty; record it again", entry.range_min, entry.range_max));
        }
        if entry.drive_mode > 1 {
            return Err(format!("the drive mode of '{name}' is {}; 0 or 1 is asked for", entry.drive_mode));
        }
    }
    Ok(entries)
}

/// Writes a file, whole or not at all.
///
/// # Errors
/// For people.
pub(super) fn write(path: &Path, entries: &Calibration) -> Result<(), String> {
    let text = serde_json::to_string_pretty(entries).map_err(|why| why.to_string())?;
    let beside = path.with_extension("part");
    std::fs::write(&beside, text + "\n").and_then(|()| std::fs::rename(&beside, path)).map_err(|why| format!("{}: {why}", path.display()))
}
