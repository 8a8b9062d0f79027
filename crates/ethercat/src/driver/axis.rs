// SPDX-License-Identifier: Apache-2.0
//! An axis on a segment: the objects that its drive exchanges, and their positions in the process data.
use super::options::{AxisOptions, PdosFrom};
use crate::coe::Entry;
use crate::main_device::{Field, Mapping, Pdos, Sync0};
use cia402::axis::{self, DriveReadings};
use cia402::identity::ExpectedIdentity;
use cia402::{BrakeOptions, DriveCommand, Mode, error_name};
use device::Layout;

/// An axis, and the position of its process data.
pub(super) struct Axis {
    pub moved: axis::Axis,
    /// Position on the line.
    pub at: usize,
    /// Expected identity of the drive.
    pub expected: ExpectedIdentity,
    mode: Mode,
    pdos: PdosFrom,
    brake: Option<BrakeOptions>,
    fields: Fields,
}

/// Offsets of the axis's objects in the process data of all subdevices; `None` for an object that is not exchanged.
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

/// Synchronisation type: DC SYNC0.
const DC_SYNC0: u16 = 2;
const OUTPUTS: [u32; 5] = [0x6040_0010, 0x607A_0020, 0x60FF_0020, 0x6071_0010, 0x6060_0008];
const INPUTS: [u32; 6] = [0x6041_0010, 0x6064_0020, 0x606C_0020, 0x6077_0010, 0x603F_0010, 0x6061_0008];

impl Axis {
    pub fn new(options: &AxisOptions, index: usize, layout: &mut Layout) -> Axis {
        let of = &options.axis;
        Axis {
            moved: axis::Axis::new(of, format!("axis '{}'", of.name), error_name, layout),
            at: options.at.unwrap_or(index),
            expected: ExpectedIdentity { alias: options.alias, ..of.expected() },
            mode: of.mode.mode(),
            pdos: options.pdos,
            brake: of.brake,
            fields: Fields::default(),
        }
    }

    pub fn name(&self) -> &str {
        &self.moved.name
    }

    /// Returns the objects that the drive must exchange.
    pub fn pdos(&self) -> Pdos {
        match self.pdos {
            PdosFrom::Written => {
                let brake = self.brake.map(|brake| brake.object().mapped(32));
                Pdos::Written(OUTPUTS.into_iter().chain(brake).collect(), INPUTS.to_vec())
            }
            PdosFrom::Device => Pdos::Device,
        }
    }

    /// Returns the settings to write to the drive in PREOP, each with its entry, its value, and whether the entry may be missing.
    pub fn settings(&self, sync0: Option<Sync0>) -> Vec<(Entry, Vec<u8>, bool)> {
        let mut settings = vec![(Entry { index: 0x6060, sub: 0 }, vec![self.mode as u8], false)];
        settings.extend(self.brake.iter().flat_map(BrakeOptions::settings).map(|(of, value)| (of, value, true)));
        if let Some(sync0) = sync0 {
            // Outputs are taken and inputs sampled with SYNC0; the period of targets is encoded as a number and a power of ten.
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

    /// Stores the positions of the axis's objects.
    ///
    /// # Errors
    /// Fails with a message if a required object is not exchanged.
    pub fn map(&mut self, mapping: &Mapping, outputs_at: usize, inputs_at: usize) -> Result<(), String> {
        let title = self.moved.title();
        let find = |fields: &[Field], start: usize, entry: Entry, bits: usize| {
            let field = fields.iter().find(|field| field.of == entry && field.bits == bits && field.at % 8 == 0);
            field.map(|field| start + field.at / 8)
        };
        let output = |index, bits| find(&mapping.outputs, outputs_at, Entry { index, sub: 0 }, bits);
        let input = |index, bits| find(&mapping.inputs, inputs_at, Entry { index, sub: 0 }, bits);
        let brake = self.brake.map(|brake| (find(&mapping.outputs, outputs_at, brake.object(), 32), brake.index));
        let needed = |at: Option<usize>, index: u16| {
            at.ok_or_else(|| format!("{title}: its drive does not exchange object {index:#06x}; let the driver write the PDOs"))
        };
        let (target, bits) = match self.mode {
            Mode::Velocity => (0x60FF, 32),
            Mode::Torque => (0x6071, 16),
            Mode::Position | Mode::Homing => (0x607A, 32),
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

    /// Returns true if the drive exchanges the objects that homing needs.
    pub fn can_home(&self) -> bool {
        self.fields.mode.is_some() && self.fields.mode_shown.is_some()
    }

    /// Processes the drive's answer.
    pub fn look(&mut self, process: &[u8]) {
        let fields = self.fields;
        let word = |at: Option<usize>| at.map_or(0, |at| i16_at(process, at));
        self.moved.look(DriveReadings {
            status: i16_at(process, fields.status) as u16,
            position: i32_at(process, fields.position),
            velocity: fields.velocity.map_or(0, |at| i32_at(process, at)),
            torque: word(fields.torque),
            error: word(fields.error) as u16,
            mode: fields.mode_shown.map_or(0, |at| process[at] as i8),
        });
    }

    /// Processes the drive's answer and stores its readings.
    pub fn read(&mut self, process: &[u8], readings: &mut [u8]) {
        self.look(process);
        self.moved.show(readings);
    }

    /// Sets the command to the drive for the next cycle, which starts after `span_s`.
    pub fn write(&mut self, commands: &[u8], is_engaged: bool, span_s: f64, process: &mut [u8]) {
        let told = self.moved.tell(commands, is_engaged, span_s);
        self.put(told, process);
    }

    /// Writes the drive's idle command to the process data.
    pub fn tell_idle(&mut self, process: &mut [u8]) {
        let told = self.moved.commander.tell_idle();
        self.put(told, process);
    }

    fn put(&self, told: DriveCommand, process: &mut [u8]) {
        let fields = &self.fields;
        put(process, fields.control, &told.control.to_le_bytes());
        if let Some(mode) = fields.mode {
            process[mode] = told.mode as u8;
        }
        if let (Some(at), Some(brake)) = (fields.brake, told.brake) {
            put(process, at, &brake.to_le_bytes());
        }
        let target = told.target.to_le_bytes();
        put(process, fields.target, if self.mode == Mode::Torque { &target[..2] } else { &target });
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
