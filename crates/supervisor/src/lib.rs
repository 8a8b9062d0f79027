// SPDX-License-Identifier: Apache-2.0
//! The supervisor: verb instances, command lists, transitions, ends. It runs plans, and talks with the programming system.
//!
//! A call of the PS takes the [`System`]'s lock, plans or commands, and hands scripts to the kernels; what kernels tell is taken
//! by the supervisor's thread (under the virtual clock: by whoever advances time). Nothing here is on a real-time path: a
//! transition that lies in one source is a reaction, prepared here when the instance is made and carried out by its kernel.
mod ages;
mod alarms;
mod apply;
mod catalog;
mod claims;
mod configure;
mod connect;
mod core;
mod create;
mod cut_off;
mod deadlines;
mod devices;
mod download;
mod elsewhere;
mod emergency;
mod end;
mod ending;
mod ends;
mod events;
mod exchange;
mod faces;
mod follow;
mod histories;
mod install;
mod instance;
mod inventory;
mod life;
mod log;
mod lost;
mod modes;
mod observe;
mod outputs;
mod pause;
mod proceed;
mod psi;
mod refuse;
mod report;
mod requirements;
mod retune;
mod sequence;
mod stages;
mod start;
mod suspend;
mod svvs;
mod system;
mod tables;
mod take_over;
mod values;

pub use alarms::{Alarm, AlarmText, Severity};
pub use apply::DeviceRequest;
pub use configure::SvvRequest;
pub use download::{build, library_json, load, trial};
pub use elsewhere::Location;
pub use ends::End;
pub use instance::Limits;
pub use log::Entry;
pub use modes::Mode;
pub use observe::{Past, type_tree};
pub use report::{Other, Report};
pub use system::{System, Waited};
pub use take_over::{Anew, OfProcessor, TakenOver};
pub use values::Reading;
