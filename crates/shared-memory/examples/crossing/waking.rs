// SPDX-License-Identifier: Apache-2.0
//! Rows that wake the reader's process, timed up to the call that raises the reader.
use crate::compare;
use crate::far::{Far, commands};
use crate::place::{bare, core, now_ns, pin, rest, run};
use crate::report::median;
use crate::wires::{name, participant};
use iceoryx2::port::notifier::Notifier;
use iceoryx2::prelude::*;
use interconnect::{ConnectionSpec, Ends, Sender};
use shared_memory::SharedMemory;
use std::sync::atomic::{AtomicI64, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};

const ROWS: usize = 200;
/// Pause between two rows, during which the reader goes to sleep.
const PAUSE_NS: i64 = 200_000;
const SPEC: ConnectionSpec = ConnectionSpec { writer: 0, reader: 1, asynchronous_len: 0, queue_row_len: 8, queue_depth: 4 };
/// Number of the connection, distinct from the numbers used in `polled`.
const CONNECTION: u64 = 9;

/// Memory in which the far side records the time at which it was woken.
struct Woken {
    at_ns: AtomicI64,
    count: AtomicU32,
    /// Word on which the bare futex sleeps.
    rings: AtomicU32,
}

fn woken(kind: &str, run: u64) -> &'static Woken {
    // SAFETY: mapped permanently, and made of atomic words, for which any bytes are valid.
    unsafe { bare(&format!("woken-{kind}"), 64, run).cast().as_ref() }
}

impl Woken {
    fn mark(&self) {
        self.at_ns.store(now_ns(), Ordering::Relaxed);
        self.count.fetch_add(1, Ordering::Release);
    }

    fn futex(&self, operation: i32, value: u32) {
        // SAFETY: waits on, or wakes, a word that outlives the call.
        unsafe { libc::syscall(libc::SYS_futex, self.rings.as_ptr(), operation, value, std::ptr::null::<libc::timespec>()) };
    }
}

/// Wakes the far side repeatedly and returns the median latency, ns.
fn burst(far: &mut Far, woken: &Woken, mut wake: impl FnMut()) -> f64 {
    far.tell(ROWS as u64);
    rest(10 * PAUSE_NS);
    median((0..ROWS).map(|_| {
        let (before, began) = (woken.count.load(Ordering::Acquire), now_ns());
        wake();
        while woken.count.load(Ordering::Acquire) == before {
            rest(PAUSE_NS);
        }
        rest(PAUSE_NS);
        (woken.at_ns.load(Ordering::Relaxed) - began) as f64
    }))
}

fn events(run: u64) -> Notifier<ipc::Service> {
    let service = participant(run).service_builder(&name(&format!("crossing/{run:x}/woken"))).event().open_or_create().expect("the service is free");
    service.notifier_builder().create().expect("there is room")
}

pub fn between_processes(rounds: usize) {
    pin(core() - 1);
    let run = run();
    let far = |kind| Far::process(kind, 0, run);
    let (mut ours, mut futex, mut event) = (far("rows"), far("futex"), far("event"));
    let mut sender: Box<dyn Sender> = SharedMemory::new("crossing", run).and_then(|mut ends| ends.sender(CONNECTION, &SPEC)).expect("the end is free");
    let (of_rows, of_futex, of_event, notifier) = (woken("rows", run), woken("futex", run), woken("event", run), events(run));
    let mut turns = Vec::new();
    for round in 0..=rounds {
        let push = || sender.push(0, 0, &mut |row| row.fill(1)).expect("the far side has taken all rows before");
        let bare = || {
            of_futex.rings.fetch_add(1, Ordering::Release);
            of_futex.futex(libc::FUTEX_WAKE, 1);
        };
        let notify = || {
            notifier.notify().expect("the service lives");
        };
        let turn = (burst(&mut ours, of_rows, push), burst(&mut event, of_event, notify), burst(&mut futex, of_futex, bare));
        if round > 0 {
            turns.push(turn);
        }
    }
    let beside = |of: fn(&(f64, f64, f64)) -> f64| turns.iter().map(|turn| (turn.0, of(turn))).collect::<Vec<_>>();
    let (what, note) = ("row to another process, waking it", "from before the push to the call that raises the reader");
    compare("processes", what, "iceoryx2 event", &beside(|turn| turn.1), Some((1.5, "≤ 1.5 ×")), note);
    compare("processes", what, "bare futex", &beside(|turn| turn.2), Some((1.5, "≤ 1.5 ×")), note);
}

/// Runs the far side of the given kind.
pub fn serve(kind: &str, run: u64) {
    let woken = woken(kind, run);
    match kind {
        "rows" => {
            let mut ends = SharedMemory::new("crossing", run).expect("there is shared memory");
            let reading: Arc<Mutex<Option<Box<dyn interconnect::Receiver>>>> = Arc::default();
            let taking = reading.clone();
            let raise = move || {
                woken.mark();
                taking.lock().expect("nobody panics with it").as_mut().expect("it was put there before the first command").pop_row();
            };
            let receiver = ends.receiver(CONNECTION, &SPEC, Box::new(raise)).expect("the end is free");
            *reading.lock().expect("nobody panics with it") = Some(receiver);
            commands(|_| ());
            // Taken out before it is dropped, because the thread that raises may be waiting for the lock.
            let receiver = reading.lock().expect("nobody panics with it").take();
            drop(receiver);
        }
        "futex" => commands(|count| {
            for _ in 0..count {
                let rings = woken.count.load(Ordering::Relaxed);
                while woken.rings.load(Ordering::Acquire) == rings {
                    woken.futex(libc::FUTEX_WAIT, rings);
                }
                woken.mark();
            }
        }),
        "event" => {
            let service = participant(run).service_builder(&name(&format!("crossing/{run:x}/woken"))).event().open_or_create().expect("the service is free");
            let listener = service.listener_builder().create().expect("there is room");
            commands(|count| {
                for _ in 0..count {
                    let mut heard = false;
                    while !heard {
                        listener.blocking_wait(|_| heard = true).expect("the service lives");
                    }
                    woken.mark();
                }
            });
        }
        other => panic!("there is no far side '{other}'"),
    }
}
