// SPDX-License-Identifier: Apache-2.0
//! An axis: converts readings of its drive to channel values, and channel values to drive commands.
use super::channels::Channels;
use super::options::AxisOptions;
use crate::commander::{Commander, DriveCommand, Scale};
use crate::states::FOLLOWING_ERROR;
use device::Layout;

/// Readings of a drive, in the drive's own units; 0 for values that it does not provide.
#[derive(Clone, Copy, Debug, Default)]
pub struct DriveReadings {
    pub status: u16,
    pub position: i32,
    pub velocity: i32,
    /// Torque, thousandths of the rated torque.
    pub torque: i16,
    pub error: u16,
    /// Current mode of the drive.
    pub mode: i8,
}

/// An axis and its state. Allocates only when created.
pub struct Axis {
    pub name: String,
    pub commander: Commander,
    pub measured: DriveReadings,
    /// Name used in errors: `axis 'x' (node 5)`.
    title: String,
    /// Function that returns the meaning of an error code.
    named: fn(u16) -> &'static str,
    /// Time limit for the drive to reach the Operation Enabled state, s.
    operating_within_s: f64,
    channels: Channels,
}

impl Axis {
    pub fn new(options: &AxisOptions, title: String, named: fn(u16) -> &'static str, layout: &mut Layout) -> Axis {
        Axis {
            name: options.name.clone(),
            commander: Commander::new(options.scale(), options.brake),
            measured: DriveReadings::default(),
            title,
            named,
            operating_within_s: options.operating_within_s,
            channels: Channels::new(options, layout),
        }
    }

    pub fn title(&self) -> &str {
        &self.title
    }

    /// Returns the data that the services need: name, title, scale.
    pub fn beside(&self) -> (String, String, Scale) {
        (self.name.clone(), self.title.clone(), self.commander.scale())
    }

    /// Processes readings from the drive.
    pub fn look(&mut self, measured: DriveReadings) {
        self.measured = measured;
        self.commander.see(measured.status, measured.position, measured.mode);
    }

    /// Stores the latest readings of the drive.
    pub fn show(&self, readings: &mut [u8]) {
        let Axis { channels, commander, measured, .. } = self;
        channels.position.set_double(readings, 0, commander.position());
        channels.velocity.set_double(readings, 0, commander.velocity(measured.velocity));
        channels.torque.set_double(readings, 0, commander.torque(measured.torque.into()));
        if let Some(bias) = channels.bias {
            bias.set_double(readings, 0, 0.0);
        }
        channels.status.of_mut(readings).copy_from_slice(&commander.status().to_ne_bytes());
        channels.error.of_mut(readings).copy_from_slice(&measured.error.to_ne_bytes());
        channels.homing.of_mut(readings)[0] = commander.homed() as u8;
        channels.operating.of_mut(readings)[0] = u8::from(commander.is_operating());
    }

    /// Returns the reason why the axis cannot follow its commands while it is engaged.
    pub fn fault(&self) -> Option<String> {
        let (title, code, commander) = (&self.title, self.measured.error, &self.commander);
        if commander.is_wanted() && commander.is_faulty() {
            let why = if code == FOLLOWING_ERROR { self.following_text() } else { String::new() };
            return Some(format!("{title} has a fault, {code:#06x}: {}{why}; remove its cause, then reset the device", (self.named)(code)));
        }
        let state = commander.state();
        let within_s = self.operating_within_s;
        if commander.awaited_s() > within_s {
            return Some(format!(
                "{title} did not come into operation within {within_s} s of being enabled: it is in '{state}', error {code:#06x}; check its enable \
                 input and its supply, then reset the device"
            ));
        }
        commander
            .has_dropped()
            .then(|| format!("{title} has left operation by itself: it is in '{state}', error {code:#06x}; check its enable input, then reset the device"))
    }

    /// Describes the state of the axis after its drive has detected a following error, and the remedy.
    fn following_text(&self) -> String {
        let torque = match self.measured.torque {
            0 => String::new(),
            thousandths => format!(" with {:.1} % of its rated torque", f64::from(thousandths) * 0.1),
        };
        format!(
            "; it is at {:.6}{torque}; read the error (0x60F4) and its limit (0x6065) in the drive; move with less speed= or acceleration=, find what \
             blocks the axis, check its torque limit (0x6072), or raise 0x6065",
            self.commander.position()
        )
    }

    /// Returns the command to the drive for the next cycle, which starts after `span_s`.
    pub fn tell(&mut self, commands: &[u8], is_engaged: bool, span_s: f64) -> DriveCommand {
        self.commander.tell(self.channels.command.double(commands, 0), is_engaged, span_s)
    }
}
