// SPDX-License-Identifier: Apache-2.0
//! Replays a record in a separate process while a system runs, so that code, memory and processor time of the replay are separate from
//! those of the controlling process. Ending the process ends the replay.
use crate::found::ReplayResult;
use crate::run::{ReplayOptions, Run};
use crate::trust::{Trust, modules_in};
use process_kit::{Child, Launch, inherited};
use serde::{Deserialize, Serialize};
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::Shutdown;
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// Name of the descriptor over which the two processes communicate.
const LINK: &str = "replay";
/// Interval at which a running replay reports its progress.
const SLICE: Duration = Duration::from_millis(100);
/// Time limit for a process to exit after its link has been closed.
const GRACE: Duration = Duration::from_secs(2);

/// Request to the process.
#[derive(Serialize, Deserialize)]
struct Request {
    path: PathBuf,
    trust: Vec<String>,
    /// Code modules that replace recorded modules of the same names.
    others: Vec<(String, Vec<u8>)>,
    python: String,
}

/// Messages of the process, one per line.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum ProcessMessage {
    Progress { time_ns: Option<i64>, firings: u64 },
    Found(Box<ReplayResult>),
    Refused(String),
}

/// State of a replay.
#[derive(Clone, Debug, Default, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Replaying {
    /// True while the replay runs.
    pub running: bool,
    /// Number of firings that were replayed.
    pub firings: u64,
    /// Release time of the last replayed firing, ns on the recording's clock; null before the first.
    pub time_ns: Option<i64>,
    /// Findings, once the replay has ended.
    pub found: Option<ReplayResult>,
    /// Reason why the replay could not be run, or could not be completed.
    pub failure: Option<String>,
}

/// A replay in a separate process. Dropping it ends the process.
pub struct Apart {
    child: Arc<Child>,
    standing: Arc<Mutex<Replaying>>,
    is_cancelled: Arc<AtomicBool>,
    listener: Mutex<Option<JoinHandle<()>>>,
}

impl Apart {
    /// Starts a replay. `command` must call [`serve`] in the new process; `trust` contains the digests of code modules that may run;
    /// `others` replace recorded modules of the same names.
    ///
    /// # Errors
    /// Fails with a message if the process cannot be started.
    pub fn start(command: Vec<OsString>, python: String, path: &Path, trust: Vec<String>, others: Vec<(String, Vec<u8>)>) -> Result<Apart, String> {
        let cannot = |why: std::io::Error| format!("cannot start a process for a replay: {why}");
        let (ours, theirs) = UnixStream::pair().map_err(cannot)?;
        let child = Launch::new(command).descriptor(LINK, OwnedFd::from(theirs)).start().map_err(|why| why.to_string())?;
        let (child, is_cancelled) = (Arc::new(child), Arc::new(AtomicBool::new(false)));
        let standing = Arc::new(Mutex::new(Replaying { running: true, ..Replaying::default() }));
        let request = Request { path: path.to_owned(), trust, others, python };
        let heard = Listener { child: child.clone(), standing: standing.clone(), is_cancelled: is_cancelled.clone() };
        let listener = std::thread::Builder::new().name("replay".to_owned()).spawn(move || heard.listen(ours, &request)).map_err(cannot)?;
        Ok(Apart { child, standing, is_cancelled, listener: Mutex::new(Some(listener)) })
    }

    /// Returns the state of the replay.
    pub fn standing(&self) -> Replaying {
        locked(&self.standing).clone()
    }

    /// Stops the replay at its current position. Idempotent.
    pub fn stop(&self) {
        self.is_cancelled.store(true, Ordering::Release);
        self.child.kill();
        let listener = self.listener.lock().unwrap_or_else(PoisonError::into_inner).take();
        // The thread ends with the process; its panic has been reported.
        let _ended = listener.map(JoinHandle::join);
    }
}

impl Drop for Apart {
    fn drop(&mut self) {
        self.stop();
    }
}

fn locked(standing: &Mutex<Replaying>) -> MutexGuard<'_, Replaying> {
    standing.lock().unwrap_or_else(PoisonError::into_inner)
}

struct Listener {
    child: Arc<Child>,
    standing: Arc<Mutex<Replaying>>,
    is_cancelled: Arc<AtomicBool>,
}

impl Listener {
    fn listen(self, mut link: UnixStream, request: &Request) {
        let bytes = postcard::to_allocvec(request).expect("every request can be written");
        // If the process has already exited, the end of its messages shows it.
        let _asked = link.write_all(&bytes).and_then(|()| link.shutdown(Shutdown::Write));
        for line in BufReader::new(link).lines().map_while(Result::ok) {
            let Ok(said) = serde_json::from_str(&line) else { continue };
            self.hear(said);
        }
        let status = self.child.wait(GRACE);
        let mut standing = locked(&self.standing);
        standing.running = false;
        if standing.found.is_some() || standing.failure.is_some() {
            return;
        }
        standing.failure = Some(match status {
            _ if self.is_cancelled.load(Ordering::Acquire) => "it was stopped".to_owned(),
            Some(status) => format!("the process in which it ran {status}"),
            None => "the process in which it ran no longer answers".to_owned(),
        });
    }

    fn hear(&self, said: ProcessMessage) {
        let mut standing = locked(&self.standing);
        match said {
            ProcessMessage::Progress { time_ns, firings } => (standing.time_ns, standing.firings) = (time_ns, firings),
            ProcessMessage::Found(found) => {
                (standing.time_ns, standing.firings) = (Some(found.time_ns), found.firings);
                standing.found = Some(*found);
            }
            ProcessMessage::Refused(why) => standing.failure = Some(why),
        }
    }
}

/// Main function of the process: executes the requested replay, and reports its progress and findings.
///
/// # Errors
/// Fails with a message if the process was not started for this purpose.
pub fn serve() -> Result<(), String> {
    process_kit::stand_back();
    let mut link = UnixStream::from(inherited(LINK).map_err(|why| why.to_string())?);
    let mut bytes = Vec::new();
    link.read_to_end(&mut bytes).map_err(|why| format!("there was no request: {why}"))?;
    let request: Request = postcard::from_bytes(&bytes).map_err(|why| format!("the request cannot be understood: {why}"))?;
    match run(request, &mut link) {
        Err(why) => say(&mut link, &ProcessMessage::Refused(why)),
        Ok(found) => found.map_or(Ok(()), |found| say(&mut link, &ProcessMessage::Found(Box::new(found)))),
    }
    // The controlling process no longer listens.
    .or(Ok(()))
}

/// Executes a request; returns `None` if the controlling process has closed the link.
fn run(request: Request, link: &mut UnixStream) -> Result<Option<ReplayResult>, String> {
    let Request { path, trust, mut others, python } = request;
    if !others.is_empty() {
        let brought = modules_in(&path)?;
        others.retain(|(name, _)| brought.iter().any(|one| one.name == *name));
    }
    let asked = ReplayOptions { trust: Trust::Of(trust), python, ..ReplayOptions::default() };
    let mut run = Run::with_code(&path, asked, others)?;
    loop {
        if let Some(found) = run.some(SLICE)? {
            return Ok(Some(found));
        }
        let (time_ns, firings) = run.progress();
        if say(link, &ProcessMessage::Progress { time_ns, firings }).is_err() {
            return Ok(None);
        }
    }
}

fn say(link: &mut UnixStream, said: &ProcessMessage) -> std::io::Result<()> {
    let mut line = serde_json::to_vec(said).expect("everything that is said can be written");
    line.push(b'\n');
    link.write_all(&line)
}
