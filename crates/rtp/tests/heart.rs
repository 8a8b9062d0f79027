// SPDX-License-Identifier: Apache-2.0
//! The heart of a processor beats whatever happens to its commander; a processor that is silent for too long is lost.
use interconnect::{Link, LinkClosed};
use modules::Probe;
use opengpac::abi::ABI;
use rtp::protocol::{Order, VERSION, frame};
use rtp::{Service, Terms};
use std::collections::VecDeque;
use std::ffi::OsString;
use std::sync::mpsc::channel;
use std::sync::{Arc, Condvar, Mutex};
use std::time::Duration;

/// Safety limit for a busy machine, not a measure.
const NET: Duration = Duration::from_secs(300);

/// A commander that sends a few frames and then stalls: only the first frame sent to it is accepted.
struct Still {
    said: Mutex<VecDeque<Vec<u8>>>,
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    taken: usize,
    is_closed: bool,
}

impl Still {
    fn after(orders: &[Order]) -> Arc<Still> {
        let greeting = Order::Greet { version: VERSION, abi: ABI, system: "s".into(), processor: "p".into(), epoch_ns: 0 };
        let said = std::iter::once(&greeting).chain(orders).map(frame).collect();
        Arc::new(Still { said: Mutex::new(said), state: Mutex::default(), changed: Condvar::new() })
    }
}

impl Link for Still {
    fn send(&self, _: &[u8]) -> Result<(), LinkClosed> {
        let mut state = self.state.lock().unwrap();
        state.taken += 1;
        if state.taken > 1 {
            state = self.changed.wait_while(state, |state| !state.is_closed).unwrap();
        }
        if state.is_closed { Err(LinkClosed) } else { Ok(()) }
    }

    fn receive(&self, limit: Duration) -> Result<Option<Vec<u8>>, LinkClosed> {
        if let Some(frame) = self.said.lock().unwrap().pop_front() {
            return Ok(Some(frame));
        }
        let state = self.changed.wait_timeout_while(self.state.lock().unwrap(), limit, |state| !state.is_closed).unwrap().0;
        if state.is_closed { Err(LinkClosed) } else { Ok(None) }
    }

    fn close(&self) {
        self.state.lock().unwrap().is_closed = true;
        self.changed.notify_all();
    }
}

fn terms(beat: impl Fn(Option<usize>) + Send + Sync + 'static) -> Terms {
    Terms { beat: Arc::new(beat), ..Terms::new(Probe::of(Vec::<OsString>::new())) }
}

#[test]
fn a_side_that_takes_nothing_does_not_stop_the_heart() {
    let link = Still::after(&[]);
    let (beats, counted) = channel();
    let commands: Arc<dyn Link> = link.clone();
    let serving = std::thread::spawn(move || {
        rtp::serve(
            &commands,
            Service::new(terms(move |_| {
                // The counter may already have stopped listening.
                let _counted = beats.send(());
            })),
        )
    });
    for beat in 0..20 {
        counted.recv_timeout(NET).unwrap_or_else(|_| panic!("no beat {beat}: the heart waits for who does not read"));
    }
    assert!(link.state.lock().unwrap().taken > 1, "something was told, and not taken");
    link.close();
    serving.join().unwrap().unwrap();
}

#[test]
fn a_side_that_says_nothing_for_its_patience_is_lost() {
    let link = Still::after(&[Order::Patience { ms: 0, silence_ms: 200, standstill_ms: None }]);
    let commands: Arc<dyn Link> = link.clone();
    let (ended, told) = channel();
    std::thread::spawn(move || ended.send(rtp::serve(&commands, Service::new(terms(|_| ())))).is_ok());
    told.recv_timeout(NET).expect("it ends by itself").unwrap();
    assert!(link.state.lock().unwrap().is_closed, "so that the other side learns of it when it goes on");
}

#[test]
fn a_process_that_nobody_watches_any_more_stops_its_heart() {
    let link = Still::after(&[Order::Patience { ms: 200, silence_ms: 60_000, standstill_ms: None }]);
    let commands: Arc<dyn Link> = link.clone();
    let (says, said) = channel();
    let also = says.clone();
    let beat = move |_| also.send("beat").expect("the test is there");
    let unwatched = move |patience: Duration| {
        assert_eq!(patience, Duration::from_secs(60));
        says.send("alone").expect("the test is there");
        true
    };
    let serving = std::thread::spawn(move || rtp::serve(&commands, Service::new(Terms { unwatched: Arc::new(unwatched), ..terms(beat) })));
    // The processor may beat until it knows how long its watcher may stall.
    while said.recv_timeout(NET).expect("it is asked") == "beat" {}
    link.close();
    serving.join().unwrap().unwrap();
    assert_eq!(said.iter().next(), None, "asked once, and no beat more");
}
