// SPDX-License-Identifier: Apache-2.0
//! Objects of an emulated node in addition to those of its drive.
use super::machine::Machine;
use super::said::NodeOptions;
use super::terminals::SwitchedTerminals;
use cia402::emulated::{Access, Drive, Objects, PRODUCT, VENDOR};

/// Device types of nodes: a CiA 402 drive, a CiA 401 module.
const DRIVE: u32 = 0x0002_0192;
const MODULE: u32 = 0x000F_0191;

/// Creates the objects of a node, and its machine.
pub(super) fn made(options: &NodeOptions) -> (Objects, Machine) {
    let (name, node) = (&options.name, options.node);
    let kind = if options.module.is_some() { MODULE } else { DRIVE };
    use Access::{Constant, Measured, Written};
    let mut objects = Objects::default();
    objects.add(0x1000, 0, Constant, &kind.to_le_bytes());
    objects.add(0x1001, 0, Measured, &[0]);
    objects.add(0x1005, 0, Written, &0x80u32.to_le_bytes());
    objects.add(0x1006, 0, Written, &0u32.to_le_bytes());
    objects.add(0x1008, 0, Constant, name.as_bytes());
    // The value is longer than an answer, so it is sent in segments.
    objects.add(0x100A, 0, Constant, concat!("emulated node of OpenGPAC, version ", env!("CARGO_PKG_VERSION")).as_bytes());
    objects.add(0x1010, 0, Constant, &[1]);
    objects.add(0x1010, 1, Written, &1u32.to_le_bytes());
    objects.add(0x1016, 0, Constant, &[1]);
    objects.add(0x1016, 1, Written, &0u32.to_le_bytes());
    objects.add(0x1017, 0, Written, &0u16.to_le_bytes());
    objects.add(0x1018, 0, Constant, &[4]);
    for (sub, value) in [(1, VENDOR), (2, PRODUCT), (3, 1), (4, options.serial.unwrap_or(u32::from(node)))] {
        objects.add(0x1018, sub, Constant, &value.to_le_bytes());
    }
    objects.add(0x1029, 0, Constant, &[1]);
    objects.add(0x1029, 1, Written, &[0]);
    if options.module.is_none() {
        objects.add(0x6007, 0, Written, &1i16.to_le_bytes());
    }
    // A controller may write this text.
    objects.add(0x2000, 0, Written, &[b' '; 20]);
    for number in 0..4u16 {
        let id = u32::from(node) + 0x100 * u32::from(number);
        for (index, mapping, id) in [(0x1400, 0x1600, 0x200 + id), (0x1800, 0x1A00, 0x4000_0180 + id)] {
            objects.add(index + number, 0, Constant, &[2]);
            objects.add(index + number, 1, Written, &(id | if number > 1 { 0x8000_0000 } else { 0 }).to_le_bytes());
            objects.add(index + number, 2, Written, &[0xFF]);
            objects.add(mapping + number, 0, Written, &[0]);
            for sub in 1..=8 {
                objects.add(mapping + number, sub, Written, &0u32.to_le_bytes());
            }
        }
    }
    let machine = match options.module {
        Some(terminals) => Machine::Module(SwitchedTerminals::new(&mut objects, terminals)),
        None => {
            let mut drive = Drive::new(&mut objects, options.position);
            drive.set_limits(options.limits);
            drive.set_load(options.falls);
            Machine::Drive(Box::new(drive))
        }
    };
    (objects, machine)
}
