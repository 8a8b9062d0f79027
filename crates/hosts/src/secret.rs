// SPDX-License-Identifier: Apache-2.0
//! The shared secret of a user's programs on one host, and how each side of a connection proves that it has it without disclosing it.
//!
//! The joining side proves it to the transport before any of its packets are handled: an HMAC over a number drawn by the listening side.
//! The listening side proves it in its welcome: an HMAC over a number drawn by the joining side and the port that was called. Otherwise
//! another user who listens at the expected port could make this host join, and could run arbitrary code on it.
use crate::refused::JoinError;
use hmac::{Hmac, Mac};
use sha2::Sha256;
use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Read, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::Path;

/// Length of a random number that is drawn for one answer, bytes; `PROOF_LEN` is the length of the answer (the proof).
pub(crate) const DRAWN_LEN: usize = 16;
pub(crate) const PROOF_LEN: usize = 32;
/// Name of the file with the secret, in a folder of the user.
const FILE: &str = "hosts-secret";
/// Number of hexadecimal digits of a secret (256 bits).
const LEN: usize = 64;

/// Returns the shared secret of all programs of a user on this host. It is stored in a file of mode 0600 in `folder`, to which other
/// users must not have access. The file is created if it does not exist.
///
/// # Errors
/// Fails with [`JoinError::File`] if the file cannot be read or created, or if other users may read it.
pub fn secret_of_user(folder: &Path) -> Result<String, JoinError> {
    let path = folder.join(FILE);
    let refused = |reason: String| JoinError::File { what: "secret of this user", path: path.clone(), reason };
    // The file is first written completely under a name of its own: no process reads half of it, and if two create it at once, one
    // succeeds.
    let own = folder.join(format!("{FILE}-{}-{:016x}", std::process::id(), crate::random::number()));
    for _ in 0..2 {
        match File::open(&path) {
            Ok(file) => return read(file).map_err(refused),
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            Err(error) => return Err(refused(error.to_string())),
        }
        let made = drawn::<{ LEN / 2 }>().and_then(|bytes| {
            let digits: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
            OpenOptions::new().write(true).create_new(true).mode(0o600).open(&own)?.write_all(digits.as_bytes())
        });
        let linked = made.and_then(|()| match std::fs::hard_link(&own, &path) {
            Err(error) if error.kind() != ErrorKind::AlreadyExists => Err(error),
            _ => Ok(()),
        });
        // The file was created here; it does not matter if it has been deleted already.
        let _removed = std::fs::remove_file(&own);
        linked.map_err(|error| refused(error.to_string()))?;
    }
    Err(refused("it disappears each time it is created".to_owned()))
}

fn read(file: File) -> Result<String, String> {
    let about = file.metadata().map_err(|error| error.to_string())?;
    // SAFETY: returns a number.
    if about.uid() != unsafe { libc::geteuid() } || about.mode() & 0o077 != 0 {
        return Err("others have created it or may read it; remove it".to_owned());
    }
    let mut secret = String::new();
    file.take(4 * LEN as u64).read_to_string(&mut secret).map_err(|error| error.to_string())?;
    let is_one = secret.len() == LEN && secret.bytes().all(|byte| byte.is_ascii_hexdigit());
    if is_one { Ok(secret) } else { Err("it is damaged; remove it".to_owned()) }
}

/// Returns unpredictable bytes.
pub(crate) fn drawn<const N: usize>() -> std::io::Result<[u8; N]> {
    let mut bytes = [0; N];
    File::open("/dev/urandom")?.read_exact(&mut bytes)?;
    Ok(bytes)
}

/// Returns the proof, for a drawn number, that the listener at `port` has the secret.
pub(crate) fn proof(secret: &str, drawn: &[u8; DRAWN_LEN], port: u16, joins: u64) -> [u8; PROOF_LEN] {
    keyed(secret, drawn, port, joins).finalize().into_bytes().into()
}

/// Returns true if an answer is the expected proof. The comparison takes constant time, so that it does not reveal how much of the answer
/// is correct.
pub(crate) fn is_proof(secret: &str, drawn: &[u8; DRAWN_LEN], port: u16, joins: u64, answer: &[u8; PROOF_LEN]) -> bool {
    keyed(secret, drawn, port, joins).verify_slice(answer).is_ok()
}

fn keyed(secret: &str, drawn: &[u8; DRAWN_LEN], port: u16, joins: u64) -> Hmac<Sha256> {
    let mut keyed = Hmac::<Sha256>::new_from_slice(secret.as_bytes()).expect("a key of any length does");
    keyed.update(b"opengpac hosts: listens");
    keyed.update(drawn);
    keyed.update(&port.to_le_bytes());
    keyed.update(&joins.to_le_bytes());
    keyed
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    fn folder(name: &str) -> std::path::PathBuf {
        let folder = std::env::temp_dir().join(format!("hosts-{name}-{:016x}", crate::random::number()));
        std::fs::create_dir(&folder).expect("a folder");
        folder
    }

    #[test]
    fn a_user_has_one_secret_which_nobody_else_may_read() {
        let folder = folder("secret");
        let secrets: Vec<_> = std::thread::scope(|scope| {
            let making: Vec<_> = (0..8).map(|_| scope.spawn(|| secret_of_user(&folder).expect("it can be made"))).collect();
            making.into_iter().map(|made| made.join().expect("no panic")).collect()
        });
        assert!(secrets.iter().all(|secret| *secret == secrets[0] && secret.len() == LEN));
        assert_eq!(std::fs::read_dir(&folder).expect("it is ours").count(), 1, "nothing else is left");
        let path = folder.join(FILE);
        assert_eq!(std::fs::metadata(&path).expect("it is there").mode() & 0o777, 0o600);
        for (mode, words) in [(0o640, "others"), (0o604, "others")] {
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(mode)).expect("it is ours");
            assert!(secret_of_user(&folder).expect_err("others may read it").to_string().contains(words));
        }
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600)).expect("it is ours");
        std::fs::write(&path, "short").expect("it is ours");
        assert!(secret_of_user(&folder).expect_err("it is damaged").to_string().contains("damaged"));
        std::fs::remove_dir_all(folder).expect("it is ours");
    }

    #[test]
    fn a_proof_is_of_one_secret_number_port_and_host() {
        let (drawn, other) = ([1; DRAWN_LEN], [2; DRAWN_LEN]);
        let answer = proof("one", &drawn, 7447, 9);
        assert!(is_proof("one", &drawn, 7447, 9, &answer));
        assert!(!is_proof("two", &drawn, 7447, 9, &answer));
        assert!(!is_proof("one", &other, 7447, 9, &answer));
        assert!(!is_proof("one", &drawn, 7448, 9, &answer));
        assert!(!is_proof("one", &drawn, 7447, 8, &answer));
        assert_ne!(super::drawn::<16>().expect("there are numbers"), super::drawn::<16>().expect("there are numbers"));
    }
}
