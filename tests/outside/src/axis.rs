// SPDX-License-Identifier: Apache-2.0
//! A linear axis that follows its commanded speed: the shortest possible driver.
use device::{Channel, Declaration, DeviceError, Driver, DriverError, GivenOptions, Kind, Layout, OpenedDriver, OptionWord, Slot, Type};
use serde::Deserialize;
use serde_json::json;

pub static DRIVER: Declaration = Declaration::new("outside_axis", "a linear axis that follows its commanded speed", &OPTIONS, open);

const OPTIONS: [OptionWord; 2] = [
    OptionWord::with_default("start", Kind::Number, "0", "where it stands at first").unit("m"),
    OptionWord::needed("travel", Kind::Number, "its end of travel").unit("m"),
];

#[derive(Deserialize)]
struct Options {
    #[serde(default)]
    start: f64,
    travel: f64,
}

struct Axis {
    channels: Vec<Channel>,
    position: Slot,
    speed: Slot,
    travel_m: f64,
    at_m: f64,
    speed_m_per_s: f64,
    time_ns: i64,
}

fn open(given: &GivenOptions<'_>) -> Result<OpenedDriver, DriverError> {
    let options: Options = given.read()?;
    if options.travel <= options.start {
        return Err(given.wrong("travel", "it must lie behind the start"));
    }
    let mut layout = Layout::default();
    let position = layout.add(Channel::read("axis.position", Type::DOUBLE).unit("m").doc("where it stands"));
    let speed = layout.add(Channel::write("axis.speed", Type::DOUBLE).unit("m/s").doc("how fast it is to go"));
    let axis = Axis { channels: layout.into_channels(), position, speed, travel_m: options.travel, at_m: options.start, speed_m_per_s: 0.0, time_ns: 0 };
    Ok((Box::new(axis), json!({ "parts": [] })))
}

impl Driver for Axis {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn open(&mut self, now_ns: i64) -> Result<(), DeviceError> {
        self.time_ns = now_ns;
        Ok(())
    }

    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        self.at_m += self.speed_m_per_s * (release_ns - self.time_ns) as f64 * 1e-9;
        self.time_ns = release_ns;
        if self.at_m > self.travel_m {
            return Err(DeviceError { message: format!("the axis ran over its end of travel, {} m", self.travel_m) });
        }
        self.position.set_double(readings, 0, self.at_m);
        Ok(())
    }

    fn write(&mut self, _: i64, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError> {
        self.speed_m_per_s = if engaged[0] { self.speed.double(commands, 0) } else { 0.0 };
        Ok(())
    }

    fn safe_state(&mut self) {
        self.speed_m_per_s = 0.0;
    }

    fn close(&mut self) {
        self.safe_state();
    }
}
