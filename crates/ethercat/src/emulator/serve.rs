// SPDX-License-Identifier: Apache-2.0
//! Answers the frames on an interface with an emulated segment, in a thread or as a separate process.
use super::options::DriveOptions;
use super::segment::Segment;
use crate::frames::FRAME_MAX;
use crate::link::{Link, Sender};
use cia402::DriveState;
use cia402::emulated;
use scheduling::Children;
use serde::Deserialize;
use serde_json::{Value, json};
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Interval at which a server checks whether it must stop.
const NOTICE: Duration = Duration::from_millis(50);
/// Priority of a segment's thread, above that of the sources of a system.
const PRIORITY: u8 = 90;

/// A segment that answers frames until it is dropped.
pub type Server = emulated::Server<Segment>;

/// Answers frames on an interface, or on a local socket (`local:NAME`), in a separate thread.
///
/// # Errors
/// Fails if the interface does not exist, or if the process lacks the privileges to use it.
pub fn serve(interface: &str, segment: Segment) -> io::Result<Server> {
    let start = Instant::now();
    // Time begins at 1 s, so that no time is 0.
    let time = move || start.elapsed().as_nanos() as u64 + 1_000_000_000;
    serve_by(interface, segment, time, Idle::GoesOn)
}

/// Serves as [`serve`] does, but takes the time of each frame from `time`, in ns; this time must never decrease. A test then does not
/// depend on the system load.
///
/// # Errors
/// Fails as [`serve`] does.
pub fn serve_at(interface: &str, segment: Segment, time: impl FnMut() -> u64 + Send + 'static) -> io::Result<Server> {
    serve_by(interface, segment, time, Idle::Stands)
}

/// Behaviour of a segment's time when no frames arrive.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Idle {
    /// Time elapses, and drives detect the lack of commands, as real drives do.
    GoesOn,
    Stands,
}

fn serve_by(interface: &str, segment: Segment, time: impl FnMut() -> u64 + Send + 'static, idle: Idle) -> io::Result<Server> {
    let link = Link::answering(interface)?;
    Server::start("ethercat-segment", segment, move |of, until| answer(&link, of, until, time, idle))
}

fn answer(link: &Link, segment: &Mutex<Segment>, stop: &AtomicBool, mut time: impl FnMut() -> u64, idle: Idle) {
    // Above the threads that wait for it, if permitted: it represents hardware, which is never late.
    let _granted = scheduling::prioritise(PRIORITY, Children::Ordinary);
    let mut frame = [0; FRAME_MAX];
    let mut sender = Sender::nobody();
    while !stop.load(Ordering::Relaxed) {
        if !link.wait(NOTICE) {
            if idle == Idle::GoesOn {
                segment.lock().unwrap_or_else(PoisonError::into_inner).go_on(time());
            }
            continue;
        }
        match link.receive_from(&mut frame, &mut sender) {
            Ok(Some(len)) => {
                let now_ns = time();
                // The lock is held until the frame is answered: a test that sees that a frame was counted knows that its answer exists.
                let mut segment = segment.lock().unwrap_or_else(PoisonError::into_inner);
                if segment.pass(&mut frame[..len], now_ns) {
                    link.answer(&frame[..len], &sender);
                }
            }
            Ok(None) => {}
            // The interface is temporarily down.
            Err(_) => std::thread::sleep(NOTICE),
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Options {
    interface: String,
    drives: Vec<DriveOptions>,
}

/// Command to a segment, one per line.
#[derive(Deserialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
enum Order {
    Cut { position: usize },
    Heal,
    Power { position: usize, on: bool },
    Swap { position: usize, other: usize },
    Lose { frames: u64 },
    Spoil { frames: u64 },
    Fail { position: usize, error: u16 },
    EnableInput { position: usize, closed: bool },
    Put { position: usize, input: usize, value: i64 },
    Show,
}

/// Main function of a process that emulates a segment. The first line of its input contains its options, `{"interface": "veth1",
/// "drives": [{"name": "x"}]}`; each subsequent line is a command, `{"do": "cut", "position": 1}`, which the process answers with one
/// line that contains the state of the segment. The process exits when its input ends.
///
/// # Errors
/// Fails with a message.
pub fn run() -> Result<(), String> {
    let start =
        |options: Options| serve(&options.interface, Segment::new(&options.drives)).map_err(|error| format!("interface '{}': {error}", options.interface));
    emulated::serve_orders(start, carry_out, |segment| show(segment))
}

fn carry_out(segment: &mut Segment, order: &Order) {
    match *order {
        Order::Cut { position } => segment.cut(position),
        Order::Heal => segment.heal(),
        Order::Power { position, on } => segment.power(position, on),
        Order::Swap { position, other } => segment.swap(position, other),
        Order::Lose { frames } => segment.lose(frames),
        Order::Spoil { frames } => segment.spoil(frames),
        Order::Fail { position, error } => segment.fail(position, error),
        Order::EnableInput { position, closed } => segment.set_enable_input(position, closed),
        Order::Put { position, input, value } => segment.put(position, input, value),
        Order::Show => {}
    }
}

fn show(segment: &Segment) -> Value {
    let drives = (0..segment.len()).filter(|position| segment.carried(*position).is_none()).map(|position| {
        let number = |index| segment.number(position, index);
        let drive = DriveState::of(number(0x6041) as u16).to_string();
        json!({ "state": segment.status(position), "drive": drive, "position": number(0x6064), "target": number(0x607A), "mode": number(0x6061), "error": number(0x603F) as u16, "clock": segment.synced(position) })
    });
    let terminals = (0..segment.len()).filter_map(|position| {
        let outputs = segment.carried(position)?;
        Some(json!({ "position": position, "state": segment.status(position), "outputs": outputs }))
    });
    json!({ "counts": segment.counts(), "drives": drives.collect::<Vec<_>>(), "terminals": terminals.collect::<Vec<_>>() })
}
