// SPDX-License-Identifier: Apache-2.0
//! Object dictionary entries that must not be written while an emergency stop is latched: those that move a machine, and those that
//! define a node's reaction to a stop.
use crate::objects::Entry;

/// Offset between the objects of consecutive drives in a multi-drive device.
const OF_A_DRIVE: u16 = 0x800;

/// Returns the name of an object that must not change while an emergency stop is latched; `None` for a setting, which may be written.
///
/// The objects are those of CiA 301, 401, 402 and ETG.1000. Manufacturer-specific objects (0x2000 to 0x5FFF) count as settings, because
/// only the manufacturer knows their effects.
pub fn held(of: Entry) -> Option<&'static str> {
    match of.index {
        0x1016 | 0x1029 => Some("its behaviour without its controller"),
        0x1400..=0x17FF | 0x1C12 => Some("its process data mapping"),
        0x6000..=0x9FFF => of_a_drive(0x6000 + (of.index - 0x6000) % OF_A_DRIVE),
        _ => None,
    }
}

fn of_a_drive(index: u16) -> Option<&'static str> {
    match index {
        0x6040 => Some("its control word"),
        0x6060 => Some("its mode"),
        0x6042 | 0x6071 | 0x607A | 0x60FF => Some("its target"),
        0x60B0..=0x60B2 => Some("an offset of its target"),
        0x60FE | 0x6200..=0x63FF | 0x6411..=0x6444 => Some("its outputs, which may control a brake"),
        0x6007 | 0x605A..=0x605E | 0x6084 | 0x6085 | 0x60C6 => Some("its stopping behaviour"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(index: u16) -> Option<&'static str> {
        held(Entry { index, sub: 0 })
    }

    #[test]
    fn what_moves_and_what_stops_is_held_of_every_drive_of_a_device() {
        for drive in 0..8 {
            assert_eq!(at(0x6040 + drive * OF_A_DRIVE), Some("its control word"));
            assert_eq!(at(0x60FE + drive * OF_A_DRIVE), Some("its outputs, which may control a brake"));
            assert_eq!(at(0x605A + drive * OF_A_DRIVE), Some("its stopping behaviour"));
        }
        assert_eq!((at(0x1600), at(0x1016)), (Some("its process data mapping"), Some("its behaviour without its controller")));
    }

    #[test]
    fn settings_and_objects_of_a_vendor_are_not() {
        assert_eq!([0x1010, 0x1017, 0x1A00, 0x2000, 0x5FFF, 0x6065, 0x6098, 0x6410, 0xA000].map(at), [None; 9]);
    }
}
