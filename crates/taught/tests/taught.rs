// SPDX-License-Identifier: Apache-2.0
//! Tests on points files in the states in which people and other programs leave them.
use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use supervisor::PointFile;
use taught::{TaughtPoint, delete, read, rename, teach};

/// A separate folder, which is deleted when this value is dropped.
struct Folder(PathBuf);

impl Folder {
    fn new() -> Self {
        static LAST: AtomicU32 = AtomicU32::new(0);
        let folder = std::env::temp_dir().join(format!("taught-{}-{}", std::process::id(), LAST.fetch_add(1, Ordering::Relaxed)));
        fs::create_dir_all(&folder).expect("a folder");
        Folder(folder)
    }

    fn file(&self, name: &str) -> PointFile {
        let text = |of: &[&str]| of.iter().map(|one| (*one).to_owned()).collect();
        PointFile {
            arm: "arm".to_owned(),
            path: self.0.join(name),
            model: "m".to_owned(),
            joints: text(&["turn", "slide"]),
            units: text(&["rad", "m"]),
            any_model: false,
        }
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _gone = fs::remove_dir_all(&self.0);
    }
}

fn at(name: &str, joints: [f64; 2]) -> TaughtPoint {
    TaughtPoint {
        name: name.to_owned(),
        joints: joints.to_vec(),
        frame: taught::JOINTS.to_owned(),
        tool: None,
        position: None,
        rpy_deg: None,
        configuration: None,
        turns: Vec::new(),
        note: String::new(),
        taught: None,
    }
}

fn head(units: &str) -> String {
    format!("format = 2\n[arm]\nname = \"arm\"\nmodel = \"m\"\njoints = [\"turn\", \"slide\"]\nunits = {units}\n[points]\n")
}

fn names(file: &PointFile) -> Vec<String> {
    read(file).expect("points").points.into_iter().map(|point| point.name).collect()
}

fn written(path: &Path) -> String {
    fs::read_to_string(path).expect("a text")
}

#[test]
fn a_file_in_degrees_and_millimetres_is_read_in_rad_and_m_and_stays_so() {
    let folder = Folder::new();
    let file = folder.file("points.toml");
    fs::write(&file.path, head("[\"deg\", \"mm\"]") + "a = {joints = [90, 250.0]}\n").expect("a file");
    let [turn, slide] = read(&file).expect("points").points[0].joints[..] else { panic!("two joints") };
    assert!((turn - std::f64::consts::FRAC_PI_2).abs() < 1e-12 && (slide - 0.25).abs() < 1e-12, "{turn} {slide}");
    teach(&file, &at("b", [std::f64::consts::PI, 0.001])).expect("taught");
    assert!(written(&file.path).contains("[180.0, 1.0]"), "{}", written(&file.path));
}

#[test]
fn a_link_stays_a_link_and_the_mode_of_a_file_stays() {
    let folder = Folder::new();
    let (file, link) = (folder.file("points.toml"), folder.file("link.toml"));
    teach(&file, &at("a", [0.0, 0.0])).expect("taught");
    fs::set_permissions(&file.path, fs::Permissions::from_mode(0o640)).expect("a mode");
    symlink(&file.path, &link.path).expect("a link");
    teach(&link, &at("b", [0.0, 0.0])).expect("taught");
    assert!(fs::symlink_metadata(&link.path).expect("there").is_symlink());
    assert_eq!(fs::metadata(&file.path).expect("there").permissions().mode() & 0o777, 0o640);
    assert_eq!(names(&file), ["a", "b"]);
    let left: Vec<_> = fs::read_dir(&folder.0).expect("a folder").map(|one| one.expect("one").file_name()).collect();
    assert_eq!(left.len(), 2, "nothing is left behind: {left:?}");
}

#[test]
fn names_of_any_text_are_written_so_that_they_are_read_again() {
    let folder = Folder::new();
    let file = folder.file("points.toml");
    for name in ["a b", "a.b", "\"quoted\"", "ä=1", "[points]", "#", "line\nbreak"] {
        teach(&file, &at(name, [0.5, -0.5])).expect("taught");
        rename(&file, name, &format!("{name}'")).expect("renamed");
        assert_eq!(delete(&file, &format!("{name}'")).expect("deleted").joints, [0.5, -0.5], "{name}");
    }
    assert_eq!(names(&file), [""; 0]);
}

#[test]
fn what_cannot_be_used_is_refused_and_left_alone() {
    let folder = Folder::new();
    let file = folder.file("points.toml");
    let units = "[\"rad\", \"m\"]";
    for (wrong, why) in [
        ("[".to_owned(), "line 1"),
        ("format = 3\n".to_owned(), "its format"),
        ("format = 2\n".to_owned(), "[arm]"),
        (head("[\"kg\", \"m\"]"), "units"),
        (head(units) + "a = {joints = [1]}\n", "point 'a'"),
        (head(units) + "a = {joints = [1, nan]}\n", "point 'a'"),
        (head(units) + "a = 7\n", "point 'a'"),
        (head(units) + "a = {joints = [1, 2], frame = \"table\", position = [0, 0, 0]}\n", "'table'"),
        (head(units) + "a = {joints = [1, 2], position = [0, 0, 0]}\n", "position in its frame"),
        (head(units).replace("\"slide\"", "\"lift\""), "turn, lift"),
        (head(units).replace("\"m\"\njoints", "\"other\"\njoints"), "a different model"),
        (format!("{}a = {}1{}\n", head(units), "[".repeat(5000), "]".repeat(5000)), "cannot be used"),
    ] {
        fs::write(&file.path, &wrong).expect("a file");
        for refusals in [read(&file).map(|_| ()), teach(&file, &at("b", [0.0, 0.0]))] {
            let said = refusals.expect_err(&wrong[..wrong.len().min(200)])[0].message.clone();
            assert!(said.contains(why), "{why}: {said}");
        }
        assert_eq!(written(&file.path), wrong);
    }
    let lost = PointFile { path: folder.0.join("gone/points.toml"), ..file };
    assert!(teach(&lost, &at("a", [0.0, 0.0])).expect_err("no folder")[0].message.contains("cannot write"));
}
