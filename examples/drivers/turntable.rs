//! A driver in Rust: a turntable whose drive is simulated here, x' = gain u. It is the `src/lib.rs` of what `opengpac new driver turntable --in rust` begins.
#[allow(dead_code)]
mod abi;
mod opengpac_driver;

use opengpac_driver::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// What the cycle and services share: where it is, rad, and the bits of its offset.
#[derive(Default)]
struct Place(AtomicU64, AtomicU64);
struct Turntable { gain: f64, turned: f64, speed: f64, at_ns: i64, slots: [Slot; 4], exchanges: Counter, place: Arc<Place> }

impl Driver for Turntable {
    const NAME: &std::ffi::CStr = c"turntable";
    const DOC: &std::ffi::CStr = c"A turntable that follows its effort, x' = gain u.";
    const SCANS: bool = true;
    const ITEMS: &[Item] = &[
        option_number(c"gain", 1.0, c"its speed for an effort of 1", c"rad/s"),
        safe(c"it stands still", 0),
        counter(c"exchanges", c"readings so far"),
        service_of(c"place", answers::NUMBER, c"where it is"),
        service(c"call_here", c"names the place where it is"),
        option_number(c"position", 0.0, c"what it is called", c"rad"),
    ];
    fn make(host: &mut Host) -> Result<Self, String> {
        host.joint(c"table", 50.0, 0.0);
        let [q, v, b] = [(c"table.position", c"rad"), (c"table.velocity", c"rad/s"), (c"table.bias", c"N.m")].map(|(name, unit)| host.reads(c"double", name, c"measured", unit));
        let slots = [q, v, b, host.writes(c"double", c"table.effort", 0.0, c"what moves it", c"N.m")];
        let (gain, exchanges) = (host.number(c"gain"), host.counter(c"exchanges"));
        if gain > 0.0 { Ok(Turntable { gain, turned: 0.0, speed: 0.0, at_ns: 0, slots, exchanges, place: Arc::default() }) } else { Err(format!("option 'gain': {gain} is not above 0")) }
    }
    fn open(&mut self, now_ns: i64) -> Done { self.at_ns = now_ns; Ok(()) }
    fn read(&mut self, release_ns: i64, readings: Readings) -> Done {
        self.turned += self.speed * (release_ns - self.at_ns) as f64 * 1e-9;
        self.at_ns = release_ns;
        self.place.0.store(self.turned.to_bits(), Relaxed);
        let position = self.turned + f64::from_bits(self.place.1.load(Relaxed));
        [position, self.speed, 0.0].into_iter().zip(self.slots).for_each(|(value, slot)| readings.set(slot, value));
        self.exchanges.add(1);
        Ok(())
    }
    fn write(&mut self, release_ns: i64, commands: Commands) -> Done {
        let (effort, is_engaged) = (commands.get(self.slots[3]), commands.is_engaged(self.slots[3]));
        self.speed = if is_engaged && effort.is_finite() { self.gain * effort } else { 0.0 };
        if effort.is_finite() { Ok(()) } else { Err(format!("at {release_ns} ns its effort is not a number")) }
    }
    fn safe_state(&mut self) { self.speed = 0.0; }
    fn services(&self) -> Option<Arc<dyn Services>> { Some(self.place.clone()) }
    fn scan(host: &mut Host) -> Done { host.found("a turntable of this process", r#"{"gain": 2.0}"#); Ok(()) }
}
impl Services for Place {
    fn serve(&self, service: &str, host: &mut Host) -> Done {
        let turned = f64::from_bits(self.0.load(Relaxed));
        if service == "call_here" { self.1.store((host.number(c"position") - turned).to_bits(), Relaxed) } else { host.answer(&format!("{:?}", turned + f64::from_bits(self.1.load(Relaxed)))) }
        Ok(())
    }
}
export!(Turntable);
