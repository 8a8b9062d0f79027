// SPDX-License-Identifier: Apache-2.0
//! Register addresses in the memory of a subdevice controller.

/// Type, revision and build of the controller, numbers of FMMUs and SyncManagers, memory size, and ports.
pub const INFORMATION: u16 = 0x0000;
pub const FEATURES: u16 = 0x0008;
pub const STATION: u16 = 0x0010;
pub const ALIAS: u16 = 0x0012;
pub const DL_CONTROL: u16 = 0x0100;
pub const DL_STATUS: u16 = 0x0110;
pub const AL_CONTROL: u16 = 0x0120;
/// State register; [`AL_CODE`] is 4 bytes after it.
pub const AL_STATUS: u16 = 0x0130;
pub const AL_CODE: u16 = 0x0134;
pub const WATCHDOG_DIVIDER: u16 = 0x0400;
pub const WATCHDOG_OUTPUTS: u16 = 0x0420;
pub const WATCHDOG_STATUS: u16 = 0x0440;
pub const EEPROM_CONFIG: u16 = 0x0500;
/// EEPROM control and status register, followed by the address and data registers.
pub const EEPROM: u16 = 0x0502;
pub const EEPROM_ADDRESS: u16 = 0x0504;
pub const EEPROM_DATA: u16 = 0x0508;
pub const FMMU: u16 = 0x0600;
pub const FMMU_LEN: u16 = 16;
pub const SYNC_MANAGER: u16 = 0x0800;
pub const SYNC_MANAGER_LEN: u16 = 8;
pub const DC_RECEIVED: u16 = 0x0900;
pub const DC_SYSTEM_TIME: u16 = 0x0910;
pub const DC_RECEIVED_UNIT: u16 = 0x0918;
pub const DC_OFFSET: u16 = 0x0920;
pub const DC_DELAY: u16 = 0x0928;
/// Difference between the local time and that of the reference clock: sign and magnitude, ns.
pub const DC_DIFFERENCE: u16 = 0x092C;
pub const DC_SPEED: u16 = 0x0930;
/// SYNC0 control assignment register, followed by the activation register.
pub const SYNC_UNIT: u16 = 0x0980;
pub const SYNC_ACTIVATION: u16 = 0x0981;
pub const SYNC0_START: u16 = 0x0990;
pub const SYNC0_CYCLE: u16 = 0x09A0;
/// Start address of the process memory.
pub const MEMORY: u16 = 0x1000;

/// Feature bit: the subdevice has a distributed clock.
pub const HAS_CLOCK: u16 = 0x0004;
/// Activation bits: the sync unit and SYNC0 are enabled.
pub const SYNC0_ON: u8 = 0x03;
/// Status bit of a SyncManager: the mailbox is full.
pub const MAILBOX_FULL: u8 = 0x08;
