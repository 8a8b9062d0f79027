// SPDX-License-Identifier: Apache-2.0
//! Zeros and range ends of the joints of an arm: a file in lerobot's calibration format.
//!
//! A JSON table: each joint's name with `id`, `drive_mode` (1: it counts in the opposite direction), `homing_offset` (the offset added by
//! the servo itself, for comparison), `range_min` and `range_max` (counts). The zero is the middle of the range, as in lerobot's degrees;
//! if a different zero was recorded, it is `zero` (counts), which lerobot ignores.
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::fs::{OpenOptions, Permissions};
use std::io::Write as _;
use std::os::unix::fs::{OpenOptionsExt as _, PermissionsExt as _};
use std::path::Path;

/// Entry of a joint.
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

/// Entries of a file, by joint name.
pub(super) type Calibration = BTreeMap<String, Entry>;

impl Entry {
    pub(super) fn direction(&self) -> f64 {
        if self.drive_mode == 1 { -1.0 } else { 1.0 }
    }

    /// Returns the counts at 0 rad.
    pub(super) fn zero(&self) -> f64 {
        self.zero.unwrap_or(0.5 * (self.range_min + self.range_max))
    }
}

/// Reads a file.
///
/// # Errors
/// Fails with a human-readable message about the file.
pub(super) fn read(path: &Path) -> Result<Calibration, String> {
    let text = std::fs::read_to_string(path).map_err(|why| why.to_string())?;
    let entries: Calibration = serde_json::from_str(&text).map_err(|why| why.to_string())?;
    for (name, entry) in &entries {
        if entry.range_min.partial_cmp(&entry.range_max) != Some(Ordering::Less) {
            return Err(format!("the range of '{name}', {} to {}, is empty; record it again", entry.range_min, entry.range_max));
        }
        if entry.drive_mode > 1 {
            return Err(format!("the drive mode of '{name}' must be 0 or 1, not {}", entry.drive_mode));
        }
    }
    Ok(entries)
}

/// Writes a file atomically. An existing file keeps its mode and must be a calibration; a new file is accessible only to its owner.
///
/// # Errors
/// Fails with a human-readable message if the file cannot be written, or the existing file is not a calibration.
pub(super) fn write(path: &Path, entries: &Calibration) -> Result<(), String> {
    let failed = |why: std::io::Error| format!("{}: {why}", path.display());
    let text = serde_json::to_string_pretty(entries).map_err(|why| why.to_string())? + "\n";
    let mode = match std::fs::metadata(path) {
        Ok(there) if !there.is_file() || (there.len() > 0 && read(path).is_err()) => {
            return Err(format!("{} exists and is not a calibration; give another name, or remove it", path.display()));
        }
        Ok(there) => there.permissions().mode() & 0o777,
        Err(_) => 0o600,
    };
    let mut name = path.file_name().ok_or_else(|| format!("{} does not name a file", path.display()))?.to_owned();
    name.push(format!(".{}.part", std::process::id()));
    let beside = path.with_file_name(name);
    let written = (OpenOptions::new().write(true).create_new(true).mode(0o600).open(&beside))
        .and_then(|mut file| {
            file.write_all(text.as_bytes())?;
            file.set_permissions(Permissions::from_mode(mode))?;
            file.sync_all()
        })
        .and_then(|()| std::fs::rename(&beside, path));
    written.map_err(|why| {
        // No partial file remains; if another writer made it, that writer will rename it.
        if why.kind() != std::io::ErrorKind::AlreadyExists {
            let _gone = std::fs::remove_file(&beside);
        }
        failed(why)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mode(path: &Path) -> u32 {
        std::fs::metadata(path).expect("it is there").permissions().mode() & 0o777
    }

    #[test]
    fn a_calibration_keeps_the_mode_of_its_file_and_overwrites_nothing_else() {
        let folder = std::env::temp_dir().join(format!("calibration-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let (path, other) = (folder.join("arm.json"), folder.join("shadow"));
        let entry = Entry { id: 1, drive_mode: 0, homing_offset: 0, range_min: 0.0, range_max: 10.0, zero: None };
        let entries = Calibration::from([("elbow".to_owned(), entry)]);
        write(&path, &entries).expect("a new file");
        assert_eq!(mode(&path), 0o600);
        std::fs::set_permissions(&path, Permissions::from_mode(0o640)).expect("ours");
        write(&path, &entries).expect("again");
        assert_eq!((mode(&path), read(&path)), (0o640, Ok(entries.clone())));
        std::fs::write(&other, "root:*:1\n").expect("ours");
        let refused = write(&other, &entries).expect_err("it is no calibration");
        assert!(refused.contains("is not a calibration") && !refused.contains("root:"), "{refused}");
        assert_eq!(std::fs::read_to_string(&other).expect("it is there"), "root:*:1\n");
        assert_eq!(std::fs::read_dir(&folder).expect("ours").count(), 2, "nothing half written is left");
        std::fs::remove_dir_all(&folder).expect("ours");
    }
}
