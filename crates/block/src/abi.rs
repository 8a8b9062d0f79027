// SPDX-License-Identifier: Apache-2.0
//! The C ABI of a function block: all that a code module and the real-time system share.
//!
//! A code module exports one C function, `const opengpac_module *opengpac_module(void)`, which lists descriptors. A descriptor
//! says everything about a block: its interface as a table of items, the memory of one instance, and one entry to run it.
//!
//! # The memory of an instance
//!
//! ```text
//! offset 0   Header          number of the next invocation, number at activation
//!            addresses       one pointer for each input, output and device item
//!            self            a value for each item (inputs, outputs, devices, parameters, presets, states), reports
//! ```
//!
//! `Descriptor::image` is such a memory with every default in place and every address null; installing a block is one copy of
//! it and one store for each address. `run` loads its inputs through the addresses into a *local copy* of `self`, runs the body
//! on that, and on success (and only then) stores outputs through their addresses and the local copy back. So inputs are
//! latched, outputs appear together after the body has returned, and an invocation that faults leaves everything as it was.
//! Whatever happens, `run` adds one to `Header::number`.
//!
//! An invocation stores all or nothing, also where a signal ends it: until right before its first store `run` has [`RUNNING`] set in
//! `Header::number`. Only so long may it be ended; from there on a thread that wants to end it waits until it has returned.
//!
//! This file and `include/opengpac.h` describe the same bytes; a test compares every offset.

use core::ffi::{c_char, c_void};

/// Version of this ABI. A module of another version is refused by name.
pub const ABI: u32 = 2;

/// The most items one block may declare. A condition reports as bit `8 + its item index` of what `run` returns.
pub const ITEMS_MAX: usize = 32;

/// Time and number of an invocation. All of it is under the clock of the real-time system.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Invocation {
    /// Invocations of this instance since its verb was started, from 0; releases that were skipped count.
    pub number: u64,
    /// Running time of the verb since its start, ns: it stands still while the verb is suspended.
    pub time_ns: i64,
    /// Release time of the firing, ns on the system's clock.
    pub now_ns: i64,
}

/// The first bytes of every instance. The kernel writes it only between two invocations.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Header {
    /// Number of the next invocation; with [`RUNNING`] while one runs and has stored nothing.
    pub number: u64,
    /// `number` when the instance was last activated: a ratio output n is stored on invocations n, 2n, … from there.
    pub activated: u64,
}

/// In `Header::number`: an invocation runs and has stored nothing, so that it may be ended.
pub const RUNNING: u64 = 1 << 63;

/// Low 8 bits of what `run` returns.
pub mod outcome {
    /// Success: outputs and state are stored. With no condition reported the whole result is 0, the hot path.
    pub const DONE: u64 = 0;
    /// The body returned a fault. Bits 8 and up: the code that it gave.
    pub const FAULT: u64 = 1;
    /// The body panicked (Rust).
    pub const PANIC: u64 = 2;
    /// An output that is not declared `nonfinite` was not finite. Bits 8 and up: the item's index.
    pub const NONFINITE: u64 = 3;
    /// An exception left the body (C++). Bits 8 and up: the address of what it says, a text of at most [`WHAT_MAX`] bytes and a 0 in
    /// memory of the module; read at once, because the next exception takes its place.
    pub const THREW: u64 = 4;
    /// The most bytes of what an exception says.
    pub const WHAT_MAX: usize = 200;
    /// The body called fork(): no entry gives it, its guard does.
    pub const FORKED: u64 = 0xfd;
    /// The body changed the floating-point control words of its thread: no entry gives it, who looks after the words does.
    pub const FLOATS: u64 = 0xfe;
    /// A signal ended the body: no entry gives it, its guard does. Bits 8 and up: the signal, 0 for time that ran out; with [`LOST`].
    pub const SIGNAL: u64 = 0xff;
    /// In the detail of `SIGNAL`: it was ended in code of a library that may hold a lock, which nobody gives back.
    pub const LOST: u64 = 0x100;
    /// The bits that hold the outcome.
    pub const MASK: u64 = 0xff;
    /// Where the reported conditions (or, for a fault, its detail) start.
    pub const SHIFT: u32 = 8;
}

/// Marks of the loader about a block in `Descriptor::reserved`, for the kernel; a module says 0.
pub mod mark {
    /// It came with a code module.
    pub const LOADED: u32 = 1;
    /// Its module can change floating-point control words.
    pub const FLOATS: u32 = 2;
}

/// Kinds of an interface's items: the paper's five components, and state.
pub mod kind {
    pub const INPUT: u8 = 1;
    pub const OUTPUT: u8 = 2;
    pub const DEVICE_READ: u8 = 3;
    pub const DEVICE_WRITE: u8 = 4;
    pub const CONDITION: u8 = 5;
    pub const PARAMETER: u8 = 6;
    pub const STATE: u8 = 7;
    /// The number of elements n of a block for any number of elements: a `uint32_t` between `ratio` and `limit`.
    pub const SIZE: u8 = 8;
}

/// Relation of a port's updates to the block's invocations.
pub mod mode {
    pub const SYNCHRONOUS: u8 = 0;
    pub const RATIO: u8 = 1;
    pub const ASYNCHRONOUS: u8 = 2;
}

/// Further properties that an item declares.
pub mod flag {
    /// An input that may stay unbound: its value in the image is the constant that it then reads.
    pub const DEFAULT: u16 = 1;
    /// An output whose value need not be finite.
    pub const NONFINITE: u16 = 2;
    /// A state that survives a new start of its verb.
    pub const KEEP: u16 = 4;
    /// An array of n elements, n being the block's `SIZE` item; `size` is that of the largest n, `element` of one element.
    pub const SIZED: u16 = 8;
    /// An input that holds the last n values of what it is bound to, oldest first: `ratio` is n, `type_text` and `element` are those of one
    /// value, `size` is that of all n.
    pub const HISTORY: u16 = 16;
}

/// "Has none": no address (offset 0 is the header, so it could not be one, but say so), no report value.
pub const NONE: u32 = u32::MAX;

/// One item of an interface. Strings are UTF-8, end in NUL and live as long as the module.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Item {
    /// One of [`kind`].
    pub kind: u8,
    /// One of [`mode`]; 0 where the item is no port.
    pub mode: u8,
    /// Bits of [`flag`].
    pub flags: u16,
    /// n of a ratio port; the least n of a `SIZE`; the number of values of a `HISTORY`.
    pub ratio: u32,
    pub name: *const c_char,
    /// The C type as declared (`"double[6]"`, `"pose"`); empty for a condition without a value.
    pub type_text: *const c_char,
    /// Unit, or empty where it has none or none is known.
    pub unit: *const c_char,
    /// Description, one line.
    pub doc: *const c_char,
    /// Offset of the item's value (of a condition: its preset) in the instance; `NONE` for a condition without a value, and for an input
    /// or output that the block uses where it is bound: what it has written there stays, whatever becomes of the invocation.
    pub offset: u32,
    /// Bytes of the value.
    pub size: u32,
    /// Offset in the instance of the address that a port or device is bound by; `NONE` for the others.
    pub address: u32,
    /// Offset in the instance of the value that a condition reported last; `NONE` for the others.
    pub report: u32,
    /// Bytes of one element of a `SIZED` item, of one value of a `HISTORY`, else `size`; the maximum n of a `SIZE`.
    pub element: u32,
    /// 0, for a later version.
    pub reserved: u32,
}

/// The entry of a block: runs one invocation of the instance at `instance`.
///
/// It returns [`outcome`] in the low 8 bits and the reported conditions above (condition item i is bit `8 + i`).
///
/// # Safety
/// `instance` is the memory of an instance of this block, every address in it is bound to memory of the item's size and
/// alignment, and nobody else touches any of it during the call.
pub type Run = unsafe extern "C" fn(instance: *mut c_void, invocation: *const Invocation) -> u64;

/// Everything about one function block.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Descriptor {
    /// [`ABI`].
    pub abi: u32,
    pub item_count: u32,
    pub name: *const c_char,
    /// First sentence: what it computes, with its equation.
    pub doc: *const c_char,
    pub items: *const Item,
    /// A new instance, `instance_size` bytes.
    pub image: *const c_void,
    pub instance_size: u32,
    pub instance_align: u32,
    pub run: Run,
    /// Source file and line of the declaration.
    pub file: *const c_char,
    pub line: u32,
    /// 0 in a module; in the loader's copy bits of [`mark`].
    pub reserved: u32,
}

/// One named struct type that items of a module may have.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct TypeDescriptor {
    pub name: *const c_char,
    /// `"struct { double x; double[4] q; }"`: each member a type and a name; a member that is an array has the brackets at its type.
    pub declaration: *const c_char,
    pub doc: *const c_char,
    pub size: u32,
    pub align: u32,
}

/// Result of `opengpac_module()` of a code module.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Module {
    /// [`ABI`]. It comes first in every version of this struct, so that a module of any version can be told apart.
    pub abi: u32,
    pub block_count: u32,
    pub blocks: *const *const Descriptor,
    pub type_count: u32,
    pub reserved: u32,
    pub types: *const *const TypeDescriptor,
    /// Target that the module was compiled for, for example `x86_64-linux`.
    pub target: *const c_char,
    /// Compiler that built it, for people.
    pub compiler: *const c_char,
}

// SAFETY: the pointers of these tables lead to constants of a module that stays loaded while anybody holds them.
unsafe impl Sync for Item {}
// SAFETY: as for `Item`.
unsafe impl Sync for Descriptor {}
// SAFETY: as for `Item`.
unsafe impl Send for Descriptor {}
// SAFETY: as for `Item`.
unsafe impl Sync for TypeDescriptor {}
// SAFETY: as for `Item`.
unsafe impl Sync for Module {}

/// Name of the function that every code module exports.
pub const MODULE_SYMBOL: &str = "opengpac_module";
