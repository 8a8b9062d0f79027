// SPDX-License-Identifier: Apache-2.0
//! Lanes: threads and shares for each kind of request, so that lasting or costly requests delay only requests of their own kind, and
//! calls that stop something wait for none of them.
//!
//! | lane | requests | threads | one caller at a time | all |
//! |---|---|---|---|---|
//! | stop | calls that stop, and those that lead to one | its own 32 | 8, an emergency stop unbounded | 16 |
//! | wait | calls that last, in slices of at most 1 s | shared | 24 | 128, 32 of them for `operate` and above |
//! | costly | checks of definitions, histories and large listings | its own 2, with lower priority | 1, and 7 that wait for it | 2, and 46 that wait |
//! | usual | everything else | shared | 8, the others wait for their turn | 32 |
//!
//! A brief call (`Call::brief`) runs on the thread that received it, and a lasting one starts there, because waking a thread of the lane
//! would take longer than the call. Meanwhile the runtime serves its other connections on another thread.
use crate::caller::Caller;
use crate::calls::Call;
use crate::failure::{Failure, Ground};
use crate::rates::Rates;
use crate::shares::{Share, Shares, Turns};
use model::refusal::Class;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::Duration;
use tokio::runtime::{Builder, Handle, Runtime, RuntimeFlavor};
use tokio::sync::Semaphore;
use tokio::task::block_in_place;

/// Maximum number of concurrent waits, in total and per caller.
const WAITS_MAX: usize = 128;
const WAITS_EACH_MAX: usize = 24;
/// Number of waits reserved for roles that may command and stop.
const WAITS_KEPT: usize = 32;
/// Maximum number of concurrent calls that stop something, in total and per caller, and number of their threads. The remaining threads
/// are for emergency stops.
const STOPS_MAX: usize = 16;
const STOPS_EACH_MAX: usize = 8;
const STOP_THREADS: usize = 2 * STOPS_MAX;
/// Maximum number of costly calls, including those waiting for their turn, in total and per caller, and maximum number executed
/// concurrently.
const COSTLY_MAX: usize = 48;
const COSTLY_EACH_MAX: usize = 8;
const COSTLY_THREADS: usize = 2;
/// Amount by which the priority of the threads for costly calls is lowered.
const COSTLY_NICE: i32 = 10;
/// Maximum number of usual calls executed concurrently, in total and per caller.
const USUAL_MAX: usize = 32;
const USUAL_EACH_MAX: usize = 8;
/// Maximum number of subscriptions to scopes, in total and per caller. Each has rings of values in every source.
const SCOPES_MAX: usize = 64;
const SCOPES_EACH_MAX: usize = 32;
/// Maximum total size of incoming bodies and outgoing answers larger than [`SMALL`], bytes.
const BODIES_MAX: usize = 24 << 20;
const BODIES_EACH_MAX: usize = 8 << 20;
const ANSWERS_MAX: usize = 48 << 20;
const ANSWERS_EACH_MAX: usize = 16 << 20;
/// Size up to which bodies and answers are limited only by the number of connections, bytes.
pub const SMALL: usize = 64 << 10;
/// Number of threads for calls in the runtime that serves connections: waits, scopes under the virtual clock, usual calls, and the
/// daemon's own checks.
const SHARED_THREADS: usize = WAITS_MAX + SCOPES_MAX + USUAL_MAX + 16;

/// Time for which the receiving thread waits for a lasting call, equal to one period at 1 kHz.
pub const BRIEF: Duration = Duration::from_millis(1);

/// Lane in which a request waits and runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lane {
    /// Lane for emergency stops, which always have a thread and are never limited.
    Emergency,
    Stop,
    Wait,
    Costly,
    Usual,
    /// Lane like the usual one, but its calls run on the thread that received them.
    Brief,
}

impl Lane {
    /// Returns the lane of a call. A call that stops something starts in the stop lane; the wait for its end is treated like any other.
    pub fn of(call: &Call) -> Lane {
        match call {
            call if call.stops_all => Lane::Emergency,
            call if call.stops => Lane::Stop,
            call if call.lasts => Lane::Wait,
            call if call.costs => Lane::Costly,
            call if call.brief => Lane::Brief,
            _ => Lane::Usual,
        }
    }
}

/// Threads on which calls run.
enum Threads {
    Own(Handle),
    /// Threads of the runtime that serves the request.
    Here,
}

impl Threads {
    fn spawn<T: Send + 'static>(&self, run: impl FnOnce() -> T + Send + 'static) -> tokio::task::JoinHandle<T> {
        match self {
            Threads::Own(handle) => handle.spawn_blocking(run),
            Threads::Here => tokio::task::spawn_blocking(run),
        }
    }
}

/// Runtimes of a server. Dropping one does not wait for sleeping threads.
pub struct Runtimes {
    pub serving: Runtime,
    stops: Runtime,
    costly: Runtime,
}

impl Runtimes {
    pub fn start() -> std::io::Result<Runtimes> {
        let apart = |name: &str, threads| {
            let mut builder = Builder::new_multi_thread();
            builder.worker_threads(1).max_blocking_threads(threads).thread_name(name);
            builder
        };
        let lower = || {
            // If this is refused, they keep their priority.
            let _refused = rustix::process::nice(COSTLY_NICE);
        };
        let serving = Builder::new_multi_thread().worker_threads(2).max_blocking_threads(SHARED_THREADS).thread_name("control").enable_all().build()?;
        Ok(Runtimes {
            serving,
            stops: apart("control stops", STOP_THREADS).build()?,
            costly: apart("control checks", COSTLY_THREADS).on_thread_start(lower).build()?,
        })
    }

    /// Shuts down all runtimes; anything still running afterwards is abandoned.
    pub fn end(self, within: Duration) {
        self.serving.shutdown_timeout(within);
        self.stops.shutdown_background();
        self.costly.shutdown_background();
    }
}

/// Lanes of a served system.
pub struct Lanes {
    stop_threads: Threads,
    costly_threads: Threads,
    stops: Arc<Shares>,
    waits: Arc<Shares>,
    costly: Arc<Shares>,
    pub scopes: Arc<Shares>,
    pub bodies: Arc<Shares>,
    pub answers: Arc<Shares>,
    costly_turns: Turns,
    costly_all: Arc<Semaphore>,
    usual_turns: Turns,
    usual_all: Arc<Semaphore>,
    /// Rates of stopping requests, per caller.
    pub stop_rates: Rates,
}

impl Lanes {
    /// Creates the lanes. They have their own threads if runtimes are passed; otherwise they use the threads of the server.
    pub fn new(on: Option<&Runtimes>) -> Arc<Lanes> {
        let threads = |of: fn(&Runtimes) -> &Runtime| on.map_or(Threads::Here, |on| Threads::Own(of(on).handle().clone()));
        Arc::new(Lanes {
            stop_threads: threads(|on| &on.stops),
            costly_threads: threads(|on| &on.costly),
            stops: Shares::new("calls that stop", STOPS_MAX, STOPS_EACH_MAX, 0),
            waits: Shares::new("waits", WAITS_MAX, WAITS_EACH_MAX, WAITS_KEPT),
            costly: Shares::new("checks, histories and listings", COSTLY_MAX, COSTLY_EACH_MAX, COSTLY_EACH_MAX),
            scopes: Shares::new("scopes", SCOPES_MAX, SCOPES_EACH_MAX, SCOPES_EACH_MAX / 4),
            bodies: Shares::new("bytes of bodies in transfer", BODIES_MAX, BODIES_EACH_MAX, BODIES_EACH_MAX),
            answers: Shares::new("bytes of unread answers", ANSWERS_MAX, ANSWERS_EACH_MAX, ANSWERS_EACH_MAX),
            costly_turns: Turns::new(1),
            costly_all: Arc::new(Semaphore::new(COSTLY_THREADS)),
            usual_turns: Turns::new(USUAL_EACH_MAX),
            usual_all: Arc::new(Semaphore::new(USUAL_MAX)),
            stop_rates: Rates::new(500.0, 500.0),
        })
    }

    /// Admits a caller's request to its lane, before its body is read. Fails with `LimitExceeded`.
    pub fn enter(self: &Arc<Lanes>, lane: Lane, caller: &Caller) -> Result<LaneTicket, Failure> {
        let share = match lane {
            Lane::Stop => Some(self.stops.take(caller, 1)?),
            Lane::Wait => Some(self.waits.take(caller, 1)?),
            Lane::Costly => Some(self.costly.take(caller, 1)?),
            Lane::Emergency | Lane::Usual | Lane::Brief => None,
        };
        Ok(LaneTicket { lanes: self.clone(), lane, who: caller.who.clone(), share })
    }
}

/// A request in its lane.
pub struct LaneTicket {
    lanes: Arc<Lanes>,
    lane: Lane,
    who: String,
    share: Option<Share>,
}

impl LaneTicket {
    /// Runs the request on a thread of its lane when its turn comes. It keeps its resources until it is complete, even if no caller is
    /// waiting for it any longer.
    pub async fn run<T: Send + 'static>(self, run: impl FnOnce() -> Result<T, Failure> + Send + 'static) -> Result<T, Failure> {
        let LaneTicket { lanes, lane, who, share } = self;
        let turn = match lane {
            Lane::Costly => Some((lanes.costly_turns.take(&who).await, lanes.costly_all.clone().acquire_owned().await)),
            Lane::Usual | Lane::Brief => Some((lanes.usual_turns.take(&who).await, lanes.usual_all.clone().acquire_owned().await)),
            Lane::Emergency | Lane::Stop | Lane::Wait => None,
        };
        let run = move || {
            let _until_done = (share, turn);
            run()
        };
        let running = match lane {
            Lane::Emergency | Lane::Stop => lanes.stop_threads.spawn(run),
            Lane::Costly => lanes.costly_threads.spawn(run),
            Lane::Wait | Lane::Usual => Threads::Here.spawn(run),
            Lane::Brief => return in_place(run),
        };
        running.await.map_err(|_| failed_inside())?
    }

    /// Starts a brief lasting call on the receiving thread; `run` continues it.
    pub fn begin<T>(&self, run: impl FnOnce() -> Result<T, Failure>) -> Result<T, Failure> {
        in_place(run)
    }
}

/// Runs a brief call on the thread of the connection. Another thread takes over the other connections of this thread, so that an
/// unexpected delay (the lock of the core is held, the disk of the audit file is slow) affects only this connection.
fn in_place<T>(run: impl FnOnce() -> Result<T, Failure>) -> Result<T, Failure> {
    let run = || catch_unwind(AssertUnwindSafe(run));
    let ran = match Handle::current().runtime_flavor() {
        RuntimeFlavor::CurrentThread => run(),
        _ => block_in_place(run),
    };
    ran.map_err(|_| failed_inside())?
}

fn failed_inside() -> Failure {
    Failure::new(Class::InvalidState, "internal error in OpenGPAC", "please report it, and include the call that caused it").ground(Ground::Internal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use std::sync::mpsc;
    use tokio::io::AsyncReadExt;

    fn served() -> Runtime {
        Builder::new_multi_thread().worker_threads(1).enable_all().build().expect("a runtime")
    }

    #[test]
    fn a_brief_call_that_is_held_up_holds_up_no_other_connection() {
        let (let_go, held) = mpsc::channel();
        let (began, begun) = mpsc::channel();
        let (mut stop, connection) = std::os::unix::net::UnixStream::pair().expect("two ends");
        let runtime = served();
        runtime.spawn(async move {
            connection.set_nonblocking(true).expect("it can be set");
            let mut connection = tokio::net::UnixStream::from_std(connection).expect("an end");
            let _stop = connection.read_u8().await;
            let_go.send(()).expect("the call is held up");
        });
        let brief = runtime.spawn(async move {
            in_place(|| {
                began.send(()).expect("the test listens");
                Ok(held.recv_timeout(Duration::from_mins(1)).is_ok())
            })
        });
        begun.recv().expect("the call has begun");
        stop.write_all(b"!").expect("room");
        assert!(runtime.block_on(brief).expect("no panic").expect("an answer"), "the only thread is held up, and the other connection is served");
    }

    #[test]
    fn a_call_that_panics_where_it_came_in_is_told() {
        let failed = served().block_on(async { tokio::spawn(async { in_place::<()>(|| panic!("a fault of ours")) }).await });
        assert_eq!(failed.expect("the connection goes on").expect_err("it failed").class(), Class::InvalidState);
    }
}
