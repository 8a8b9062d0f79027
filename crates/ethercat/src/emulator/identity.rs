// SPDX-License-Identifier: Apache-2.0
//! Identity of an emulated subdevice, and the process data of a drive.
use super::options::{DriveOptions, TerminalOptions};
use cia402::emulated::{Access, Objects, PRODUCT, VENDOR};

/// Writes the identity to the object dictionary.
pub fn identify(objects: &mut Objects, options: &DriveOptions, serial: u32) {
    use Access::Constant;
    // A drive is a CiA 402 device, a terminal a modular one.
    let kind: u32 = if options.terminal.is_some() { 5001 } else { 0x0002_0192 };
    let product = options.terminal.as_ref().map_or(PRODUCT, TerminalOptions::product);
    objects.add(0x1000, 0, Constant, &kind.to_le_bytes());
    objects.add(0x1008, 0, Constant, options.name.as_bytes());
    objects.add(0x1009, 0, Constant, b"1.0");
    // The value is longer than a mailbox, so it is sent in segments.
    let version = format!("emulated drive of OpenGPAC, version {}; {}", env!("CARGO_PKG_VERSION"), "CiA 402 with CSP, CSV, CST and homing; ".repeat(6));
    objects.add(0x100A, 0, Constant, version.as_bytes());
    objects.add(0x1018, 0, Constant, &[4]);
    for (sub, value) in [(1, VENDOR), (2, product), (3, 1), (4, serial)] {
        objects.add(0x1018, sub, Constant, &value.to_le_bytes());
    }
    // A main device may write this text, which is longer than a mailbox.
    objects.add(0x2000, 0, Access::Written, &[b' '; 300]);
    objects.add(0x1C00, 0, Constant, &[4]);
    for sub in 1..=4 {
        objects.add(0x1C00, sub, Constant, &[sub]);
    }
}

/// Maps the default process data, which support the three cyclic modes; object 0x6060 selects the mode.
pub fn map(objects: &mut Objects) {
    use Access::Configured;
    const OUTPUTS: [u32; 5] = [0x6040_0010, 0x607A_0020, 0x60FF_0020, 0x6071_0010, 0x6060_0008];
    const INPUTS: [u32; 6] = [0x6041_0010, 0x6064_0020, 0x606C_0020, 0x6077_0010, 0x603F_0010, 0x6061_0008];
    for (pdo, assignment, entries) in [(0x1600u16, 0x1C12, &OUTPUTS[..]), (0x1A00, 0x1C13, &INPUTS[..])] {
        objects.add(pdo, 0, Configured, &[entries.len() as u8]);
        for sub in 1..=8usize {
            let word = entries.get(sub - 1).copied().unwrap_or(0);
            objects.add(pdo, sub as u8, Configured, &word.to_le_bytes());
        }
        objects.add(assignment, 0, Configured, &[1]);
        objects.add(assignment, 1, Configured, &pdo.to_le_bytes());
    }
}
