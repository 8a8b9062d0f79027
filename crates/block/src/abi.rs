// SPDX-License-Identifier: Apache-2.0
//! C ABI of a function block: the complete interface between a code module and the real-time system.
//!
//! A code module exports one C function, `const opengpac_module *opengpac_module(void)`, which lists descriptors. A descriptor fully
//! describes a block: its interface as a table of items, the memory of one instance, and one entry to run it.
//!
//! # The memory of an instance
//!
//! ```text
//! offset 0   Header          number of the next invocation, number at activation
//!            addresses       one pointer for each input, output and device item
//!            self            a value for each item (inputs, outputs, devices, parameters, presets, states), reports
//! ```
//!
//! `Descriptor::image` is such a memory with all defaults set and all addresses null; installing a block takes one copy of it and one
//! store per address. `run` loads its inputs through the addresses into a *local copy* of `self`, runs the body on that, and only on
//! success stores outputs through their addresses and the local copy back. Inputs are thus latched, outputs appear together after the
//! body has returned, and an invocation that faults changes nothing. In any case, `run` increments `Header::number`.
//!
//! An invocation stores all or nothing, even if a signal ends it: `run` keeps [`RUNNING`] set in `Header::number` until right before its
//! first store. It may be ended only during that time; afterwards a thread that wants to end it waits until it has returned.
//!
//! This file and `include/opengpac.h` describe the same bytes; a test compares every offset.

use core::ffi::{c_char, c_void};

/// Version of this ABI. Modules with a different version are refused with a message that states their version.
pub const ABI: u32 = 2;

/// Maximum number of items that a block may declare. A condition is reported as bit `8 + its item index` of the result of `run`.
pub const ITEMS_MAX: usize = 32;

/// Time and number of an invocation. All times are on the clock of the real-time system.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Invocation {
    /// Number of invocations of this instance since its verb was started, from 0; includes skipped releases.
    pub number: u64,
    /// Running time of the verb since its start, ns; stops while the verb is suspended.
    pub time_ns: i64,
    /// Release time of the firing, ns on the system's clock.
    pub now_ns: i64,
}

/// Header at the start of every instance. The kernel writes it only between two invocations.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Header {
    /// Number of the next invocation, combined with [`RUNNING`] while an invocation runs and has stored nothing.
    pub number: u64,
    /// Value of `number` when the instance was last activated: a ratio output n is stored by invocations n, 2n, … counted from there.
    pub activated: u64,
}

/// Flag in `Header::number`: an invocation is running and has stored nothing, so that it may be aborted.
pub const RUNNING: u64 = 1 << 63;

/// Outcomes: the low 8 bits of the result of `run`.
pub mod outcome {
    /// Success: outputs and state are stored. If no condition was reported, the whole result is 0 (the hot path).
    pub const DONE: u64 = 0;
    /// The body returned a fault. Bits 8 and up contain its code.
    pub const FAULT: u64 = 1;
    /// The body panicked (Rust).
    pub const PANIC: u64 = 2;
    /// An output that is not declared `nonfinite` was not finite. Bits 8 and up contain the item's index.
    pub const NONFINITE: u64 = 3;
    /// An exception escaped the body (C++). Bits 8 and up contain the address of its message, at most [`WHAT_MAX`] bytes and a NUL in
    /// memory of the module; it must be read immediately, because the next exception overwrites it.
    pub const THREW: u64 = 4;
    /// Maximum length of an exception's message, in bytes.
    pub const WHAT_MAX: usize = 200;
    /// The body called fork(). Never returned by an entry, only set by its guard.
    pub const FORKED: u64 = 0xfd;
    /// The body changed the floating-point control words of its thread. Never returned by an entry, only set by the check of these words.
    pub const FLOATS: u64 = 0xfe;
    /// The body was aborted by a signal. Never returned by an entry, only set by its guard. Bits 8 and up contain the signal, 0 for an
    /// exceeded budget, possibly with [`LOST`].
    pub const SIGNAL: u64 = 0xff;
    /// In the detail of `SIGNAL`: the body was aborted in code of a library that may hold a lock, which would never be released.
    pub const LOST: u64 = 0x100;
    /// Mask of the outcome.
    pub const MASK: u64 = 0xff;
    /// Position of the first bit of the reported conditions or, for a fault, of its detail.
    pub const SHIFT: u32 = 8;
}

/// Flags in `Descriptor::reserved` that the loader sets for the kernel; 0 in a module.
pub mod mark {
    /// The block was loaded from a code module.
    pub const LOADED: u32 = 1;
    /// The block's module can change floating-point control words.
    pub const FLOATS: u32 = 2;
}

/// Kinds of interface items: the paper's five components, and state.
pub mod kind {
    pub const INPUT: u8 = 1;
    pub const OUTPUT: u8 = 2;
    pub const DEVICE_READ: u8 = 3;
    pub const DEVICE_WRITE: u8 = 4;
    pub const CONDITION: u8 = 5;
    pub const PARAMETER: u8 = 6;
    pub const STATE: u8 = 7;
    /// Number of elements n of a block with a variable number of elements: a `uint32_t` between `ratio` and `limit`.
    pub const SIZE: u8 = 8;
}

/// Modes: the relation of a port's updates to the block's invocations.
pub mod mode {
    pub const SYNCHRONOUS: u8 = 0;
    pub const RATIO: u8 = 1;
    pub const ASYNCHRONOUS: u8 = 2;
}

/// Further properties that an item declares.
pub mod flag {
    /// An input that may be left unbound; it then reads the constant in the image.
    pub const DEFAULT: u16 = 1;
    /// An output whose value need not be finite.
    pub const NONFINITE: u16 = 2;
    /// A state that survives a restart of its verb.
    pub const KEEP: u16 = 4;
    /// An array of n elements, where n is the block's `SIZE` item; `size` is the size for the maximum n, `element` the size of one
    /// element.
    pub const SIZED: u16 = 8;
    /// An input that holds the n most recent values of its binding, oldest first: `ratio` is n, `type_text` and `element` describe one
    /// value, and `size` is the size of all n.
    pub const HISTORY: u16 = 16;
}

/// Marks an absent address or report value (no item can be at offset 0, the header, but an explicit marker is clearer).
pub const NONE: u32 = u32::MAX;

/// Item of an interface. Strings are UTF-8, NUL-terminated, and live as long as the module.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Item {
    /// Kind: a constant of [`kind`].
    pub kind: u8,
    /// Mode: a constant of [`mode`]; 0 if the item is not a port.
    pub mode: u8,
    /// Flags: bits of [`flag`].
    pub flags: u16,
    /// n of a ratio port; the minimum n of a `SIZE`; the number of values of a `HISTORY`.
    pub ratio: u32,
    pub name: *const c_char,
    /// The C type as declared (`"double[6]"`, `"pose"`); empty for a condition without a value.
    pub type_text: *const c_char,
    /// Unit; empty if there is none or it is unknown.
    pub unit: *const c_char,
    /// Description, one line.
    pub doc: *const c_char,
    /// Offset of the item's value in the instance or, for a condition, of its preset. `NONE` for a condition without a value, and for an
    /// input or output that the block uses in place; values written in place are kept even if the invocation fails.
    pub offset: u32,
    /// Size of the value in bytes.
    pub size: u32,
    /// Offset in the instance of the address through which a port or device is bound; `NONE` for other items.
    pub address: u32,
    /// Offset in the instance of the value last reported with a condition; `NONE` for other items.
    pub report: u32,
    /// Size of one element of a `SIZED` item or of one value of a `HISTORY`, otherwise the same as `size`; for a `SIZE`, the maximum n.
    pub element: u32,
    /// Reserved for a later version; 0.
    pub reserved: u32,
}

/// Entry of a block: runs one invocation of the instance at `instance`.
///
/// Returns [`outcome`] in the low 8 bits and the reported conditions above (condition item i is bit `8 + i`).
///
/// # Safety
/// `instance` must be the memory of an instance of this block, every address in it must be bound to memory of the item's size and alignment, and no other code may access any of it during the call.
pub type Run = unsafe extern "C" fn(instance: *mut c_void, invocation: *const Invocation) -> u64;

/// Description of one function block.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Descriptor {
    /// [`ABI`].
    pub abi: u32,
    pub item_count: u32,
    pub name: *const c_char,
    /// Description, whose first sentence states what the block computes, with its equation.
    pub doc: *const c_char,
    pub items: *const Item,
    /// Image of a new instance, `instance_size` bytes.
    pub image: *const c_void,
    pub instance_size: u32,
    pub instance_align: u32,
    pub run: Run,
    /// Source file and line of the declaration.
    pub file: *const c_char,
    pub line: u32,
    /// 0 in a module; bits of [`mark`] in the loader's copy.
    pub reserved: u32,
}

/// A named struct type, for use by the items of a module.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct TypeDescriptor {
    pub name: *const c_char,
    /// `"struct { double x; double[4] q; }"`: a type and a name for each member; the brackets of an array member follow its type.
    pub declaration: *const c_char,
    pub doc: *const c_char,
    pub size: u32,
    pub align: u32,
}

/// Result of `opengpac_module()` of a code module.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Module {
    /// [`ABI`]. The first field in every version of this struct, so that a module's version can always be read.
    pub abi: u32,
    pub block_count: u32,
    pub blocks: *const *const Descriptor,
    pub type_count: u32,
    pub reserved: u32,
    pub types: *const *const TypeDescriptor,
    /// Target for which the module was compiled, for example `x86_64-linux`.
    pub target: *const c_char,
    /// Compiler that built the module, human-readable.
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
