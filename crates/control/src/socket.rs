// SPDX-License-Identifier: Apache-2.0
//! The Unix socket: its path, and its protection against other users.
use model::refusal::{Class, Refusal, Refusals};
use std::fs::{self, DirBuilder, Permissions};
use std::io::ErrorKind;
use std::os::unix::fs::{DirBuilderExt, FileTypeExt, MetadataExt, PermissionsExt};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};

/// Returns the ID of the user who runs this process.
pub fn uid() -> u32 {
    fs::metadata("/proc/self").map(|about| about.uid()).expect("the processes of a machine with Linux have their folders in /proc")
}

/// Returns the default path of a system's socket: `$XDG_RUNTIME_DIR/opengpac/NAME.sock`, or `/tmp/opengpac-UID/NAME.sock`.
pub fn default_path(name: &str) -> PathBuf {
    let safe: String = name.chars().map(|c| if c.is_ascii_alphanumeric() || matches!(c, '-' | '_') { c } else { '_' }).collect();
    let runtime = std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from).filter(|path| path.is_absolute() && path.is_dir());
    let folder = runtime.map_or_else(|| PathBuf::from(format!("/tmp/opengpac-{}", uid())), |path| path.join("opengpac"));
    folder.join(format!("{safe}.sock"))
}

fn refuse(class: Class, message: String, remedy: &str) -> Refusals {
    vec![Refusal::new(class, message).remedy(remedy)]
}

/// Listens at a path. The socket has mode 0600 before any other user can reach it; a socket without a server is replaced. A missing
/// folder is created with mode 0700; the default folder must belong to this user and be inaccessible to others.
pub fn bind(path: &Path, is_default: bool) -> Result<UnixListener, Refusals> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let failed =
        |why: std::io::Error| refuse(Class::DefinitionError, format!("cannot listen on '{}': {why}", path.display()), "give another path with --socket");
    DirBuilder::new().recursive(true).mode(0o700).create(folder).map_err(failed)?;
    if is_default {
        let about = fs::symlink_metadata(folder).map_err(failed)?;
        if !about.is_dir() || about.uid() != uid() || about.mode() & 0o077 != 0 {
            let message = format!("the folder '{}' is not accessible to this user alone", folder.display());
            return Err(refuse(Class::NotAllowed, message, "remove it, or give a path with --socket"));
        }
    }
    match fs::symlink_metadata(path) {
        Ok(about) if !about.file_type().is_socket() => {
            return Err(refuse(Class::InUse, format!("'{}' exists and is not a socket", path.display()), "give another path with --socket"));
        }
        Ok(_) if UnixStream::connect(path).is_ok() => {
            return Err(refuse(Class::InUse, format!("a system is already served on '{}'", path.display()), "give this one another name or another --socket"));
        }
        Ok(_) => fs::remove_file(path).map_err(failed)?,
        Err(why) if why.kind() == ErrorKind::NotFound => {}
        Err(why) => return Err(failed(why)),
    }
    // The socket is created in a folder that is closed to other users, restricted, and only then moved to its path.
    let private = folder.join(format!(".{}", std::process::id()));
    DirBuilder::new().mode(0o700).create(&private).map_err(failed)?;
    let hidden = private.join("s");
    let bound = UnixListener::bind(&hidden).and_then(|listener| {
        fs::set_permissions(&hidden, Permissions::from_mode(0o600))?;
        fs::rename(&hidden, path)?;
        Ok(listener)
    });
    let _gone = fs::remove_dir_all(&private);
    bound.map_err(failed)
}
