// SPDX-License-Identifier: Apache-2.0
//! Creation and closing of a system.
use crate::core::Core;
use crate::definitions::system_definitions::Definitions;
use crate::observation::companions::Companions;
use crate::precedence::{Changes, Precedence};
use crate::processors::guard::ProcessGuard;
use crate::refuse::refuse;
use crate::supervise::supervise;
use crate::system::{Post, System, SystemState, WaitResult};
use model::refusal::{Class, Refusals};
use runtime::{ClockKind, Host};
use std::os::fd::{FromRawFd, OwnedFd};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Returns the identifier of a run: its start time on the wall clock, and its process.
fn run() -> String {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    format!("{:x}-{:x}", since.as_nanos(), std::process::id())
}

impl System {
    /// Creates a system. `carrier` provides the connections between sources.
    pub fn new(name: &str, clock: ClockKind, carrier: Box<dyn interconnect::Carrier>) -> Result<System, Refusals> {
        let host = Arc::new(Host::new(clock, carrier));
        // SAFETY: eventfd has no preconditions; the result is checked below.
        let fd = unsafe { libc::eventfd(0, libc::EFD_NONBLOCK | libc::EFD_CLOEXEC) };
        if fd < 0 {
            let why = std::io::Error::last_os_error();
            return Err(refuse(Class::InvalidState, format!("cannot create an event descriptor: {why}"), "close some files and try again"));
        }
        let core = Core::new(host.clone());
        let shared = Arc::new(SystemState {
            run: run(),
            is_virtual: matches!(clock, ClockKind::Virtual { .. }),
            definitions: Mutex::new(Definitions::default()),
            stop: core.safety.emergency.stop.clone(),
            core: Precedence::new(core),
            host,
            changes: Changes::default(),
            post: Mutex::new(Post::default()),
            closing: AtomicBool::new(false),
            closed: AtomicBool::new(false),
            places: OnceLock::new(),
            companions: Mutex::new(Companions::default()),
            errands: Mutex::default(),
            guarded: ProcessGuard::default(),
            // SAFETY: `fd` was just made and has no other owner.
            ended_fd: unsafe { OwnedFd::from_raw_fd(fd) },
        });
        shared.locked().safety.alarms.has_wall = !shared.is_virtual;
        let supervisor = if shared.is_virtual { None } else { Some(supervise(&shared)?) };
        let system = System { name: name.to_owned(), shared, supervisor: Mutex::new(supervisor), owns: true };
        system.enter_library();
        Ok(system)
    }

    /// Halts the actions, disables the devices, and stops the kernels. Idempotent.
    pub fn close(&self) {
        if self.shared.closed.swap(true, Ordering::AcqRel) {
            return;
        }
        // After a panic of the supervisor no orderly end is possible: the kernels are stopped, and the devices are safe.
        let is_orderly = !self.shared.core.is_poisoned();
        let begun = Instant::now();
        let late_ns = self.now_ns().saturating_add(WIND_DOWN_NS);
        while is_orderly && begun.elapsed() < CLOSE_MAX {
            let waited = self.shared.wait_for(None, Duration::from_millis(50), |core| {
                let is_late = core.host.now_ns() >= late_ns;
                Ok(core.wind_down(is_late).then_some(()))
            });
            if matches!(waited, Ok(WaitResult::Done(())) | Err(_)) {
                break;
            }
        }
        self.end_companions();
        self.shared.closing.store(true, Ordering::Release);
        self.shared.host.unpark();
        if let Some(thread) = self.supervisor.lock().expect("nobody panics with this lock").take() {
            // A panic of the supervisor has already been reported; continue closing.
            let _ended = thread.join();
        }
        self.shared.host.close();
        self.close_remote();
        // Anyone who still holds the system, or a part of it, must not keep a descriptor, thread or name alive.
        if let Some(core) = self.shared.core.sound() {
            core.wiring.sever(&core.host);
        }
        self.shared.guarded.end();
        if let Some(places) = self.shared.places.get() {
            places.close();
        }
    }
}

impl Drop for System {
    fn drop(&mut self) {
        if self.owns {
            self.close();
        }
    }
}

/// Time limit for the command lists that follow a halt when the system is closed, ns of the system's clock.
const WIND_DOWN_NS: i64 = 2_000_000_000;

/// Time limit for an orderly close, after which the kernels are stopped regardless.
const CLOSE_MAX: Duration = Duration::from_secs(5);
