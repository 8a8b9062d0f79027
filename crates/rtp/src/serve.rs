// SPDX-License-Identifier: Apache-2.0
//! Life cycle of a processor: it serves successive commanders, and continues for a limited time between them.
use crate::agent::{Agent, ServiceEnd};
use crate::service::{AdmittedSupervisor, Caller, Door, Service};
use crate::shared::{LOOK, locked};
use interconnect::Link;
use process_kit::Silence;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// Exit status of a process that lost its commander.
const LEFT: i32 = 3;

/// Serves until the other side closes the service, or until it has disconnected and the farewells of the running processes have been
/// carried out; then devices are made safe and everything is closed. Another supervisor may take over before that.
///
/// # Errors
/// Fails with a message if there is no greeting, the version differs, or orders cannot be decoded.
pub fn serve(link: &Arc<dyn Link>, service: Service) -> Result<(), String> {
    let Service { reaches, black_box, mut door, terms } = service;
    let terms = Arc::new(terms);
    let first = AdmittedSupervisor { link: link.clone(), reaches, black_box, is_unguarded: false };
    let mut agent = Agent::hired(first, &terms, None).map_err(|(why, _)| why)?;
    let mut ended = agent.run(&mut door);
    loop {
        if let Some(before) = agent.before.take() {
            // The commander has taken nothing over, so earlier processes continue.
            let caller = agent.caller.take();
            agent.dismiss();
            (agent, ended) = (*before, ServiceEnd::Gone);
            agent.caller = caller;
        }
        if matches!(ended, ServiceEnd::Closed) {
            agent.dismiss();
            return Ok(());
        }
        // A commander that merely stood still must notice that it has lost its processor.
        agent.shared.link.close();
        agent.bid();
        match succeeded(agent, &mut door) {
            Ok(heir) => agent = heir,
            Err(left) => return leave(*left, ended, door),
        }
        ended = agent.run(&mut door);
    }
}

/// Waits for a supervisor that takes command of the continuing processes. Fails if none connects before the patience runs out.
fn succeeded(mut agent: Agent, door: &mut Option<Box<dyn Door>>) -> Result<Agent, Box<Agent>> {
    let mut silence = Silence::begins();
    while agent.goes_on {
        silence.looked(false);
        let left = agent.patience.saturating_sub(silence.lasted());
        if left.is_zero() {
            break;
        }
        let caller = match (agent.caller.take(), &mut *door) {
            (Some(caller), _) => Some(caller),
            (None, Some(door)) => door.wait(LOOK.min(left)),
            (None, None) => {
                std::thread::sleep(LOOK.min(left));
                None
            }
        };
        if let Some(caller) = caller {
            match admitted(agent, caller) {
                Ok(heir) => return Ok(heir),
                Err(back) => agent = *back,
            }
        }
    }
    if let Some(caller) = agent.caller.take() {
        caller.refuse("it is about to end");
    }
    Err(Box::new(agent))
}

/// Admits a supervisor. Fails if the supervisor has disconnected again; running processes continue.
fn admitted(agent: Agent, caller: Box<dyn Caller>) -> Result<Agent, Box<Agent>> {
    let terms = agent.terms.clone();
    let Ok(admitted) = caller.admit() else { return Err(Box::new(agent)) };
    // The other end has been given the reason, or has disconnected.
    Agent::hired(admitted, &terms, Some(Box::new(agent))).map_err(|(_, before)| before.expect("it was given"))
}

/// Ends a processor that has no commander.
fn leave(agent: Agent, ended: ServiceEnd, door: Option<Box<dyn Door>>) -> Result<(), String> {
    if agent.terms.leaves && matches!(ended, ServiceEnd::Gone) {
        // Every output is safe before it is dropped.
        agent.stop.store(true, Ordering::Release);
        drop(door);
        std::thread::sleep(LOOK);
        std::process::exit(LEFT);
    }
    agent.dismiss();
    if let ServiceEnd::Broken(message) = ended { Err(message) } else { Ok(()) }
}

impl Agent {
    /// Carries out the farewell of each process after the supervisor has disconnected; processes without one continue until the patience
    /// runs out. Values forced by a person are released, because no client is left that could see or release them.
    fn bid(&mut self) {
        locked(&self.shared.devices).values().for_each(|device| device.unforce_all());
        for ((process, source), parcel) in std::mem::take(&mut self.farewells) {
            let Some(parcel) = parcel else {
                self.goes_on = true;
                continue;
            };
            let mut reader = locked(&self.shared.reader);
            // A farewell that cannot be decoded could not be when it arrived; everything is then made safe at the end.
            let Ok(script) = reader.open(0, parcel, &mut self.ground) else { continue };
            if let Some(process) = reader.process_of(process) {
                process.take(process.now().0, true);
                self.shared.host.submit(source, script);
            }
        }
    }

    /// Ends everything that the agent created: devices are made safe and closed, except those that it has not taken over.
    fn dismiss(mut self) {
        self.hush();
        self.shared.host.close();
        self.shared.link.close();
    }

    /// Silences the agent, which then makes no further reports.
    pub fn hush(&mut self) {
        self.shared.ends.store(true, Ordering::Release);
        self.shared.host.unpark();
        for thread in self.threads.drain(..) {
            // A thread that panicked has reported it.
            let _joined = thread.join();
        }
    }
}

/// Timeout for work that each source of a processor does between two firings.
pub(crate) const BOUNDARY: Duration = Duration::from_secs(2);
