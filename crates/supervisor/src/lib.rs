// SPDX-License-Identifier: Apache-2.0
//! The supervisor: verb instances, command lists, transitions, ends. It runs plans, and talks with the programming system.
//!
//! A call of the PS takes the [`System`]'s lock, plans or commands, and hands scripts to the kernels; what kernels tell is taken
//! by the supervisor's thread (under the virtual clock: by the thread that advances time). Nothing here is on a real-time path: a
//! transition that lies in one source is a reaction, prepared here when the instance is made and carried out by its kernel.
//!
//! The folders are floors; each knows those below it. `registry`: what there is, and who writes it. `wiring`: where blocks, cells and
//! connections lie. `lifecycle`: a verb instance as it is kept. `observation`, `safety`, `remote`: the state of each of these. `carrying`:
//! movements carried out. `core`: all of that under one lock. `protection`, `course`, `handover`: what happens to it. `calls`: what a
//! programming system calls.
mod attending;
mod calls;
mod carrying;
mod copied;
mod core;
mod course;
mod errands;
mod handover;
mod lifecycle;
mod numbers;
mod observation;
mod patterns;
mod precedence;
mod protection;
mod refuse;
mod registry;
mod remote;
mod safety;
mod scripts;
mod supervise;
mod system;
mod waiting;
mod watchful;
mod wiring;

pub use calls::apply::DeviceRequest;
pub use calls::block_times::BlockTimes;
pub use calls::fuse::{Fused, FusedGroup, SingleBlock};
pub use calls::inventory::{DevicePart, Inventory, PhysicalDeviceAbout, ProcessorAbout};
pub use calls::log::{CommandSubject, ProgramCommand};
pub use calls::observe::Past;
pub use calls::perform::StartedInstance;
pub use calls::statistics::{InstanceStatistics, KindOfSource, PhysicalDeviceStatistics, SourcePlace, SourceStatistics, Statistics};
pub use calls::svvs::SvvRequest;
pub use calls::tap::Tap;
pub use calls::values::Reading;
pub use calls::verbs::{VerbClass, VerbForm, VerbSummary};
pub use device::{Geometry, Reach, Reached};
pub use drivers::each_reach;
pub use handover::take_over::{Anew, OfProcessor, TakenOver};
pub use lifecycle::instance::Limits;
pub use lifecycle::report::{Other, Passed, Report};
pub use lifecycle::trial::{BlockTrial, TrialRequest, trial};
pub use observation::about::{BlockAbout, InstanceAbout, ModuleAbout, Names, SvvAbout, SvvOwn};
pub use observation::companions::Companion;
pub use observation::drawn::{
    CellKind, DueBy, Installed, InstalledActivation, InstalledBlock, InstalledCell, InstalledCondition, InstalledInstance, InstalledList, InstalledPort,
    InstalledTransition, PortDirection, PortValue,
};
pub use observation::ends::End;
pub use observation::inbox::TapChannel;
pub use observation::log::Entry;
pub use observation::samples::{Run, Samples};
pub use observation::states::{DeviceState, InstanceState, Paused};
pub use observation::workspaces::{WORKSPACES_MAX, WorkspaceAbout};
pub use precedence::first;
pub use registry::download::{build, library, load};
pub use registry::location::{InProcess, Location, Patience};
pub use registry::sane::check_name;
pub use safety::alarms::{Alarm, AlarmList, AlarmText, Severity};
pub use safety::modes::Mode;
pub use safety::shelving::{Shelving, ShelvingRequest};
pub use system::{System, Waited};
