// SPDX-License-Identifier: Apache-2.0
//! Main function of a process that was started for a processor.
use crate::door::{Belongings, ProcessWatchers, SocketDoor, black_box_of};
use crate::{BLACK_BOX, GUARD, GUARD_HEART, HANDLES, HEART, LINK, PROCESSOR, RUN, SUPERVISOR_HEART, SYSTEM, text};
use guard::send_handles;
use interconnect::{Ends, Link};
use kernel::Device;
use modules::Probe;
use process_kit::{Heartbeat, UnixLink};
use rtp::{Reaches, Service, Terms};
use shared_memory::SharedMemory;
use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// Maximum time for which a device waits until the guard has received its safe handles.
const HELD: Duration = Duration::from_secs(5);

/// Runs a process that was started for a processor, from start to end.
///
/// # Errors
/// Fails with a message if the process was not started by a system, or the other side's version differs.
pub fn processor() -> Result<(), String> {
    kernel::retire_when_lost();
    let link: Arc<dyn Link> = Arc::new(UnixLink::from_descriptor(inherited(LINK)?).map_err(text)?);
    let variable = |name: &str| std::env::var(name).map_err(|_| format!("the environment has no {name}: a system starts this process"));
    let run: u64 = variable(RUN)?.parse().map_err(|_| format!("{RUN} is not a number"))?;
    let shared = SharedMemory::new(&variable(SYSTEM)?, run).map_err(text)?;
    let handles = UnixLink::from_descriptor(inherited(HANDLES)?).map_err(text)?;
    let heart = Arc::new(Heartbeat::received(inherited(HEART)?).map_err(text)?);
    guard::canary::sing(heart.clone()).map_err(text)?;
    let guard = std::env::var_os(GUARD).map(PathBuf::from);
    let watched = ProcessWatchers::by(inherited(GUARD_HEART)?, inherited(SUPERVISOR_HEART)?)?;
    let belongings = Belongings::new((variable(SYSTEM)?, variable(PROCESSOR)?), heart, watched, handles, guard);
    let (holding, beating) = (belongings.clone(), belongings.clone());
    let (looking, resting) = (belongings.clone(), belongings.clone());
    let terms = Terms {
        device: Arc::new(move |device, is_open| hand_over(&holding.handles(), device, is_open)),
        beat: Arc::new(move |stuck| beating.beat(stuck)),
        unwatched: Arc::new(move |patience| looking.is_unwatched(patience)),
        rests: Arc::new(move |span| resting.rests(span)),
        leaves: true,
        ..Terms::new(Probe::unneeded())
    };
    let reaches = Reaches { host: Some(Box::new(shared) as Box<dyn Ends>), network: None };
    let black_box = Some(black_box_of(inherited(BLACK_BOX)?)?);
    rtp::serve(&link, Service { reaches, black_box, door: SocketDoor::open(&belongings), terms })
}

/// Passes the safe handles of a device to the guard, and waits until the guard has received them. If the guard has exited, this has
/// already been reported.
fn hand_over(handles: &UnixLink, device: &Device, is_open: bool) {
    let given = if is_open { device.safe_handles() } else { Arc::default() };
    if (is_open && given.is_empty()) || send_handles(handles, device.name(), &given).is_err() {
        return;
    }
    let _held = handles.receive(HELD);
}

fn inherited(name: &str) -> Result<OwnedFd, String> {
    process_kit::inherited(name).map_err(text)
}
