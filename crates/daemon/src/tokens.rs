// SPDX-License-Identifier: Apache-2.0
//! Tokens: a file with mode 0600 that stores their SHA-256 digests, with role, expiry and revocation. A token has 256 random bits, so one
//! round of a fast hash is sufficient; the comparison takes constant time.
use crate::requests::hex;
use crate::secret;
use api::Role;
use base64::Engine;
use base64::engine::general_purpose::URL_SAFE_NO_PAD;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};
use std::time::{SystemTime, UNIX_EPOCH};
use subtle::{Choice, ConditionallySelectable, ConstantTimeEq};

/// Entry of the file: a token or a client certificate.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    pub name: String,
    pub role: Role,
    /// SHA-256 digest of the token's text, or of the DER encoding of the certificate.
    pub sha256: String,
    /// True for a client certificate, false for a token.
    #[serde(default)]
    pub certificate: bool,
    /// Time of creation, s since the Unix epoch.
    pub created: u64,
    #[serde(default)]
    pub expires: Option<u64>,
    #[serde(default)]
    pub revoked: Option<u64>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct TokenTable {
    tokens: Vec<Entry>,
}

/// Reason why a token is rejected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TokenRejection {
    Wrong,
    Expired,
    Revoked,
}

/// Identity of the version of the file that was read.
type Version = (u64, u64, i64, i64);

/// The token file, which is reread whenever it has changed.
pub struct Tokens {
    path: PathBuf,
    read: Mutex<FileState>,
}

/// Contents of the file as last read.
#[derive(Default)]
struct FileState {
    version: Option<Version>,
    kept: TokenTable,
    /// Reason why the file currently cannot be read.
    trouble: Option<String>,
    told: TokenNews,
}

/// News that has already been reported.
#[derive(Default)]
struct TokenNews {
    trouble: Option<String>,
    /// Expiry stage of each token, by its name and creation time.
    ends: BTreeMap<(String, u64), Ending>,
}

/// Stage of a token's expiry.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Ending {
    Week,
    Day,
    Over,
}

const DAY_S: u64 = 86_400;

impl Tokens {
    /// Opens the file. Fails if it cannot be read, is malformed, or can be read by users other than its owner.
    pub fn open(path: &Path) -> io::Result<Tokens> {
        let tokens = Tokens { path: path.to_owned(), read: Mutex::default() };
        tokens.refresh(&mut tokens.locked())?;
        Ok(tokens)
    }

    fn locked(&self) -> MutexGuard<'_, FileState> {
        self.read.lock().expect("nobody panics with this lock")
    }

    fn refresh(&self, read: &mut FileState) -> io::Result<()> {
        let about = fs::metadata(&self.path)?;
        let version = (about.ino(), about.size(), about.mtime(), about.mtime_nsec());
        if read.version != Some(version) {
            (read.kept, read.version) = (load(&self.path)?, Some(version));
        }
        read.trouble = None;
        Ok(())
    }

    /// Rereads the file if it has changed. If it is damaged, its previous contents stay valid; if it was deleted, or others may read it,
    /// no caller is admitted.
    fn look(&self, read: &mut FileState) {
        let Err(why) = self.refresh(read) else { return };
        read.version = None;
        read.trouble = Some(if why.kind() == io::ErrorKind::InvalidData {
            format!("{why}; its previous tokens stay valid until it is fixed")
        } else {
            read.kept = TokenTable::default();
            format!("the token file '{}' cannot be read: {why}; no caller is admitted by a token until it exists again", self.path.display())
        });
    }

    /// Returns news for the operator, each item only once: the file has become unreadable or readable again, or a token is about to
    /// expire.
    pub fn news(&self, now_s: u64) -> Vec<String> {
        let mut read = self.locked();
        self.look(&mut read);
        let FileState { kept, trouble, told, .. } = &mut *read;
        let mut news = Vec::new();
        if told.trouble != *trouble {
            news.push(trouble.clone().unwrap_or_else(|| format!("the token file '{}' can be read again", self.path.display())));
            told.trouble.clone_from(trouble);
        }
        for entry in kept.tokens.iter().filter(|entry| entry.revoked.is_none()) {
            let Some(left_s) = entry.expires.map(|at| at.saturating_sub(now_s)) else { continue };
            let (ending, when) = match left_s {
                0 => (Ending::Over, "has expired".to_owned()),
                1..=DAY_S => (Ending::Day, format!("expires in {} h", left_s.div_ceil(3600))),
                left_s if left_s <= 7 * DAY_S => (Ending::Week, format!("expires in {} days", left_s.div_ceil(DAY_S))),
                _ => continue,
            };
            let before = told.ends.insert((entry.name.clone(), entry.created), ending);
            if before.is_none_or(|before| before < ending) {
                let what = if entry.certificate { "certificate" } else { "token" };
                news.push(format!("{what} '{}' {when}: create another before its holder is locked out (opengpac token add)", entry.name));
            }
        }
        news
    }

    /// Returns the owner of the token.
    pub fn verify(&self, token: &str, now_s: u64) -> Result<Entry, TokenRejection> {
        self.verify_digest(digest(token), now_s)
    }

    /// Returns the owner of a token, by the SHA-256 digest of the token's text.
    pub fn verify_digest(&self, sha256: [u8; 32], now_s: u64) -> Result<Entry, TokenRejection> {
        self.find(&sha256, false, now_s)
    }

    /// Returns the owner of a certificate, by the SHA-256 digest of its DER encoding.
    pub fn verify_certificate(&self, sha256: [u8; 32], now_s: u64) -> Result<Entry, TokenRejection> {
        self.find(&sha256, true, now_s)
    }

    /// Returns the entry with this digest. Compares all entries, even after a match.
    fn find(&self, sha256: &[u8; 32], certificate: bool, now_s: u64) -> Result<Entry, TokenRejection> {
        let mut read = self.locked();
        self.look(&mut read);
        let asked = hex(sha256);
        let mut found = u32::MAX;
        for (index, entry) in read.kept.tokens.iter().enumerate() {
            let index = u32::try_from(index).expect("a file of tokens has fewer than 2^32");
            let fits: Choice = entry.sha256.as_bytes().ct_eq(asked.as_bytes()) & Choice::from(u8::from(entry.certificate == certificate));
            found.conditional_assign(&index, fits);
        }
        let entry = usize::try_from(found).ok().and_then(|index| read.kept.tokens.get(index)).ok_or(TokenRejection::Wrong)?;
        match entry {
            Entry { revoked: Some(_), .. } => Err(TokenRejection::Revoked),
            Entry { expires: Some(at), .. } if *at <= now_s => Err(TokenRejection::Expired),
            entry => Ok(entry.clone()),
        }
    }
}

/// A token that is valid as long as this process serves requests, and is not stored in any file.
pub struct RunToken {
    sha256: String,
    /// Role of the token's holder.
    pub role: Role,
}

impl RunToken {
    /// Creates a new token with this role, and returns it with its text.
    pub fn new(role: Role) -> io::Result<(RunToken, String)> {
        let token = random()?;
        Ok((RunToken { sha256: hex(&Sha256::digest(token.as_bytes())), role }, token))
    }

    /// Compares a text with the token's text, in constant time.
    pub fn is(&self, token: &str) -> bool {
        self.sha256.as_bytes().ct_eq(hex(&Sha256::digest(token.as_bytes())).as_bytes()).into()
    }
}

/// Returns the digest of a token's text, as stored in the file.
pub(crate) fn digest(token: &str) -> [u8; 32] {
    Sha256::digest(token.as_bytes()).into()
}

/// Returns a new random token.
fn random() -> io::Result<String> {
    let mut random = [0_u8; 32];
    getrandom::fill(&mut random).map_err(|why| io::Error::other(why.to_string()))?;
    Ok(format!("gpac_{}", URL_SAFE_NO_PAD.encode(random)))
}

/// Returns the current time, s since the Unix epoch.
pub fn now_s() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs())
}

/// Creates a token with this name and adds it to the file, which is created if necessary. Returns the token, which cannot be retrieved
/// again.
pub fn add(path: &Path, name: &str, role: Role, expires: Option<u64>) -> io::Result<String> {
    let token = random()?;
    enter(path, name, role, expires, hex(&Sha256::digest(token.as_bytes())), false)?;
    Ok(token)
}

/// Adds a client certificate, by the SHA-256 digest of its DER encoding, so that its holder is admitted.
pub fn add_certificate(path: &Path, name: &str, role: Role, expires: Option<u64>, sha256: [u8; 32]) -> io::Result<()> {
    enter(path, name, role, expires, hex(&sha256), true)
}

fn enter(path: &Path, name: &str, role: Role, expires: Option<u64>, sha256: String, certificate: bool) -> io::Result<()> {
    let mut kept = if path.exists() { load(path)? } else { TokenTable::default() };
    if kept.tokens.iter().any(|entry| entry.name == name && entry.revoked.is_none()) {
        return Err(io::Error::new(io::ErrorKind::AlreadyExists, format!("there is already a token '{name}'; revoke it, or use another name")));
    }
    kept.tokens.push(Entry { name: name.to_owned(), role, sha256, certificate, created: now_s(), expires, revoked: None });
    store(path, &kept)
}

/// Revokes the token or certificate with this name. Returns false if there is none, or if it has already been revoked.
pub fn revoke(path: &Path, name: &str) -> io::Result<bool> {
    let mut kept = load(path)?;
    let mut any = false;
    for entry in kept.tokens.iter_mut().filter(|entry| entry.name == name && entry.revoked.is_none()) {
        entry.revoked = Some(now_s());
        any = true;
    }
    if any {
        store(path, &kept)?;
    }
    Ok(any)
}

/// Returns the entries of the file.
pub fn list(path: &Path) -> io::Result<Vec<Entry>> {
    Ok(load(path)?.tokens)
}

fn load(path: &Path) -> io::Result<TokenTable> {
    let file = secret::open(path)?;
    let text = io::read_to_string(file)?;
    serde_json::from_str(&text).map_err(|why| io::Error::new(io::ErrorKind::InvalidData, format!("'{}' is not a token file: {why}", path.display())))
}

/// Stores the file by replacing it with a new one, so that no reader sees a partially written file.
fn store(path: &Path, kept: &TokenTable) -> io::Result<()> {
    let new = path.with_extension(format!("new-{}", std::process::id()));
    let text = serde_json::to_string_pretty(kept).map_err(io::Error::other)?;
    let mut file = OpenOptions::new().write(true).create_new(true).mode(0o600).open(&new)?;
    let written = file.write_all(text.as_bytes()).and_then(|()| file.sync_all()).and_then(|()| fs::rename(&new, path));
    if written.is_err() {
        // Clean up the failed attempt; only the first error is reported.
        let _gone = fs::remove_file(&new);
    }
    written
}
