//! Driver with one axis that follows its effort, x' = gain u. Adapt it to your machine; leave the other files unchanged.
#[allow(dead_code)]
mod abi;
mod opengpac_driver;

use opengpac_driver::*;

struct Axis {
    gain: f64,
    place: f64, // rad
    speed: f64, // rad/s
    at_ns: i64,
    slots: [Slot; 4],
    exchanges: Counter,
}

impl Driver for Axis {
    const NAME: &std::ffi::CStr = c"{name}";
    const DOC: &std::ffi::CStr = c"One axis that follows its effort, x' = gain u.";
    const ITEMS: &[Item] = &[
        option_number(c"gain", 1.0, c"its speed for an effort of 1", c"rad/s"),
        safe(c"it stands still", 0),
        counter(c"exchanges", c"readings so far"),
    ];

    fn make(host: &mut Host) -> Result<Self, String> {
        host.joint(c"axis", 50.0, 0.0);
        let slots = [
            host.reads(c"double", c"axis.position", c"where it is", c"rad"),
            host.reads(c"double", c"axis.velocity", c"how fast it is", c"rad/s"),
            host.reads(c"double", c"axis.bias", c"effort that holds it: none", c"N.m"),
            host.writes(c"double", c"axis.effort", 0.0, c"what moves it", c"N.m"),
        ];
        Ok(Axis { gain: host.number(c"gain"), place: 0.0, speed: 0.0, at_ns: 0, slots, exchanges: host.counter(c"exchanges") })
    }

    fn open(&mut self, now_ns: i64) -> Done {
        self.at_ns = now_ns;
        Ok(())
    }

    fn read(&mut self, release_ns: i64, readings: Readings) -> Done {
        self.place += self.speed * (release_ns - self.at_ns) as f64 * 1e-9;
        self.at_ns = release_ns;
        [self.place, self.speed, 0.0].into_iter().zip(self.slots).for_each(|(value, slot)| readings.set(slot, value));
        self.exchanges.add(1);
        Ok(())
    }

    fn write(&mut self, release_ns: i64, commands: Commands) -> Done {
        let (effort, is_commanded) = (commands.get(self.slots[3]), commands.is_engaged(self.slots[3]));
        self.speed = if is_commanded && effort.is_finite() { self.gain * effort } else { 0.0 };
        if effort.is_finite() { Ok(()) } else { Err(format!("at {release_ns} ns its effort is not a number")) }
    }

    fn safe_state(&mut self) {
        self.speed = 0.0;
    }
}
export!(Axis);
