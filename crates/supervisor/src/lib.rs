// SPDX-License-Identifier: Apache-2.0
//! The supervisor: verb instances, command lists, transitions, ends. It executes plans and communicates with the programming system.
//!
//! A call from the PS takes the [`System`]'s lock, plans or commands, and sends scripts to the kernels; their notifications are handled
//! by the supervisor's thread (under the virtual clock: by the thread that advances time). Nothing here is on a real-time path: a
//! transition within one source is a reaction, prepared here when the instance is created and executed by its kernel.
//!
//! Each subject has a folder with its state and operations: `instances`, `starting`, `claims`, `transitions`, `movements`, `ending`,
//! `suspension`; `devices`, `processors`, `definitions`, `svvs`, `wiring`; `alarms`, `stopping`, `pausing`, `handover`; `observation`.
//! `core` combines their state under one lock, and `system` contains the calls of the programming system; files whose names end in
//! `_calls` contain its calls on their subject.
mod alarms;
mod attending;
mod claims;
mod clock;
mod copied;
mod core;
mod definitions;
mod devices;
mod ending;
mod handover;
mod instances;
mod lifetime;
mod movements;
mod numbers;
mod observation;
mod patterns;
mod pausing;
mod precedence;
mod processors;
mod refuse;
mod registry;
mod scripts;
mod starting;
mod stopping;
mod supervise;
mod suspension;
mod svvs;
mod system;
mod transitions;
mod waiting;
mod watchful;
mod wiring;

pub use alarms::list::{Alarm, AlarmList, AlarmText, Severity};
pub use alarms::shelving::Shelving;
pub use alarms::shelving_calls::ShelvingRequest;
pub use definitions::block_trial::{BlockTrial, TrialRequest, trial};
pub use definitions::download::{build, library, load};
pub use definitions::sane::check_name;
pub use definitions::verbs::{VerbClass, VerbForm, VerbSummary};
pub use device::{Geometry, Reach, ReachingValue};
pub use devices::forcing_calls::ForcedSignal;
pub use drivers::each_reach;
pub use ending::latest::End;
pub use ending::report::{Other, PassedList, Report};
pub use handover::take_over::{Anew, OfProcessor, TakenOver};
pub use instances::apply::DeviceRequest;
pub use instances::instance::Limits;
pub use instances::perform::StartedInstance;
pub use observation::arms::{ARMS_MAX, ArmDescription, ChainDescription, PointFile};
pub use observation::block_times::BlockTimes;
pub use observation::companions::Companion;
pub use observation::description::{BlockAbout, InstanceAbout, ModuleAbout, Names, SvvAbout, SvvOwn};
pub use observation::drawn::{
    CellKind, DueBy, InstalledActivation, InstalledBlock, InstalledCell, InstalledCondition, InstalledInstance, InstalledInstances, InstalledList,
    InstalledPort, InstalledTransition, PortDirection, PortValue,
};
pub use observation::inbox::TapChannel;
pub use observation::inventory::{DevicePart, Inventory, PhysicalDeviceAbout, ProcessorAbout};
pub use observation::log::Entry;
pub use observation::log_calls::{CommandSubject, ProgramCommand};
pub use observation::observe::Past;
pub use observation::samples::{Run, Samples};
pub use observation::states::{DeviceState, InstanceState, PausesInForce};
pub use observation::statistics::{InstanceStatistics, KindOfSource, PhysicalDeviceStatistics, SourcePlace, SourceStatistics, Statistics};
pub use observation::tap::Tap;
pub use observation::workspaces::{WORKSPACES_MAX, WorkspaceAbout};
pub use pausing::modes::Mode;
pub use precedence::first;
pub use processors::location::{InProcess, Location, Patience};
pub use svvs::svv_calls::SvvRequest;
pub use svvs::values::Reading;
pub use system::{System, WaitResult};
pub use wiring::fuse::{FusedBlocks, FusedGroup, SingleBlock};
