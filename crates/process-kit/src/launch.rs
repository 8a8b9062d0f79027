// SPDX-License-Identifier: Apache-2.0
//! Start of a process, which inherits only the named descriptors; all others are closed.
//!
//! It is started without copying this process: a fork makes every page of the parent copy-on-write, so that the next store of a real-time
//! thread to each of them would cause a page fault.
use crate::{Child, DESCRIPTORS};
use std::collections::BTreeMap;
use std::ffi::{CStr, CString, OsString};
use std::fmt;
use std::io;
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd, RawFd};
use std::os::unix::ffi::OsStringExt;
use std::time::Duration;

unsafe extern "C" {
    /// Closes every descriptor from `from` on in the new process (glibc 2.34).
    fn posix_spawn_file_actions_addclosefrom_np(actions: *mut libc::posix_spawn_file_actions_t, from: libc::c_int) -> libc::c_int;
}

/// Number of the first passed descriptor, after the standard streams.
const FIRST: RawFd = 3;

/// A process to be started: its command line, inherited descriptors, environment and limits.
///
/// The process gets a process group of its own, so that Ctrl-C at the terminal does not reach it. Its standard input is empty, its
/// standard output and error are those of this process, and it runs on the CPU cores of this process's main thread, no matter which
/// thread starts it. Its priority is ordinary unless it is started [urgently](Launch::urgently). It survives this process.
#[derive(Debug)]
pub struct Launch {
    command: Vec<OsString>,
    descriptors: Vec<(String, OwnedFd)>,
    variables: BTreeMap<OsString, OsString>,
    real_time_max: Option<Duration>,
    is_urgent: bool,
}

impl Launch {
    /// Prepares the launch of a program (searched for in `PATH` unless it contains a `/`) with its arguments.
    pub fn new(command: impl IntoIterator<Item = OsString>) -> Launch {
        Launch {
            command: command.into_iter().collect(),
            descriptors: Vec::new(),
            variables: std::env::vars_os().collect(),
            real_time_max: None,
            is_urgent: false,
        }
    }

    /// Passes a descriptor, which the process takes with [`inherited`](crate::inherited) by this name (letters, digits, `_`).
    pub fn descriptor(mut self, name: &str, descriptor: OwnedFd) -> Launch {
        self.descriptors.push((name.to_owned(), descriptor));
        self
    }

    /// Sets an environment variable; the others are inherited.
    pub fn variable(mut self, name: impl Into<OsString>, value: impl Into<OsString>) -> Launch {
        self.variables.insert(name.into(), value.into());
        self
    }

    /// Sets the CPU time that a real-time thread of the process may use without sleeping (`RLIMIT_RTTIME`): a runaway loop that exceeds
    /// it is signalled and, one second later, killed. Because the limit is inherited, it applies from the first instruction. A higher
    /// limit of this process is lowered to the same value; every process with kernels has such a limit. The default is the limit of this
    /// process.
    pub fn real_time_max(mut self, limit: Duration) -> Launch {
        self.real_time_max = Some(limit);
        self
    }

    /// Starts the process at the priority of the calling thread, which waits until the program is loaded. At a real-time priority, no
    /// load delays either of them. The process keeps this priority until it sets another one.
    pub fn urgently(mut self) -> Launch {
        self.is_urgent = true;
        self
    }

    /// Starts the process. Not on the real-time path.
    ///
    /// # Errors
    /// [`LaunchError`] if there is no such program, there is no permission to run it, or the system has no processes left.
    pub fn start(mut self) -> Result<Child, LaunchError> {
        let fail = |problem: String| LaunchError { command: words(&self.command), problem };
        let names: Vec<String> = self.descriptors.iter().zip(FIRST..).map(|((name, _), number)| format!("{name}={number}")).collect();
        self.variables.insert(DESCRIPTORS.into(), names.join(",").into());
        let variables = self.variables.iter().map(|(name, value)| {
            let mut text = name.clone();
            text.push("=");
            text.push(value);
            text
        });
        let arguments = texts(self.command.iter().cloned()).map_err(&fail)?;
        let variables = texts(variables).map_err(&fail)?;
        if arguments.is_empty() {
            return Err(fail("the command line is empty".to_owned()));
        }
        let descriptors: Vec<RawFd> = self.descriptors.iter().map(|(_, descriptor)| descriptor.as_raw_fd()).collect();
        if let Some(limit) = self.real_time_max {
            limit_ours(limit);
        }
        let pid = spawn(&arguments, &variables, &descriptors, self.is_urgent).map_err(|error| fail(error.to_string()))?;
        let child = Child::started(pid).map_err(|error| fail(error.to_string()))?;
        settle(pid, self.real_time_max).map_err(|error| fail(error.to_string()))?;
        Ok(child)
    }
}

fn words(command: &[OsString]) -> String {
    command.iter().map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ")
}

fn texts(words: impl Iterator<Item = OsString>) -> Result<Vec<CString>, String> {
    words.map(|word| CString::new(word.into_vec()).map_err(|_| "a word of the command line or environment contains a NUL".to_owned())).collect()
}

/// Resources that must be freed after a spawn.
struct Plan {
    actions: libc::posix_spawn_file_actions_t,
    attributes: libc::posix_spawnattr_t,
}

impl Drop for Plan {
    fn drop(&mut self) {
        // SAFETY: both were initialised when the plan was made.
        unsafe {
            libc::posix_spawn_file_actions_destroy(&mut self.actions);
            libc::posix_spawnattr_destroy(&mut self.attributes);
        }
    }
}

fn check(result: libc::c_int) -> io::Result<()> {
    if result == 0 { Ok(()) } else { Err(io::Error::from_raw_os_error(result)) }
}

/// Starts a process that has `descriptors` as `FIRST`, `FIRST + 1`, …, and no higher ones.
fn spawn(arguments: &[CString], variables: &[CString], descriptors: &[RawFd], is_urgent: bool) -> io::Result<libc::pid_t> {
    let end = FIRST + descriptors.len() as RawFd;
    // Duplicates above all target numbers, so that none is overwritten before it is passed.
    let above: Vec<OwnedFd> = descriptors.iter().map(|descriptor| duplicate(*descriptor, end)).collect::<io::Result<_>>()?;
    let mut plan = plan(is_urgent)?;
    let input: &CStr = c"/dev/null";
    // SAFETY: the plan is initialised, the path ends in NUL, and the calls copy what they are given.
    unsafe {
        check(libc::posix_spawn_file_actions_addopen(&mut plan.actions, 0, input.as_ptr(), libc::O_RDONLY, 0))?;
        for (descriptor, number) in above.iter().zip(FIRST..) {
            check(libc::posix_spawn_file_actions_adddup2(&mut plan.actions, descriptor.as_raw_fd(), number))?;
        }
        check(posix_spawn_file_actions_addclosefrom_np(&mut plan.actions, end))?;
    }
    let argv = pointers(arguments);
    let envp = pointers(variables);
    let mut pid = 0;
    // SAFETY: both lists end in a null pointer and live, with their texts, until the call returns.
    check(unsafe { libc::posix_spawnp(&mut pid, argv[0], &plan.actions, &plan.attributes, argv.as_ptr(), envp.as_ptr()) })?;
    Ok(pid)
}

/// Returns the attributes of the spawn: a process group of its own, ordinary scheduling (that of this thread if `is_urgent`), and no
/// signal blocked or ignored.
fn plan(is_urgent: bool) -> io::Result<Plan> {
    // SAFETY: all zeroes is storage that the two calls initialise.
    let mut plan: Plan = unsafe {
        let mut plan = std::mem::MaybeUninit::<Plan>::zeroed();
        check(libc::posix_spawn_file_actions_init(&raw mut (*plan.as_mut_ptr()).actions))?;
        check(libc::posix_spawnattr_init(&raw mut (*plan.as_mut_ptr()).attributes))?;
        plan.assume_init()
    };
    let scheduling = if is_urgent { 0 } else { libc::POSIX_SPAWN_SETSCHEDULER };
    let flags = libc::POSIX_SPAWN_SETPGROUP | libc::POSIX_SPAWN_SETSIGMASK | libc::POSIX_SPAWN_SETSIGDEF | scheduling;
    let ordinary = libc::sched_param { sched_priority: 0 };
    // SAFETY: the attributes are initialised; the sets and the parameter are values of our own.
    unsafe {
        let (mut none, mut ignored): (libc::sigset_t, libc::sigset_t) = (std::mem::zeroed(), std::mem::zeroed());
        libc::sigemptyset(&mut none);
        libc::sigemptyset(&mut ignored);
        for signal in [libc::SIGPIPE, libc::SIGINT, libc::SIGTERM, libc::SIGHUP, libc::SIGXFSZ] {
            libc::sigaddset(&mut ignored, signal);
        }
        check(libc::posix_spawnattr_setflags(&mut plan.attributes, flags as libc::c_short))?;
        check(libc::posix_spawnattr_setpgroup(&mut plan.attributes, 0))?;
        check(libc::posix_spawnattr_setsigmask(&mut plan.attributes, &none))?;
        check(libc::posix_spawnattr_setsigdefault(&mut plan.attributes, &ignored))?;
        check(libc::posix_spawnattr_setschedpolicy(&mut plan.attributes, libc::SCHED_OTHER))?;
        check(libc::posix_spawnattr_setschedparam(&mut plan.attributes, &ordinary))?;
    }
    Ok(plan)
}

fn pointers(texts: &[CString]) -> Vec<*mut libc::c_char> {
    texts.iter().map(|text| text.as_ptr().cast_mut()).chain([std::ptr::null_mut()]).collect()
}

fn duplicate(descriptor: RawFd, from: RawFd) -> io::Result<OwnedFd> {
    // SAFETY: makes a new descriptor of an open one.
    match unsafe { libc::fcntl(descriptor, libc::F_DUPFD_CLOEXEC, from) } {
        made if made >= 0 => {
            // SAFETY: it was made just now.
            Ok(unsafe { OwnedFd::from_raw_fd(made) })
        }
        _ => Err(io::Error::last_os_error()),
    }
}

/// Lowers the limit of this process permanently, because raising it again could affect a thread that relies on it. If this fails,
/// `settle` sets the limit.
fn limit_ours(limit: Duration) {
    let us = libc::rlim_t::try_from(limit.as_micros()).unwrap_or(libc::RLIM_INFINITY);
    // SAFETY: reads and lowers a limit of this process, through a value of our own.
    unsafe {
        let mut ours = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
        if libc::getrlimit(libc::RLIMIT_RTTIME, &mut ours) == 0 && ours.rlim_cur > us {
            ours.rlim_cur = us;
            libc::setrlimit(libc::RLIMIT_RTTIME, &ours);
        }
    }
}

/// Sets attributes that a spawn cannot set: the cores of the main thread of this process (because the starting thread may be pinned), and
/// the exact limit, if the limit of this process is lower or has a different hard limit. The new process may already be running by then.
fn settle(pid: libc::pid_t, real_time_max: Option<Duration>) -> io::Result<()> {
    // SAFETY: sets of our own; a process that has ended already is left alone.
    unsafe {
        let mut cores: libc::cpu_set_t = std::mem::zeroed();
        if libc::sched_getaffinity(libc::getpid(), size_of::<libc::cpu_set_t>(), &mut cores) == 0 {
            libc::sched_setaffinity(pid, size_of::<libc::cpu_set_t>(), &cores);
        }
    }
    let Some(limit) = real_time_max else { return Ok(()) };
    let us = libc::rlim_t::try_from(limit.as_micros()).unwrap_or(libc::RLIM_INFINITY);
    let limit = libc::rlimit { rlim_cur: us, rlim_max: us.saturating_add(1_000_000) };
    // SAFETY: reads a value of our own.
    match unsafe { libc::prlimit(pid, libc::RLIMIT_RTTIME, &limit, std::ptr::null_mut()) } {
        0 => Ok(()),
        _ if io::Error::last_os_error().raw_os_error() == Some(libc::ESRCH) => Ok(()),
        _ => Err(io::Error::last_os_error()),
    }
}

/// Error: a process could not be started.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LaunchError {
    /// Command line of the process.
    pub command: String,
    /// Human-readable description of the problem.
    pub problem: String,
}

impl fmt::Display for LaunchError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "cannot start '{}': {}", self.command, self.problem)
    }
}

impl std::error::Error for LaunchError {}
