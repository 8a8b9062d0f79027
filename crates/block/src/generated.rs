// SPDX-License-Identifier: Apache-2.0
//! Items used by the code that the derive macro generates. Not part of the public interface: may change with any version.

use crate::abi::{self, Descriptor, Header, Item, Module, Run, TypeDescriptor, flag};
use crate::bank::{self, Bank};
pub use crate::in_place::Lying;
use crate::{ConditionOf, Type, panics};
use core::ffi::{CStr, c_char, c_void};
use std::alloc::{Layout, alloc_zeroed, handle_alloc_error};
use std::ffi::CString;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// An item as parsed by the derive macro.
pub struct ItemSpec {
    pub kind: u8,
    pub mode: u8,
    pub ratio: u32,
    pub name: &'static str,
    pub unit: &'static str,
    pub doc: &'static str,
    pub has_default: bool,
    pub nonfinite: bool,
    pub keep: bool,
    pub sized: bool,
    pub history: bool,
    pub value: ValueSpec,
    pub offset: Option<usize>,
    pub address: Option<usize>,
    pub report: Option<usize>,
}

/// Value of an item: its C type and its sizes in bytes.
pub struct ValueSpec {
    text: String,
    size: usize,
    element: usize,
}

impl ValueSpec {
    pub fn none() -> ValueSpec {
        ValueSpec { text: String::new(), size: 0, element: 0 }
    }
    pub fn of<T: Type>() -> ValueSpec {
        ValueSpec { text: T::text(), size: size_of::<T>(), element: size_of::<T>() }
    }
    pub fn opaque<T: Copy + Default + 'static>() -> ValueSpec {
        ValueSpec { text: format!("uint8_t[{}]", size_of::<T>()), size: size_of::<T>(), element: size_of::<T>() }
    }
    pub fn sized<A: Array>(size_name: &str) -> ValueSpec {
        let whole = <A as Type>::text();
        let bracket = whole.find('[').expect("the text of an array has brackets");
        let rest = whole[bracket..].find(']').expect("brackets close") + bracket;
        ValueSpec { text: format!("{}[{size_name}{}", &whole[..bracket], &whole[rest..]), size: size_of::<A>(), element: size_of::<A::Element>() }
    }
    pub fn history<A: Array>() -> ValueSpec {
        ValueSpec { text: <A::Element as Type>::text(), size: size_of::<A>(), element: size_of::<A::Element>() }
    }
    pub fn size<N: SizeField>(most: u32) -> ValueSpec {
        ValueSpec { text: "uint32_t".to_string(), size: 4, element: most as usize }
    }
}

/// A condition with a value.
pub trait ValuedCondition {
    type Value: Type;
}

impl<T: Type> ValuedCondition for ConditionOf<T> {
    type Value = T;
}

/// The only type that a size may have.
pub trait SizeField {}
impl SizeField for u32 {}

/// Type of a `sized` or `history` item.
pub trait Array: Type {
    type Element: Type;
    fn elements(&self) -> &[Self::Element];
    fn elements_mut(&mut self) -> &mut [Self::Element];
}

impl<T: Type, const N: usize> Array for [T; N] {
    type Element = T;
    #[inline(always)]
    fn elements(&self) -> &[T] {
        self
    }
    #[inline(always)]
    fn elements_mut(&mut self) -> &mut [T] {
        self
    }
}

/// Returns an array with the first `count` elements at `from`, and zeros after them.
///
/// # Safety
/// `from` must point to at least `count` elements, and `count` must not exceed the array's length.
#[inline(always)]
pub unsafe fn load_sized<A: Array>(from: *const A, count: usize) -> A {
    let mut value = A::zero();
    // SAFETY: the caller's promise; `value` is a local of its own.
    unsafe { core::ptr::copy_nonoverlapping(from.cast::<A::Element>(), value.elements_mut().as_mut_ptr(), count) };
    value
}

/// Stores a value, with zeros in its padding.
///
/// # Safety
/// `to` must point to a value of this type.
#[inline(always)]
pub unsafe fn store<T: Type>(to: *mut T, value: &T) {
    // SAFETY: the caller's promise; `value` is a local of the entry.
    unsafe {
        *to = *value;
        if T::IS_PADDED {
            T::clear_padding(to);
        }
    }
}

/// Stores the first `count` elements, with zeros in their padding.
///
/// # Safety
/// Same as for [`load_sized`].
#[inline(always)]
pub unsafe fn store_sized<A: Array>(to: *mut A, value: &A, count: usize) {
    let to = to.cast::<A::Element>();
    // SAFETY: the caller's promise; `value` is a local of the entry.
    unsafe {
        core::ptr::copy_nonoverlapping(value.elements().as_ptr(), to, count);
        if A::Element::IS_PADDED {
            (0..count).for_each(|index| A::Element::clear_padding(to.add(index)));
        }
    }
}

/// Returns [`Type::nonfinite`] for the first `count` elements.
#[inline(always)]
pub fn nonfinite_sized<A: Array>(value: &A, count: usize) -> u64 {
    value.elements().iter().take(count).fold(0, |top, element| top | element.nonfinite())
}

/// Runs a body; returns `None` if it panicked.
#[inline(always)]
pub fn contain<R>(body: impl FnOnce() -> R) -> Option<R> {
    match catch_unwind(AssertUnwindSafe(body)) {
        Ok(result) => Some(result),
        Err(payload) => {
            discard(payload);
            None
        }
    }
}

/// Drops the payload of a panic; the drop itself may panic.
#[cold]
fn discard(payload: Box<dyn core::any::Any + Send>) {
    if let Err(second) = catch_unwind(AssertUnwindSafe(|| drop(payload))) {
        core::mem::forget(second);
    }
}

/// Builds the descriptor of a block, which is never freed.
#[allow(clippy::too_many_arguments)]
pub fn describe_block<I>(name: &str, doc: &str, file: &str, line: u32, run: Run, bank: Bank, items: Vec<ItemSpec>, image: I) -> &'static Descriptor {
    const { assert!(align_of::<Header>() <= align_of::<I>()) };
    panics::contain_entry(run as *const c_void);
    panics::contain_entry(bank as *const c_void);
    bank::add(run, bank);
    let table: Vec<Item> = items.iter().map(item).collect();
    Box::leak(Box::new(Descriptor {
        abi: abi::ABI,
        item_count: table.len() as u32,
        name: text(name),
        doc: text(doc),
        items: Vec::leak(table).as_ptr(),
        image: keep(image),
        instance_size: offset(size_of::<I>()),
        instance_align: offset(align_of::<I>()),
        run,
        file: text(file),
        line,
        reserved: 0,
    }))
}

fn item(spec: &ItemSpec) -> Item {
    let flags = [
        (spec.has_default, flag::DEFAULT),
        (spec.nonfinite, flag::NONFINITE),
        (spec.keep, flag::KEEP),
        (spec.sized, flag::SIZED),
        (spec.history, flag::HISTORY),
    ];
    Item {
        kind: spec.kind,
        mode: spec.mode,
        flags: flags.iter().filter(|(is, _)| *is).map(|(_, flag)| flag).sum(),
        ratio: if spec.history { offset(spec.value.size / spec.value.element.max(1)) } else { spec.ratio },
        name: text(spec.name),
        type_text: text(&spec.value.text),
        unit: text(spec.unit),
        doc: text(spec.doc),
        offset: spec.offset.map_or(abi::NONE, offset),
        size: offset(spec.value.size),
        address: spec.address.map_or(abi::NONE, offset),
        report: spec.report.map_or(abi::NONE, offset),
        element: offset(spec.value.element),
        reserved: 0,
    }
}

fn offset(bytes: usize) -> u32 {
    u32::try_from(bytes).expect("an instance is smaller than 4 GB")
}

/// Copies the image of an instance to a permanent location, with zeros in the padding between its fields.
fn keep<I>(image: I) -> *const c_void {
    let layout = Layout::new::<I>();
    // SAFETY: the layout has a size, that of a header at least; the memory is of that layout and is written whole.
    unsafe {
        let memory = alloc_zeroed(layout);
        if memory.is_null() {
            handle_alloc_error(layout);
        }
        memory.cast::<I>().write(image);
        memory.cast::<c_void>()
    }
}

fn text(text: &str) -> *const c_char {
    let text: &'static CStr = Box::leak(CString::new(text).expect("names and comments have no NUL").into_boxed_c_str());
    text.as_ptr()
}

/// Builds the descriptor of a struct type, which is never freed.
pub fn describe_type<T>(name: &str, doc: &str, members: &[(String, &str)]) -> &'static TypeDescriptor {
    let members: String = members.iter().map(|(ty, name)| format!(" {ty} {name};")).collect();
    Box::leak(Box::new(TypeDescriptor {
        name: text(name),
        declaration: text(&format!("struct {{{members} }}")),
        doc: text(doc),
        size: offset(size_of::<T>()),
        align: offset(align_of::<T>()),
    }))
}

/// Builds the table of a code module, which is never freed.
pub fn describe_module(blocks: Vec<&'static Descriptor>, types: Vec<&'static TypeDescriptor>) -> &'static Module {
    let mut distinct: Vec<*const TypeDescriptor> = Vec::new();
    for ty in types {
        if !distinct.iter().any(|other| core::ptr::eq(*other, ty)) {
            distinct.push(ty);
        }
    }
    let blocks: Vec<*const Descriptor> = blocks.into_iter().map(core::ptr::from_ref).collect();
    Box::leak(Box::new(Module {
        abi: abi::ABI,
        block_count: blocks.len() as u32,
        blocks: Vec::leak(blocks).as_ptr(),
        type_count: distinct.len() as u32,
        reserved: 0,
        types: Vec::leak(distinct).as_ptr(),
        target: text(target()),
        compiler: text("rustc"),
    }))
}

/// Returns the target for which this code is compiled, as named in `opengpac.h`.
pub fn target() -> &'static str {
    match (cfg!(target_arch = "x86_64"), cfg!(target_arch = "aarch64"), cfg!(target_arch = "riscv64")) {
        (true, ..) => "x86_64-linux",
        (_, true, _) => "aarch64-linux",
        (_, _, true) => "riscv64-linux",
        _ => "other",
    }
}
