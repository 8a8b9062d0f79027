// SPDX-License-Identifier: Apache-2.0
//! Blocks, and a program of one process, for the kernel's tests. The blocks are hand-written against the ABI: instances that load through
//! addresses, and store on success.
#![allow(dead_code, reason = "each test file uses its part")]
use kernel::*;
use opengpac::abi::{self, Descriptor, Header, Invocation, Item, NONE, kind};
use runtime::{ClockKind, Host};
use std::ffi::{CString, c_void};
use std::sync::Arc;

/// The memory of every test block: one input, one output, one condition, one parameter.
#[repr(C)]
#[derive(Default)]
pub struct Instance {
    pub header: Header,
    pub input: usize,
    pub output: usize,
    pub u: i64,
    pub y: i64,
    pub parameter: i64,
    pub report: i64,
    pub state: i64,
}

pub const INPUT: usize = 0;
pub const OUTPUT: usize = 1;
pub const CONDITION: usize = 2;
pub const PARAMETER: usize = 3;

/// Body of a test block: returns `Ok` with conditions to report, or the result of a fault.
pub type Body = fn(&mut Instance, &Invocation) -> u64;

/// Runs a body as generated entries do.
pub unsafe fn enter(instance: *mut c_void, invocation: *const Invocation, body: Body) -> u64 {
    unsafe {
        let this = &mut *instance.cast::<Instance>();
        let mut told = *invocation;
        told.number = this.header.number;
        let number = &raw mut this.header.number;
        number.write_volatile((told.number + 1) | abi::RUNNING);
        let mut local = Instance { header: this.header, ..std::ptr::read(this) };
        if this.input != 0 {
            local.u = (this.input as *const i64).read();
        }
        let result = body(&mut local, &told);
        number.write_volatile(told.number + 1);
        std::sync::atomic::compiler_fence(std::sync::atomic::Ordering::SeqCst);
        if result & abi::outcome::MASK == 0 {
            if this.output != 0 {
                (this.output as *mut i64).write(local.y);
            }
            (this.y, this.state, this.report, this.u) = (local.y, local.state, local.report, local.u);
        }
        result
    }
}

/// Makes an entry of a body.
#[macro_export]
macro_rules! block {
    ($body:expr) => {{
        unsafe extern "C" fn run(instance: *mut std::ffi::c_void, invocation: *const opengpac::abi::Invocation) -> u64 {
            unsafe { $crate::support::enter(instance, invocation, $body) }
        }
        $crate::support::describe(run)
    }};
}

/// Makes a descriptor around an entry. It is leaked, since descriptors are constants.
pub fn describe(run: abi::Run) -> &'static Descriptor {
    let text = |text: &str| CString::new(text).unwrap().into_raw().cast_const();
    let item = |item_kind, name: &str, offset: usize, address: u32, report: u32| Item {
        kind: item_kind,
        mode: 0,
        flags: 0,
        ratio: 0,
        name: text(name),
        type_text: text("int64_t"),
        unit: text(""),
        doc: text(""),
        offset: offset as u32,
        size: 8,
        address,
        report,
        element: 8,
        reserved: 0,
    };
    let at = std::mem::offset_of!(Instance, input) as u32;
    let items = Box::leak(Box::new([
        item(kind::INPUT, "u", std::mem::offset_of!(Instance, u), at, NONE),
        item(kind::OUTPUT, "y", std::mem::offset_of!(Instance, y), at + 8, NONE),
        item(kind::CONDITION, "done", std::mem::offset_of!(Instance, parameter), NONE, std::mem::offset_of!(Instance, report) as u32),
        item(kind::PARAMETER, "p", std::mem::offset_of!(Instance, parameter), NONE, NONE),
        item(kind::STATE, "x", std::mem::offset_of!(Instance, state), NONE, NONE),
    ]));
    let image = Box::leak(Box::new(Instance::default()));
    Box::leak(Box::new(Descriptor {
        abi: abi::ABI,
        item_count: items.len() as u32,
        name: text("test"),
        doc: text(""),
        items: items.as_ptr(),
        image: std::ptr::from_ref(image).cast(),
        instance_size: size_of::<Instance>() as u32,
        instance_align: 8,
        run,
        file: text(file!()),
        line: line!(),
        reserved: 0,
    }))
}

/// Reports the block's condition.
pub const DONE: u64 = 1 << (abi::outcome::SHIFT as usize + CONDITION);
/// A returned fault with code 7.
pub const FAULT: u64 = abi::outcome::FAULT | 7 << abi::outcome::SHIFT;

/// Returns an installed block with its input and output bound.
pub fn install(id: u32, descriptor: &'static Descriptor, input: Option<&Cell>, output: Option<&Cell>) -> Block {
    let size = descriptor.instance_size as usize;
    let mut block = Block::install(BlockId(id), &format!("b{id}"), descriptor, Arc::new(()), Extent::new(size).cell(0, size));
    if let Some(cell) = input {
        block.bind(INPUT, cell);
    }
    if let Some(cell) = output {
        block.bind(OUTPUT, cell);
    }
    block
}

pub fn step(block: &Arc<Block>, activation: &Arc<Activation>, process: &Arc<Process>, drivers: &[u32]) -> Step {
    Step { kind: StepKind::Block(block.clone()), activation: activation.clone(), process: process.clone(), drivers: drivers.to_vec() }
}

pub fn table(steps: Vec<Step>) -> Table {
    Table::new(steps, vec![], vec![], vec![], None)
}

pub fn script(ops: Vec<Op>) -> Box<Script> {
    Box::new(Script { id: 1, ops })
}

pub fn interval() -> Arc<Activation> {
    Activation::new(Due::Interval, None)
}

/// Returns an activation at each interval with a budget of 0.2 s, so that a block that loops is ended after 0.2 s instead of 1 s.
pub fn limited() -> Arc<Activation> {
    Activation::with_budget(Due::Interval, None, Some(200_000_000))
}

/// Returns adjacent cells of 8 bytes.
pub fn cells(n: usize) -> Vec<Cell> {
    let extent = Extent::new(8 * n);
    (0..n).map(|at| extent.cell(8 * at, 8)).collect()
}

pub fn value(cell: &Cell) -> i64 {
    i64::from_ne_bytes(cell.load().try_into().unwrap())
}

pub fn timer(name: &str, period_ns: u64, priority: u8) -> SourceSpec {
    SourceSpec { rtp: 0, name: name.into(), kind: SourceKind::Timer { period_ns }, priority, core: None, virtual_cost_ns: 0 }
}

pub fn software(name: &str, priority: u8) -> SourceSpec {
    SourceSpec { kind: SourceKind::Software, ..timer(name, 0, priority) }
}

pub fn virtual_host(seed: u64) -> Host {
    Host::new(ClockKind::Virtual { seed }, Box::new(interconnect::Memory))
}

pub fn monotonic_host() -> Host {
    Host::new(ClockKind::Monotonic, Box::new(interconnect::Memory))
}

/// Runs every firing up to and including `until_ns`.
pub fn run_until(host: &Host, until_ns: i64) {
    while host.fire_next(until_ns).unwrap() {}
    host.set_now(until_ns);
}

/// Returns all events so far.
pub fn events(host: &Host) -> Vec<Event> {
    std::iter::from_fn(|| host.poll()).collect()
}

/// Waits, under the monotonic clock, for the first event that `wanted` accepts.
pub fn await_event<T>(host: &Host, mut wanted: impl FnMut(Event) -> Option<T>) -> T {
    loop {
        while let Some(event) = host.poll() {
            if let Some(found) = wanted(event) {
                return found;
            }
        }
        host.park(None);
    }
}

/// Returns the next number of xorshift64*.
pub fn random(seed: &mut u64) -> u64 {
    *seed ^= *seed >> 12;
    *seed ^= *seed << 25;
    *seed ^= *seed >> 27;
    seed.wrapping_mul(0x2545_f491_4f6c_dd1d)
}

/// Returns a random number below `below`.
pub fn random_below(seed: &mut u64, below: u64) -> u64 {
    (random(seed) >> 11) % below
}

/// Returns the number in an environment variable.
pub fn setting(name: &str, default: u64) -> u64 {
    std::env::var(name).map_or(default, |given| given.parse().expect("a number"))
}
