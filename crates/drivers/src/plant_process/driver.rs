// SPDX-License-Identifier: Apache-2.0
//! The driver of a plant that runs in a process of its own.
use super::region::{Region, Shape, Shared};
use super::words::{Answer, Ask};
use super::{ask, ask_with};
use guard::{Child, UnixLink, connect};
use interconnect::{TripleReader, TripleWriter};
use kernel::{Channel, DeviceError, Driver, SafeHandle};
use std::io::ErrorKind;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// How long a plant may take to put itself away.
const END: Duration = Duration::from_secs(5);

pub(super) struct PlantProcess {
    link: UnixLink,
    /// Its process, where this driver started it.
    child: Option<Child>,
    channels: Vec<Channel>,
    shape: Shape,
    silent_ns: i64,
    /// Where others find it.
    path: Option<PathBuf>,
    session: Option<Session>,
}

struct Session {
    region: Region,
    commands: TripleWriter<Shared>,
    readings: TripleReader<Shared>,
    /// Steps of the plant at the last read, and the release at which that number was new.
    steps: u64,
    stepped_ns: Option<i64>,
}

impl PlantProcess {
    pub fn new(link: UnixLink, child: Option<Child>, channels: Vec<Channel>, silent_ns: i64, path: Option<PathBuf>) -> PlantProcess {
        PlantProcess { shape: Shape::of(&channels), link, child, channels, silent_ns, path, session: None }
    }

    fn leave(&mut self, group: &[u8], engaged: Option<&[bool]>) {
        let Some(session) = &mut self.session else { return };
        let back = session.commands.back();
        let (commands, claimed) = back.split_at_mut(self.shape.commands);
        commands.copy_from_slice(&group[..self.shape.commands]);
        match engaged {
            Some(engaged) => claimed.iter_mut().zip(engaged).for_each(|(byte, engaged)| *byte = u8::from(*engaged)),
            None => claimed.fill(0),
        }
        session.commands.publish();
    }
}

impl Driver for PlantProcess {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn open(&mut self, _: i64) -> Result<(), DeviceError> {
        let fail = |message: String| DeviceError { message: format!("the plant cannot be opened: {message}") };
        let descriptor = match ask_with(&self.link, Ask::Open).map_err(fail)? {
            (Answer::Opened, mut descriptors) if !descriptors.is_empty() => descriptors.remove(0),
            (Answer::Refused(problem), _) => return Err(fail(problem)),
            (other, _) => return Err(fail(format!("it answers {other:?}"))),
        };
        let region = Region::received(descriptor, self.shape).map_err(|error| fail(error.to_string()))?;
        let (commands, readings) = region.driver_ends();
        self.session = Some(Session { region, commands, readings, steps: 0, stepped_ns: None });
        Ok(())
    }

    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        let Some(session) = &mut self.session else { return Err(DeviceError { message: "the plant is not open".to_owned() }) };
        if let Some(message) = session.region.failure() {
            return Err(DeviceError { message });
        }
        let steps = session.region.steps().load(Ordering::Acquire);
        match session.stepped_ns {
            Some(stepped_ns) if steps == session.steps => {
                if release_ns - stepped_ns > self.silent_ns {
                    return Err(DeviceError { message: format!("the plant process has made no step for {} ms", (release_ns - stepped_ns) / 1_000_000) });
                }
            }
            _ => (session.steps, session.stepped_ns) = (steps, Some(release_ns)),
        }
        session.readings.latch();
        readings.copy_from_slice(session.readings.front());
        Ok(())
    }

    fn write(&mut self, _: i64, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError> {
        self.leave(commands, Some(engaged));
        Ok(())
    }

    fn safe_state(&mut self) {
        // Written where commands lie: to reach its safe state takes no more than to command it.
        let Some(session) = &mut self.session else { return };
        let back = session.commands.back();
        back.fill(0);
        for channel in self.channels.iter().filter(|channel| channel.direction == kernel::Direction::Write) {
            back[channel.offset..channel.offset + channel.len].copy_from_slice(&channel.safe);
        }
        session.commands.publish();
    }

    fn close(&mut self) {
        self.safe_state();
        self.session = None;
        // A plant that is gone, or that another driver has opened since, is not ours to put away.
        let closed = ask(&self.link, Ask::Close);
        if let Some(child) = self.child.take()
            && (matches!(closed, Ok(Answer::Refused(_))) || child.wait(END).is_none())
        {
            child.leave();
        }
        // One that was killed could not take its socket away.
        if let Some(path) = &self.path
            && connect(path).is_err_and(|error| error.kind() == ErrorKind::ConnectionRefused)
        {
            // Gone meanwhile is as good.
            let _removed = std::fs::remove_file(path);
        }
    }

    fn safe_handles(&self) -> Vec<SafeHandle> {
        let handle = |session: &Session| {
            let writes = session.region.safe_writes(&self.shape.safe_group(&self.channels));
            Some(SafeHandle { descriptor: session.region.memory().descriptor().ok()?, writes })
        };
        self.session.as_ref().and_then(handle).into_iter().collect()
    }
}

impl Drop for PlantProcess {
    /// One that was made and never opened leaves no process behind either.
    fn drop(&mut self) {
        if self.child.is_some() || self.session.is_some() {
            self.close();
        }
    }
}
