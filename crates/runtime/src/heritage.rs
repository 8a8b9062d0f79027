// SPDX-License-Identifier: Apache-2.0
//! Heritage: sources of a host continue from the sources of a previous host in this process, each block from the state in which its
//! predecessor stopped. Blocks are paired off the real-time path, by label and face; the heritage is carried out between two firings by
//! [`Op::Inherit`](kernel::Op::Inherit).
use crate::heir;
use kernel::phase::CountedInvocations;
use kernel::{Activation, Block, Cell, Device, Inheritance, Process, SourceId, Table, View};
use opengpac::abi::{Item, NONE, kind};
use std::collections::HashMap;
use std::ffi::CStr;
use std::ptr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

/// State of a source's table in force, to be inherited.
#[derive(Clone)]
pub struct Holding {
    source: SourceId,
    blocks: Vec<HeldBlock>,
    devices: Vec<Arc<Device>>,
}

#[derive(Clone)]
struct HeldBlock {
    block: Arc<Block>,
    process: Arc<Process>,
    activation: Arc<Activation>,
}

impl Holding {
    /// Returns the state that will be in force when `table` is in force in `source`.
    pub fn of(table: &Table, source: SourceId) -> Holding {
        let held = |step: &kernel::table::ColdStep| {
            let (process, activation) = (table.processes[step.process as usize].clone(), table.activations[step.slot as usize].clone());
            step.block.clone().map(|block| HeldBlock { block, process, activation })
        };
        Holding { source, blocks: table.steps.iter().filter_map(held).collect(), devices: table.devices.clone() }
    }

    /// Returns the labels of the blocks.
    pub fn labels(&self) -> impl Iterator<Item = &str> {
        self.blocks.iter().map(|held| held.block.name())
    }

    /// Returns the devices.
    pub fn devices(&self) -> &[Arc<Device>] {
        &self.devices
    }
}

/// Heritage of one source.
pub struct Heritage {
    passes: Vec<Pass>,
    /// Verb instances of the source's blocks, each with its predecessor and the source in which the predecessor ran.
    times: Vec<(Arc<Process>, Arc<Process>, SourceId)>,
    devices: Vec<Arc<Device>>,
    ahead_ns: i64,
    /// Views to be freed by another thread. The mutex is needed only because scripts are shared; it is never contended.
    left: Mutex<Vec<Box<dyn View>>>,
    is_done: Arc<AtomicBool>,
}

struct Pass {
    to: Arc<Block>,
    from: Arc<Block>,
    copies: Vec<(Cell, Cell)>,
    /// Activation of the block, if no earlier block of the activation is carried over.
    activation: Option<Arc<Activation>>,
}

/// Blocks of a source that are carried over, and blocks that restart, each with the reason.
#[derive(Debug, Default)]
pub struct CarriedBlocks {
    /// Labels of blocks that are carried over.
    pub carried: Vec<String>,
    /// Labels of blocks that restart, each with a human-readable reason.
    pub anew: Vec<(String, String)>,
}

impl Heritage {
    /// Returns the heritage that the source of `to` takes over from ended sources. `ahead_ns`: lead of their host's clock over this
    /// host's.
    pub fn between(to: &Holding, before: &[Holding], ahead_ns: i64) -> (Heritage, CarriedBlocks) {
        let known: HashMap<&str, (&HeldBlock, SourceId)> =
            before.iter().flat_map(|holding| holding.blocks.iter().map(|held| (held.block.name(), (held, holding.source)))).collect();
        let (mut passes, mut times, mut passed) = (Vec::new(), Vec::<(Arc<Process>, Arc<Process>, SourceId)>::new(), CarriedBlocks::default());
        let mut last: *const Activation = ptr::null();
        for held in &to.blocks {
            let label = held.block.name().to_owned();
            let Some((from, source)) = known.get(label.as_str()) else {
                passed.anew.push((label, "there was no block of that name".to_owned()));
                continue;
            };
            match copies(&held.block, &from.block) {
                Err(why) => passed.anew.push((label, why)),
                Ok(copies) => {
                    let is_first = !ptr::eq(last, Arc::as_ptr(&held.activation));
                    last = Arc::as_ptr(&held.activation);
                    let activation = is_first.then(|| held.activation.clone());
                    passes.push(Pass { to: held.block.clone(), from: from.block.clone(), copies, activation });
                    if !times.iter().any(|(to, ..)| Arc::ptr_eq(to, &held.process)) {
                        times.push((held.process.clone(), from.process.clone(), *source));
                    }
                    passed.carried.push(label);
                }
            }
        }
        let left = Mutex::new(Vec::with_capacity(to.devices.len()));
        (Heritage { passes, times, devices: to.devices.clone(), ahead_ns, left, is_done: Arc::default() }, passed)
    }

    /// Returns the flag that is set once the heritage has been carried out.
    pub fn is_done(&self) -> Arc<AtomicBool> {
        self.is_done.clone()
    }

    /// Carries out the inheritance of a device that belongs to no source and is therefore accessed by no other thread.
    ///
    /// # Safety
    /// No kernel may have `device` in its table, and the host of the previous device must have ended.
    pub unsafe fn alone(device: &Device, ahead_ns: i64) {
        // SAFETY: the caller's word.
        drop(unsafe { heir::inherit(device, ahead_ns) });
    }
}

impl Inheritance for Heritage {
    unsafe fn carry_out(&mut self, source: SourceId) {
        for pass in &self.passes {
            for (from, to) in &pass.copies {
                // SAFETY: both cells are held and of one length (paired so); the sources of the first have ended, the second is of this source.
                unsafe { ptr::copy(from.start(), to.start(), to.len()) };
            }
            // SAFETY: each instance starts with its header, and neither runs; the activation is of this source.
            unsafe {
                let (to, from) = (&mut *pass.to.header(), &*pass.from.header());
                let shift = from.number.wrapping_sub(to.number);
                (to.number, to.activated) = (from.number, to.activated.wrapping_add(shift));
                if let Some(activation) = &pass.activation {
                    let state = &mut *activation.state();
                    (state.number, state.activated) = (state.number.wrapping_add(shift), state.activated.wrapping_add(shift));
                }
            }
        }
        for (to, from, before) in &self.times {
            if let (Some(to), Some(from)) = (to.time(source), from.time(*before)) {
                // SAFETY: the first is a time in this source, the source of the second has ended.
                unsafe { (*to.state()).keep(&*from.state(), self.ahead_ns) };
            }
        }
        let left = self.left.get_mut().expect("nobody locks it");
        for device in &self.devices {
            // SAFETY: a device of this source; the host before has ended.
            left.extend(unsafe { heir::inherit(device, self.ahead_ns) });
        }
        self.is_done.store(true, Ordering::Release);
    }
}

/// Returns the copies that make `to` continue from the state in which `from` stopped: parameters, states, outputs and the bound cells.
/// Fails with a description if the two faces differ.
fn copies(to: &Block, from: &Block) -> Result<Vec<(Cell, Cell)>, String> {
    let (items, others) = (to.items(), from.items());
    if items.len() != others.len() {
        return Err(format!("it has {} items, but the previous one had {}", items.len(), others.len()));
    }
    for (item, other) in items.iter().zip(others) {
        if !is_same_face(item, other) {
            return Err(format!("its item '{}' differs from '{}' of the previous one", text(item.name), text(other.name)));
        }
    }
    let ((memory, _, bound), (memory_before, _, bound_before)) = (to.parts(), from.parts());
    let mut copies = Vec::new();
    for (index, (item, other)) in items.iter().zip(others).enumerate() {
        if item.offset != NONE && other.offset != NONE {
            let (at, at_before, len) = (item.offset as usize, other.offset as usize, item.size as usize);
            let (now, before) = (memory.part(at, len), memory_before.part(at_before, len));
            if item.kind == kind::SIZE && now.load() != before.load() {
                return Err(format!("it is bound to a different '{}'", text(item.name)));
            }
            copies.push((before, now));
        }
        if let (Some(now), Some(before), true) = (&bound[index], &bound_before[index], item.kind != kind::DEVICE_READ) {
            if now.len() != before.len() {
                return Err(format!("its item '{}' is bound to a value of a different length", text(item.name)));
            }
            copies.push((before.clone(), now.clone()));
        }
    }
    copies.extend(from.reported().zip(to.reported()));
    Ok(copies)
}

fn is_same_face(item: &Item, other: &Item) -> bool {
    let words = |of: &Item| (of.kind, of.mode, of.size, of.offset == NONE, of.address == NONE);
    words(item) == words(other) && text(item.name) == text(other.name) && text(item.type_text) == text(other.type_text)
}

fn text(of: *const std::ffi::c_char) -> String {
    if of.is_null() {
        return String::new();
    }
    // SAFETY: a descriptor's texts end in NUL and live as long as its module, which the block holds.
    unsafe { CStr::from_ptr(of) }.to_string_lossy().into_owned()
}
