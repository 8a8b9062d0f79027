// SPDX-License-Identifier: Apache-2.0
//! Serves an emulated bus, in a thread of this process or as a separate process that receives commands.
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use std::io::{self, BufRead, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

/// A bus that answers frames until it is dropped.
pub struct Server<B> {
    bus: Arc<Mutex<B>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl<B: Send + 'static> Server<B> {
    /// Runs `answer` for the bus on a new thread called `name`. Dropping the server signals `answer` to stop and joins the thread.
    pub fn start(name: &str, bus: B, answer: impl FnOnce(&Mutex<B>, &AtomicBool) + Send + 'static) -> io::Result<Server<B>> {
        let (bus, stop) = (Arc::new(Mutex::new(bus)), Arc::new(AtomicBool::new(false)));
        let (of, until) = (bus.clone(), stop.clone());
        let thread = std::thread::Builder::new().name(name.into()).spawn(move || answer(&of, &until))?;
        Ok(Server { bus, stop, thread: Some(thread) })
    }
}

impl<B> Server<B> {
    /// Locks the bus so that it can be changed or inspected.
    pub fn lock(&self) -> MutexGuard<'_, B> {
        self.bus.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<B> Drop for Server<B> {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Main function of a process that emulates a bus. `serve` starts the bus from its options, which are the first line of the input. Each
/// subsequent line is a command; `carry_out` executes it on the bus, and the process answers it with a line that `show` creates. The
/// process exits when its input ends.
///
/// # Errors
/// Fails with a message if the options are invalid or the bus cannot be served.
pub fn serve_orders<B, Options: DeserializeOwned, Order: DeserializeOwned>(
    serve: impl FnOnce(Options) -> Result<Server<B>, String>,
    carry_out: impl Fn(&mut B, &Order),
    show: impl Fn(&mut B) -> Value,
) -> Result<(), String> {
    let mut lines = io::stdin().lock().lines().map_while(Result::ok);
    let options = serde_json::from_str(&lines.next().unwrap_or_default()).map_err(|error| format!("the options of the bus: {error}"))?;
    let server = serve(options)?;
    say(&show(&mut server.lock()));
    for line in lines {
        match serde_json::from_str(&line) {
            Ok(order) => {
                let mut bus = server.lock();
                carry_out(&mut bus, &order);
                say(&show(&mut bus));
            }
            Err(error) => say(&json!({ "refused": error.to_string() })),
        }
    }
    Ok(())
}

fn say(what: &Value) {
    let mut out = io::stdout().lock();
    // The program that started it may have exited; then its input ends too.
    let _ = writeln!(out, "{what}").and_then(|()| out.flush());
}
