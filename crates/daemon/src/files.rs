// SPDX-License-Identifier: Apache-2.0
//! Files uploaded by a programming system: stored by content in a private folder, which is deleted when the daemon exits.
use crate::failure::Failure;
use crate::requests::{hex, is_sha256};
use api::Role;
use model::refusal::Class;
use schemars::JsonSchema;
use serde::Deserialize;
use serde::Serialize;
use serde_json::Value as Json;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::os::unix::fs::DirBuilderExt;
use std::path::{Component, Path, PathBuf};
use std::sync::Mutex;
use supervisor::{Reach, ReachingValue};

/// A stored file.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct StoredFile {
    /// Size of the file, bytes.
    pub bytes: u64,
}

/// Maximum size of a file, bytes.
pub const FILE_MAX: usize = 64 << 20;
/// Maximum total size of all files, bytes.
const FILES_MAX: u64 = 512 << 20;

/// Private folder for uploaded files.
pub struct Files {
    folder: PathBuf,
    /// Total size of the stored files, bytes.
    total: Mutex<u64>,
}

/// Reference to uploaded files, passed in place of a path.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reference {
    /// Name of the main file.
    pub main: String,
    /// Relative name → SHA-256 digest.
    pub files: BTreeMap<String, String>,
}

impl Files {
    /// Creates a new folder with mode 0700. Deletes folders left by daemons that were killed.
    pub fn new() -> io::Result<Files> {
        let home = std::env::temp_dir();
        remove_orphans(&home);
        let mut random = [0_u8; 8];
        getrandom::fill(&mut random).map_err(|why| io::Error::other(why.to_string()))?;
        let folder = home.join(format!("{PREFIX}{}-{}", std::process::id(), hex(&random)));
        for part in [folder.clone(), folder.join("content"), folder.join("models")] {
            fs::DirBuilder::new().mode(0o700).create(part)?;
        }
        Ok(Files { folder, total: Mutex::new(0) })
    }

    /// Stores a file. Fails if its digest does not match, or if the size limit would be exceeded.
    pub fn put(&self, sha256: &str, bytes: &[u8]) -> Result<(), Failure> {
        check_digest(sha256, bytes, "the file")?;
        let path = self.folder.join("content").join(sha256);
        let mut total = self.total.lock().expect("nobody panics with this lock");
        if path.exists() {
            return Ok(());
        }
        let more = bytes.len() as u64;
        if *total + more > FILES_MAX {
            return Err(Failure::new(Class::LimitExceeded, format!("all files together can have at most {} MiB", FILES_MAX >> 20), "restart the daemon"));
        }
        fs::write(&path, bytes).map_err(|why| failed("keep a file", &why))?;
        *total += more;
        Ok(())
    }

    /// Returns the size of a file in bytes; `None` if it is not stored.
    pub fn size(&self, sha256: &str) -> Option<u64> {
        if !is_sha256(sha256) {
            return None;
        }
        fs::metadata(self.folder.join("content").join(sha256)).ok().map(|about| about.len())
    }

    /// Returns the bytes of a file; `None` if it is not stored.
    pub fn bytes(&self, sha256: &str) -> Option<Vec<u8>> {
        if is_sha256(sha256) { fs::read(self.folder.join("content").join(sha256)).ok() } else { None }
    }

    /// Runs a function on a file with this name in a temporary folder, which is deleted afterwards.
    pub fn with<T>(&self, name: &str, bytes: &[u8], run: impl FnOnce(&Path) -> T) -> Result<T, Failure> {
        let is_plain = matches!(Path::new(name).components().collect::<Vec<_>>()[..], [Component::Normal(_)]);
        if !is_plain {
            return Err(Failure::new(Class::CallError, format!("a file cannot be named {name:?}"), "give its name without folders"));
        }
        let mut random = [0_u8; 8];
        getrandom::fill(&mut random).map_err(|why| Failure::new(Class::InvalidState, format!("cannot generate a random number: {why}"), "try again"))?;
        let folder = self.folder.join(hex(&random));
        fs::DirBuilder::new().mode(0o700).create(&folder).map_err(|why| failed("create a folder", &why))?;
        let path = folder.join(name);
        let result = fs::write(&path, bytes).map(|()| run(&path)).map_err(|why| failed("write the file", &why));
        // The daemon's whole folder is removed at its end in any case.
        let _gone = fs::remove_dir_all(&folder);
        result
    }

    /// Lays out the files to which a value refers, and replaces the value with their path. A value that is a path, or refers to code,
    /// requires the role `download`, because no other caller may use files of this machine.
    pub fn resolve(&self, of: ReachingValue<'_>, role: Role) -> Result<(), Failure> {
        let ReachingValue { option, reach, value } = of;
        let is_reference = value.is_object();
        if role < Role::Download && (reach == Reach::Code || !is_reference) {
            let (what, remedy) = match reach {
                Reach::Code => ("code that runs", "leave it out, or ask for a token of that role"),
                _ => ("a file on the machine of the system", "upload its files (PUT /v1/files/SHA256) and name them, or ask for a token of that role"),
            };
            let message = format!("'{option}' names {what}, which needs the role download, but the caller has {}", role.word());
            return Err(Failure::new(Class::NotAllowed, message, remedy));
        }
        if is_reference {
            let reference: Reference = serde_json::from_value(value.clone())
                .map_err(|why| Failure::new(Class::CallError, format!("'{option}': {why}"), "write {\"main\": NAME, \"files\": {NAME: SHA256}}"))?;
            *value = Json::String(self.lay_out(&reference)?.display().to_string());
        }
        Ok(())
    }

    /// Lays out the files of a reference under their names, in a folder that is kept, because a device may be reopened.
    fn lay_out(&self, reference: &Reference) -> Result<PathBuf, Failure> {
        let mut digest = Sha256::new();
        for (name, sha256) in &reference.files {
            check_relative(name)?;
            if self.size(sha256).is_none() {
                return Err(Failure::new(
                    Class::UnknownName,
                    format!("there is no file with SHA-256 '{sha256}' for '{name}'"),
                    "upload it first: PUT /v1/files/SHA256",
                ));
            }
            digest.update(format!("{name}\0{sha256}\n"));
        }
        if !reference.files.contains_key(&reference.main) {
            return Err(Failure::new(Class::UnknownName, format!("'{}' is not one of the named files", reference.main), "choose main from the files"));
        }
        let folder = self.folder.join("models").join(hex(&digest.finalize()));
        if !folder.exists() {
            let new = folder.with_extension("new");
            // Removes the remains of an earlier attempt.
            let _gone = fs::remove_dir_all(&new);
            self.link(reference, &new).and_then(|()| fs::rename(&new, &folder)).map_err(|why| failed("lay out the files", &why))?;
        }
        Ok(folder.join(&reference.main))
    }

    fn link(&self, reference: &Reference, folder: &Path) -> io::Result<()> {
        for (name, sha256) in &reference.files {
            let path = folder.join(name);
            fs::DirBuilder::new().recursive(true).mode(0o700).create(path.parent().unwrap_or(folder))?;
            fs::hard_link(self.folder.join("content").join(sha256), path)?;
        }
        Ok(())
    }
}

impl Drop for Files {
    fn drop(&mut self) {
        // No caller is left to report to; the next daemon removes what remains.
        let _gone = fs::remove_dir_all(&self.folder);
    }
}

const PREFIX: &str = "opengpac-rts-";

/// Deletes folders left by daemons that have exited. Folders of other users cannot be deleted and are left alone.
fn remove_orphans(home: &Path) {
    for entry in fs::read_dir(home).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let pid = name.to_str().and_then(|name| name.strip_prefix(PREFIX)).and_then(|rest| rest.split('-').next()).and_then(|pid| pid.parse::<u32>().ok());
        if pid.is_some_and(|pid| !Path::new("/proc").join(pid.to_string()).exists()) {
            let _gone = fs::remove_dir_all(entry.path());
        }
    }
}

/// Refuses content that does not match its digest.
pub fn check_digest(sha256: &str, bytes: &[u8], what: &str) -> Result<(), Failure> {
    if !is_sha256(sha256) {
        return Err(Failure::new(Class::CallError, format!("'{sha256}' is not a SHA-256 digest"), "write 64 lower-case hexadecimal digits"));
    }
    let is = hex(&Sha256::digest(bytes));
    if is == sha256 {
        return Ok(());
    }
    Err(Failure::new(Class::CallError, format!("{what} has SHA-256 {is}, not {sha256}"), "send it again: it was changed in transit"))
}

fn check_relative(name: &str) -> Result<(), Failure> {
    let mut parts = Path::new(name).components();
    if !name.is_empty() && name.len() < 512 && !name.contains('\0') && parts.all(|part| matches!(part, Component::Normal(_))) {
        return Ok(());
    }
    Err(Failure::new(Class::CallError, format!("a file cannot be named {name:?}"), "give a relative name without '..'"))
}

fn failed(what: &str, why: &io::Error) -> Failure {
    Failure::new(Class::InvalidState, format!("cannot {what}: {why}"), "free up disk space on the machine of the system")
}
