// SPDX-License-Identifier: Apache-2.0
//! Answers the frames of an interface with an emulated segment: in a thread, or as a process of its own.
use super::options::DriveOptions;
use super::segment::Segment;
use crate::link::{Link, Sender};
use crate::wire::FRAME_MAX;
use serde::Deserialize;
use serde_json::{Value, json};
use std::io::{self, BufRead, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How soon a server notices that it is to stop.
const NOTICE: Duration = Duration::from_millis(50);
/// Above the sources of a system.
const PRIORITY: i32 = 90;

/// A segment that answers until it is dropped.
pub struct Server {
    segment: Arc<Mutex<Segment>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Server {
    /// The segment, to do something to it or to look at it.
    pub fn segment(&self) -> MutexGuard<'_, Segment> {
        self.segment.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Answers on an interface, or on a local socket (`local:NAME`), in a thread of its own.
///
/// # Errors
/// There is no such interface, or no right to use it.
pub fn serve(interface: &str, segment: Segment) -> io::Result<Server> {
    let start = Instant::now();
    // Begun at 1 s, so that no time is 0.
    serve_at(interface, segment, move || start.elapsed().as_nanos() as u64 + 1_000_000_000)
}

/// As [`serve`], at times of one's own: asked for each frame that comes, ns, never less than before. A test then depends on no load.
///
/// # Errors
/// As [`serve`].
pub fn serve_at(interface: &str, segment: Segment, time: impl FnMut() -> u64 + Send + 'static) -> io::Result<Server> {
    let link = Link::answering(interface)?;
    let segment = Arc::new(Mutex::new(segment));
    let stop = Arc::new(AtomicBool::new(false));
    let (of, until) = (segment.clone(), stop.clone());
    let thread = std::thread::Builder::new().name("ethercat-segment".into()).spawn(move || answer(&link, &of, &until, time))?;
    Ok(Server { segment, stop, thread: Some(thread) })
}

fn answer(link: &Link, segment: &Mutex<Segment>, stop: &AtomicBool, mut time: impl FnMut() -> u64) {
    take_priority();
    let mut frame = [0; FRAME_MAX];
    let mut sender = Sender::nobody();
    while !stop.load(Ordering::Relaxed) {
        if !link.wait(NOTICE) {
            continue;
        }
        match link.receive_from(&mut frame, &mut sender) {
            Ok(Some(len)) => {
                let now_ns = time();
                // Locked until it is answered: whoever sees that a frame was counted knows that its answer is there.
                let mut segment = segment.lock().unwrap_or_else(PoisonError::into_inner);
                if segment.pass(&mut frame[..len], now_ns) {
                    link.answer(&frame[..len], &sender);
                }
            }
            Ok(None) => {}
            // The interface is down for a while.
            Err(_) => std::thread::sleep(NOTICE),
        }
    }
}

/// A segment stands for hardware, which is never late: its thread goes before those that wait for it, where the right is given.
fn take_priority() {
    let wanted = libc::sched_param { sched_priority: PRIORITY };
    // SAFETY: it is told where the struct lies; 0 is this thread. Without the right it stays as it is.
    unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const wanted) };
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Options {
    interface: String,
    drives: Vec<DriveOptions>,
}

/// What can be done to a segment, a line each.
#[derive(Deserialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
enum Order {
    Cut { position: usize },
    Heal,
    Power { position: usize, on: bool },
    Lose { frames: u64 },
    Spoil { frames: u64 },
    Fail { position: usize, error: u16 },
    Show,
}

/// What a process runs that is a segment: its options are the first line of its input, `{"interface": "veth1", "drives": [{"name": "x"}]}`;
/// then each line is an order, `{"do": "cut", "position": 1}`, answered by a line that shows the segment. It ends with its input.
///
/// # Errors
/// For people.
pub fn run() -> Result<(), String> {
    let mut lines = io::stdin().lock().lines().map_while(Result::ok);
    let options: Options = serde_json::from_str(&lines.next().unwrap_or_default()).map_err(|error| format!("the options of the segment: {error}"))?;
    let server = serve(&options.interface, Segment::new(&options.drives)).map_err(|error| format!("interface '{}': {error}", options.interface))?;
    say(&show(&server.segment()));
    for line in lines {
        match serde_json::from_str(&line) {
            Ok(order) => {
                let mut segment = server.segment();
                carry_out(&mut segment, &order);
                say(&show(&segment));
            }
            Err(error) => say(&json!({ "refused": error.to_string() })),
        }
    }
    Ok(())
}

fn carry_out(segment: &mut Segment, order: &Order) {
    match *order {
        Order::Cut { position } => segment.cut(position),
        Order::Heal => segment.heal(),
        Order::Power { position, on } => segment.power(position, on),
        Order::Lose { frames } => segment.lose(frames),
        Order::Spoil { frames } => segment.spoil(frames),
        Order::Fail { position, error } => segment.fail(position, error),
        Order::Show => {}
    }
}

fn show(segment: &Segment) -> Value {
    let drives = (0..segment.len()).map(|position| {
        let number = |index| segment.number(position, index);
        let drive = crate::cia402::DriveState::of(number(0x6041) as u16).to_string();
        json!({ "state": segment.status(position), "drive": drive, "position": number(0x6064), "target": number(0x607A), "mode": number(0x6061), "error": number(0x603F) as u16, "clock": segment.synced(position) })
    });
    json!({ "counts": segment.counts(), "drives": drives.collect::<Vec<_>>() })
}

fn say(what: &Value) {
    let mut out = io::stdout().lock();
    // Whoever started it may be gone; then its input ends too.
    let _ = writeln!(out, "{what}").and_then(|()| out.flush());
}
