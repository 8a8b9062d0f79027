// SPDX-License-Identifier: Apache-2.0
//! An axis: what a drive by CiA 402 is told in each cycle, and what its answers say.
use super::brake::Brake;
use super::homing::Scale;
use super::options::{AxisOptions, Commanded, PdosFrom, Unit};
use crate::coe::Entry;
use crate::main_device::{Field, Mapping, Pdos, Sync0};
use cia402::{DriveState, Homing, HomingStep, Mode, error_name};
use device::{Channel, Layout, Number, Slot, Type};

/// An axis, and what it is doing.
pub(super) struct Axis {
    pub name: String,
    /// Its place on the line.
    pub at: usize,
    commanded: Commanded,
    pdos: PdosFrom,
    counts: f64,
    offset: f64,
    rated_torque: f64,
    speed_max: f64,
    slots: Slots,
    fields: Fields,
    state: DriveState,
    error: u16,
    position: f64,
    /// What the drive is told, counts.
    target: f64,
    /// It has been engaged, and is kept in operation until it is stopped.
    is_wanted: bool,
    /// It is stopped until nobody engages it any more.
    is_stopped: bool,
    resets: bool,
    status: u16,
    mode_shown: i8,
    homing: Option<Homing>,
    homed: Homed,
    brake: Option<Brake>,
}

/// How an axis has come home, as its channel shows it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Homed {
    #[default]
    No = 0,
    GoingOn = 1,
    Yes = 2,
    Failed = 3,
}

struct Slots {
    position: Slot,
    velocity: Slot,
    torque: Slot,
    bias: Option<Slot>,
    status: Slot,
    error: Slot,
    homing: Slot,
    command: Slot,
}

/// Offsets of its objects in all process data; an object that is not exchanged has none.
#[derive(Clone, Copy, Default)]
struct Fields {
    control: usize,
    target: usize,
    mode: Option<usize>,
    status: usize,
    position: usize,
    velocity: Option<usize>,
    torque: Option<usize>,
    error: Option<usize>,
    mode_shown: Option<usize>,
    brake: Option<usize>,
}

/// Synchronised by SYNC0: a type of synchronisation.
const DC_SYNC0: u16 = 2;
/// An option of the quick stop: down the ramp, and then the motor holds.
const STAYS_IN_QUICK_STOP: i16 = 6;
/// No axis is faster, in whatever it is counted: what is multiplied by a time stays a number.
const SPEED_MAX: f64 = 1e15;
const OUTPUTS: [u32; 5] = [0x6040_0010, 0x607A_0020, 0x60FF_0020, 0x6071_0010, 0x6060_0008];
const INPUTS: [u32; 6] = [0x6041_0010, 0x6064_0020, 0x606C_0020, 0x6077_0010, 0x603F_0010, 0x6061_0008];

impl Axis {
    pub fn new(options: &AxisOptions, index: usize, layout: &mut Layout) -> Axis {
        Axis {
            name: options.name.clone(),
            at: options.at.unwrap_or(index),
            commanded: options.mode,
            pdos: options.pdos,
            counts: options.counts,
            offset: options.offset,
            rated_torque: options.rated_torque.unwrap_or(1.0),
            speed_max: options.speed_max.unwrap_or(f64::INFINITY).min(SPEED_MAX),
            slots: Slots::new(options, layout),
            fields: Fields::default(),
            state: DriveState::NotReady,
            error: 0,
            position: 0.0,
            target: 0.0,
            is_wanted: false,
            is_stopped: false,
            resets: false,
            status: 0,
            mode_shown: 0,
            homing: None,
            homed: Homed::No,
            brake: options.brake.map(Brake::new),
        }
    }

    /// What its positions are in counts.
    pub fn scale(&self) -> Scale {
        Scale { counts: self.counts, offset: self.offset }
    }

    /// Which objects its drive is to exchange.
    pub fn pdos(&self) -> Pdos {
        match self.pdos {
            PdosFrom::Written => {
                let brake = self.brake.map(|brake| u32::from(brake.object().index) << 16 | u32::from(brake.object().sub) << 8 | 32);
                Pdos::Written(OUTPUTS.into_iter().chain(brake).collect(), INPUTS.to_vec())
            }
            PdosFrom::Device => Pdos::Device,
        }
    }

    /// What is written to its drive in PREOP: entry, value, and whether it may be missing.
    pub fn settings(&self, sync0: Option<Sync0>) -> Vec<(Entry, Vec<u8>, bool)> {
        let mut settings = vec![(Entry { index: 0x6060, sub: 0 }, vec![self.commanded.mode() as u8], false)];
        if let Some(brake) = self.brake {
            settings.extend(brake.settings());
            settings.push((Entry { index: 0x605A, sub: 0 }, STAYS_IN_QUICK_STOP.to_le_bytes().to_vec(), true));
        }
        if let Some(sync0) = sync0 {
            // Outputs are taken and inputs given with SYNC0; and how often targets come, as a number and a power of ten.
            let (count, power) = if sync0.cycle_ns % 1_000_000 == 0 { (sync0.cycle_ns / 1_000_000, -3i8) } else { (sync0.cycle_ns / 10_000, -5) };
            let optional = |index, sub, value: &[u8]| (Entry { index, sub }, value.to_vec(), true);
            settings.extend([
                optional(0x1C32, 1, &DC_SYNC0.to_le_bytes()),
                optional(0x1C33, 1, &DC_SYNC0.to_le_bytes()),
                optional(0x60C2, 1, &[count.min(255) as u8]),
                optional(0x60C2, 2, &[power as u8]),
            ]);
        }
        settings
    }

    /// Learns where its objects are.
    ///
    /// # Errors
    /// For people: one that it needs is not exchanged.
    pub fn map(&mut self, mapping: &Mapping, outputs_at: usize, inputs_at: usize) -> Result<(), String> {
        let name = self.name.clone();
        let find = |fields: &[Field], start: usize, entry: Entry, bits: usize| {
            let field = fields.iter().find(|field| field.of == entry && field.bits == bits && field.at % 8 == 0);
            field.map(|field| start + field.at / 8)
        };
        let output = |index, bits| find(&mapping.outputs, outputs_at, Entry { index, sub: 0 }, bits);
        let input = |index, bits| find(&mapping.inputs, inputs_at, Entry { index, sub: 0 }, bits);
        let brake = self.brake.map(|brake| (find(&mapping.outputs, outputs_at, brake.object(), 32), brake.object().index));
        let needed = |at: Option<usize>, index: u16| {
            at.ok_or_else(|| format!("axis '{name}': its drive does not exchange object {index:#06x}; let the driver write the PDOs"))
        };
        let (target, bits) = match self.commanded {
            Commanded::Position => (0x607A, 32),
            Commanded::Velocity => (0x60FF, 32),
            Commanded::Torque => (0x6071, 16),
        };
        self.fields = Fields {
            control: needed(output(0x6040, 16), 0x6040)?,
            target: needed(output(target, bits), target)?,
            mode: output(0x6060, 8),
            status: needed(input(0x6041, 16), 0x6041)?,
            position: needed(input(0x6064, 32), 0x6064)?,
            velocity: input(0x606C, 32),
            torque: input(0x6077, 16),
            error: input(0x603F, 16),
            mode_shown: input(0x6061, 8),
            brake: brake.map(|(at, index)| needed(at, index)).transpose()?,
        };
        Ok(())
    }

    /// Takes what its drive answered, and stores it.
    pub fn read(&mut self, process: &[u8], readings: &mut [u8]) {
        self.look(process);
        let fields = self.fields;
        let word = |at: Option<usize>| at.map_or(0, |at| i16_at(process, at));
        let velocity = fields.velocity.map_or(0, |at| i32_at(process, at));
        let slots = &self.slots;
        slots.position.set_double(readings, 0, (self.position - self.offset) / self.counts);
        slots.velocity.set_double(readings, 0, f64::from(velocity) / self.counts);
        slots.torque.set_double(readings, 0, f64::from(word(fields.torque)) * 1e-3 * self.rated_torque * self.counts.signum());
        if let Some(bias) = slots.bias {
            bias.set_double(readings, 0, 0.0);
        }
        slots.status.of_mut(readings).copy_from_slice(&process[fields.status..fields.status + 2]);
        slots.error.of_mut(readings).copy_from_slice(&self.error.to_ne_bytes());
        slots.homing.of_mut(readings)[0] = self.homed as u8;
    }

    /// Takes what its drive answered.
    pub fn look(&mut self, process: &[u8]) {
        self.status = i16_at(process, self.fields.status) as u16;
        self.state = DriveState::of(self.status);
        self.mode_shown = self.fields.mode_shown.map_or(0, |at| process[at] as i8);
        self.position = f64::from(i32_at(process, self.fields.position));
        self.error = self.fields.error.map_or(0, |at| i16_at(process, at) as u16);
    }

    /// Why it cannot do what it is engaged for.
    pub fn fault(&self) -> Option<String> {
        let is_faulty = matches!(self.state, DriveState::Fault | DriveState::FaultReaction) && self.is_wanted && !self.resets;
        is_faulty.then(|| format!("axis '{}' has a fault, {:#06x}: {}; remove its cause, then reset the device", self.name, self.error, error_name(self.error)))
    }

    pub fn is_faulty(&self) -> bool {
        self.state == DriveState::Fault
    }

    /// Resets a fault with the next command.
    pub fn reset(&mut self) {
        self.resets = true;
    }

    /// Begins to look for its home. Nobody has it engaged.
    pub fn home(&mut self) {
        self.is_wanted = false;
        (self.homing, self.homed) = (Some(Homing::default()), Homed::GoingOn);
    }

    /// Whether its drive exchanges what homing needs.
    pub fn can_home(&self) -> bool {
        self.fields.mode.is_some() && self.fields.mode_shown.is_some()
    }

    pub fn homed(&self) -> Homed {
        self.homed
    }

    /// Ends a search for its home.
    pub fn leave_homing(&mut self) {
        if self.homing.take().is_some() {
            self.homed = Homed::Failed;
        }
    }

    /// Comes to rest, until nobody engages it any more.
    pub fn stop(&mut self) {
        self.leave_homing();
        if let Some(brake) = &mut self.brake {
            brake.tell(false, 0.0);
        }
        (self.is_wanted, self.is_stopped) = (false, true);
    }

    /// Tells its drive what to do until the next cycle, which comes after `span_s`.
    pub fn write(&mut self, commands: &[u8], is_engaged: bool, span_s: f64, process: &mut [u8]) {
        if is_engaged && self.homing.is_some() {
            // What engages it expects that it follows.
            self.stop();
        }
        self.is_stopped &= is_engaged;
        let is_torque = self.commanded == Commanded::Torque;
        self.is_wanted = !self.is_stopped && (is_engaged || self.is_wanted && !is_torque);
        let command = self.slots.command.double(commands, 0);
        let is_held = self.state == DriveState::OperationEnabled && (self.is_wanted || self.homing.is_some());
        if let Some(brake) = &mut self.brake {
            brake.tell(is_held, span_s);
        }
        let is_open = self.brake.is_none_or(|brake| brake.is_open());
        let is_moving = is_engaged && command.is_finite() && is_held && is_open;
        let target = self.target(is_moving.then_some(command), span_s);
        let control = self.control();
        self.tell(control, target, process);
    }

    /// Tells its drive this, without a command.
    pub fn tell_idle(&mut self, process: &mut [u8]) {
        self.target = self.position;
        let control = self.control();
        let target = if self.commanded == Commanded::Position { self.position } else { 0.0 };
        self.tell(control, target, process);
    }

    fn tell(&self, control: u16, target: f64, process: &mut [u8]) {
        let fields = &self.fields;
        put(process, fields.control, &control.to_le_bytes());
        if let Some(mode) = fields.mode {
            process[mode] = if self.homing.is_some() { Mode::Homing } else { self.commanded.mode() } as u8;
        }
        if let (Some(at), Some(brake)) = (fields.brake, &self.brake) {
            put(process, at, &brake.word().to_le_bytes());
        }
        match self.commanded {
            Commanded::Torque => put(process, fields.target, &(target.round() as i16).to_le_bytes()),
            Commanded::Position | Commanded::Velocity => put(process, fields.target, &(target.round() as i32).to_le_bytes()),
        }
    }

    fn control(&mut self) -> u16 {
        if std::mem::take(&mut self.resets) && self.is_faulty() {
            return cia402::RESET;
        }
        let (is_open, is_closed) = self.brake.map_or((true, true), |brake| (brake.is_open(), brake.is_closed()));
        if self.homing.is_some() && self.state == DriveState::OperationEnabled && !is_open {
            return cia402::ENABLE;
        }
        if let Some(homing) = &mut self.homing {
            match homing.step(self.status, self.mode_shown) {
                HomingStep::Tell(control) => return control,
                HomingStep::Attained => self.homed = Homed::Yes,
                HomingStep::Failed => self.homed = Homed::Failed,
            }
            self.homing = None;
        }
        match (self.is_stopped, self.is_wanted) {
            (true, _) if self.is_powered() && (self.brake.is_none() || !is_closed) => cia402::QUICK_STOP,
            // The motor holds the axis until its brake has closed.
            (false, _) if self.state == DriveState::QuickStopActive && !is_closed => cia402::QUICK_STOP,
            (false, false) if self.state == DriveState::OperationEnabled && !is_closed => cia402::ENABLE,
            (true, _) => cia402::DISABLE_VOLTAGE,
            (false, true) => self.state.towards_operation(),
            (false, false) => cia402::DISABLE_VOLTAGE,
        }
    }

    fn is_powered(&self) -> bool {
        matches!(self.state, DriveState::OperationEnabled | DriveState::QuickStopActive)
    }

    /// What its drive is told, in its own units: never further than its greatest speed leads in the time.
    fn target(&mut self, command: Option<f64>, span_s: f64) -> f64 {
        match self.commanded {
            Commanded::Position => {
                if self.state != DriveState::OperationEnabled {
                    // Where it is: so it does not jump when it comes into operation.
                    self.target = self.position;
                } else if let Some(position) = command {
                    let most = (self.speed_max * self.counts.abs()).min(SPEED_MAX) * span_s;
                    let wish = (position * self.counts + self.offset).clamp(i32::MIN.into(), i32::MAX.into());
                    self.target += (wish - self.target).clamp(-most, most);
                }
                self.target
            }
            Commanded::Velocity => command.map_or(0.0, |velocity| velocity.clamp(-self.speed_max, self.speed_max) * self.counts),
            Commanded::Torque => command.map_or(0.0, |torque| torque / self.rated_torque * 1e3 * self.counts.signum()),
        }
    }
}

impl Slots {
    fn new(options: &AxisOptions, layout: &mut Layout) -> Slots {
        let name = &options.name;
        let (unit, speed, force) = if options.unit == Unit::M { ("m", "m/s", "N") } else { ("rad", "rad/s", "N.m") };
        let torque_unit = if options.rated_torque.is_some() { force } else { "" };
        let mut read = |what: &str, of: Type, unit: &str, doc: &str| layout.add(Channel::read(format!("{name}.{what}"), of).unit(unit).doc(doc));
        let position = read("position", Type::DOUBLE, unit, "position");
        let velocity = read("velocity", Type::DOUBLE, speed, "velocity");
        let torque = read("torque", Type::DOUBLE, torque_unit, "torque; without rated_torque as a part of the rated one");
        let bias = (options.mode == Commanded::Torque).then(|| read("bias", Type::DOUBLE, force, "effort that holds it: not known, 0"));
        let status = read("status", Type::of(Number::Uint16), "", "status word of the drive");
        let error = read("error", Type::of(Number::Uint16), "", "error code of the drive; 0 where it has none");
        let homing = read("homing", Type::of(Number::Uint8), "", "0 not yet, 1 on the way home, 2 home, 3 home was not found");
        let write = |what: &str, unit: &str, doc: &str| Channel::write(format!("{name}.{what}"), Type::DOUBLE).unit(unit).doc(doc);
        let command = match options.mode {
            Commanded::Position => write("goal", unit, "where it is to be; NaN: it stays").safe(f64::NAN.to_ne_bytes().to_vec()),
            Commanded::Velocity => write("rate", speed, "how fast it is to move"),
            Commanded::Torque => write("effort", force, "torque that it is to make"),
        };
        Slots { position, velocity, torque, bias, status, error, homing, command: layout.add(command) }
    }
}

fn i16_at(bytes: &[u8], at: usize) -> i16 {
    i16::from_le_bytes([bytes[at], bytes[at + 1]])
}

fn i32_at(bytes: &[u8], at: usize) -> i32 {
    i32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

fn put(bytes: &mut [u8], at: usize, what: &[u8]) {
    bytes[at..at + what.len()].copy_from_slice(what);
}
