// SPDX-License-Identifier: Apache-2.0
//! Trial of a block without a system: one instance, with its own cells for ports and devices.

use crate::abi::{Descriptor, Header, Invocation, RUNNING, Run, outcome};
pub use crate::fault::Fault;
use crate::read::{BlockFace, ItemFace, Kind, Refusal, TypeFace, TypeText};
use crate::what::What;
use core::ffi::c_void;
use std::alloc::{Layout, alloc_zeroed, dealloc, handle_alloc_error};

/// Cause of a failed access to a trial.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TrialError {
    /// The block has no item of this name; `items` lists the existing ones.
    NoSuchItem { block: String, item: String, items: Vec<String> },
    /// The value's length does not match the item's type.
    WrongLength { item: String, type_text: String, given: usize, wanted: usize },
    /// The item's type is a struct, so its value must be set and read as bytes.
    NotNumbers { item: String, type_text: String },
    /// The size is outside its limits.
    SizeOutOfRange { item: String, given: u32, least: u32, most: u32 },
    /// The item cannot be set, because it is an output or a condition without a value.
    NotSettable { item: String },
}

impl core::fmt::Display for TrialError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            TrialError::NoSuchItem { block, item, items } => write!(f, "block '{block}' has no item '{item}'; it has {}", items.join(", ")),
            TrialError::WrongLength { item, type_text, given, wanted } => write!(f, "item '{item}' ({type_text}) takes {wanted} values, not {given}"),
            TrialError::NotNumbers { item, type_text } => write!(f, "item '{item}' is a {type_text}, not numbers: give its bytes"),
            TrialError::SizeOutOfRange { item, given, least, most } => write!(f, "size '{item}' must be {least} to {most}, not {given}"),
            TrialError::NotSettable { item } => write!(f, "item '{item}' cannot be set: only the block writes it"),
        }
    }
}

impl std::error::Error for TrialError {}

/// Memory with a given size and alignment.
struct Memory {
    start: *mut u8,
    layout: Layout,
}

impl Memory {
    fn new(size: usize, align: usize) -> Memory {
        let layout = Layout::from_size_align(size.max(1), align).expect("the face has been checked");
        // SAFETY: the layout has at least one byte.
        let start = unsafe { alloc_zeroed(layout) };
        if start.is_null() {
            handle_alloc_error(layout);
        }
        Memory { start, layout }
    }
    fn bytes(&self) -> &[u8] {
        // SAFETY: our own memory, initialised, of this size; no invocation runs while the borrow lives.
        unsafe { core::slice::from_raw_parts(self.start, self.layout.size()) }
    }
    fn bytes_mut(&mut self) -> &mut [u8] {
        // SAFETY: as in `bytes`, and borrowed exclusively.
        unsafe { core::slice::from_raw_parts_mut(self.start, self.layout.size()) }
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        // SAFETY: allocated in `new` with this layout.
        unsafe { dealloc(self.start, self.layout) }
    }
}

// SAFETY: the memory belongs to this value alone.
unsafe impl Send for Memory {}

/// An instance of a block on trial.
pub struct Trial {
    face: BlockFace,
    instance: Memory,
    /// For each item: memory to which it is bound, if any.
    cells: Vec<Option<Memory>>,
    /// For each item: true if it is a history that has received a value.
    begun: Vec<bool>,
    /// Time between two invocations; default 1 ms.
    pub period_ns: i64,
    time_ns: i64,
    reported: u64,
}

impl Trial {
    /// Creates an instance of a block of this program. Its ports have their own cells, containing the defaults of the inputs, or zeros.
    ///
    /// # Panics
    /// Panics if the descriptor contradicts `abi`; descriptors created by the derive macro do not.
    pub fn new(descriptor: &'static Descriptor) -> Trial {
        match Trial::read(descriptor, &[]) {
            Ok(trial) => trial,
            Err(refusal) => panic!("{refusal}"),
        }
    }

    /// Creates an instance of a block whose items have these struct types.
    ///
    /// # Errors
    /// Fails if the descriptor contradicts `abi`.
    pub fn read(descriptor: &'static Descriptor, types: &[TypeFace]) -> Result<Trial, Refusal> {
        Ok(Trial::of(BlockFace::read(descriptor, types)?))
    }

    /// Creates an instance of a block whose descriptor has been read.
    pub fn of(face: BlockFace) -> Trial {
        let mut instance = Memory::new(face.instance_size, face.instance_align);
        // SAFETY: a descriptor's image has `instance_size` bytes.
        let image = unsafe { core::slice::from_raw_parts(face.descriptor.image.cast::<u8>(), face.instance_size) };
        instance.bytes_mut().copy_from_slice(image);
        let mut cells = Vec::new();
        for item in &face.items {
            cells.push(item.address.map(|address| {
                let mut cell = Memory::new(item.size, 64);
                cell.bytes_mut()[..item.initial.len()].copy_from_slice(&item.initial);
                let pointer = (cell.start as usize).to_ne_bytes();
                instance.bytes_mut()[address..address + pointer.len()].copy_from_slice(&pointer);
                cell
            }));
        }
        let begun = vec![false; cells.len()];
        Trial { face, instance, cells, begun, period_ns: 1_000_000, time_ns: 0, reported: 0 }
    }

    /// Returns the interface of the block on trial.
    pub fn face(&self) -> &BlockFace {
        &self.face
    }

    /// Sets an input, device channel, parameter, preset, state or size from the bytes of its type. A sized item takes all its elements or
    /// the number given by the size; a history takes its newest value or all values. The first value set also fills the rest of the
    /// history.
    ///
    /// # Errors
    /// Fails if there is no such item, it cannot be set, the length is wrong, or a size is outside its limits.
    pub fn set(&mut self, name: &str, bytes: &[u8]) -> Result<(), TrialError> {
        let (index, item) = self.find(name)?;
        let wanted = self.present_size(&item);
        let is_ours = item.kind != Kind::Output && (item.offset.is_some() || item.kind == Kind::Input);
        let Some(offset) = is_ours.then(|| item.offset.unwrap_or_default()) else { return Err(TrialError::NotSettable { item: item.name }) };
        let is_newest = item.history > 0 && bytes.len() == item.element;
        if bytes.len() != wanted && bytes.len() != item.size && !is_newest {
            return Err(TrialError::WrongLength { given: bytes.len(), wanted, item: item.name, type_text: item.type_text });
        }
        if let (Some((least, most)), Ok(given)) = (item.limits, bytes.try_into().map(u32::from_ne_bytes))
            && !(least..=most).contains(&given)
        {
            return Err(TrialError::SizeOutOfRange { item: item.name, given, least, most });
        }
        let begun = std::mem::replace(&mut self.begun[index], true);
        match &mut self.cells[index] {
            Some(cell) if is_newest && begun => {
                let values = &mut cell.bytes_mut()[..item.size];
                values.copy_within(item.element.., 0);
                values[item.size - item.element..].copy_from_slice(bytes);
            }
            Some(cell) if is_newest => cell.bytes_mut()[..item.size].chunks_mut(item.element).for_each(|value| value.copy_from_slice(bytes)),
            Some(cell) => cell.bytes_mut()[..bytes.len()].copy_from_slice(bytes),
            None => self.instance.bytes_mut()[offset..offset + bytes.len()].copy_from_slice(bytes),
        }
        Ok(())
    }

    /// Sets all elements of a numeric item, in order, converted to its type.
    ///
    /// # Errors
    /// Same as for [`Trial::set`]; also fails if the item is a struct.
    pub fn set_numbers(&mut self, name: &str, values: &[f64]) -> Result<(), TrialError> {
        let (_, item) = self.find(name)?;
        let base = TypeText::parse(&item.type_text).map(|text| text.base).unwrap_or_default();
        let mut bytes = Vec::new();
        for value in values {
            if !push_number(&mut bytes, &base, *value) {
                return Err(TrialError::NotNumbers { item: item.name, type_text: item.type_text });
            }
        }
        let wanted = self.present_size(&item);
        if bytes.len() != wanted && bytes.len() != item.size && (item.history == 0 || bytes.len() != item.element) {
            let each = bytes.len().checked_div(values.len()).unwrap_or(1);
            return Err(TrialError::WrongLength { given: values.len(), wanted: wanted / each.max(1), item: item.name, type_text: item.type_text });
        }
        self.set(name, &bytes)
    }

    /// Sets an item that consists of one number.
    ///
    /// # Errors
    /// Same as for [`Trial::set_numbers`].
    pub fn set_number(&mut self, name: &str, value: f64) -> Result<(), TrialError> {
        self.set_numbers(name, &[value])
    }

    /// Returns the bytes of an item: the last stored value of an output, or the last reported value of a condition.
    ///
    /// # Errors
    /// Fails if there is no such item, or it is a condition without a value.
    pub fn get(&self, name: &str) -> Result<Vec<u8>, TrialError> {
        let (index, item) = self.find(name)?;
        let size = self.present_size(&item);
        match (&self.cells[index], item.report.or(item.offset)) {
            (Some(cell), _) => Ok(cell.bytes()[..size].to_vec()),
            (None, Some(offset)) => Ok(self.instance.bytes()[offset..offset + size].to_vec()),
            (None, None) => Err(TrialError::NotNumbers { item: item.name, type_text: "condition".to_string() }),
        }
    }

    /// Returns the elements of an item as numbers.
    ///
    /// # Errors
    /// Same as for [`Trial::get`]; also fails if the item is a struct.
    pub fn numbers(&self, name: &str) -> Result<Vec<f64>, TrialError> {
        let (_, item) = self.find(name)?;
        let base = TypeText::parse(&item.type_text).map(|text| text.base).unwrap_or_default();
        numbers(&base, &self.get(name)?).ok_or(TrialError::NotNumbers { item: item.name, type_text: item.type_text })
    }

    /// Returns an item that consists of one number, or the first element of an array.
    ///
    /// # Errors
    /// Same as for [`Trial::numbers`].
    pub fn number(&self, name: &str) -> Result<f64, TrialError> {
        let numbers = self.numbers(name)?;
        numbers.first().copied().ok_or_else(|| TrialError::WrongLength { item: name.to_string(), type_text: String::new(), given: 0, wanted: 1 })
    }

    /// Runs one invocation; the next one is due `period_ns` later.
    ///
    /// # Errors
    /// Fails if the invocation faulted; then only the invocation number has changed.
    pub fn run(&mut self) -> Result<(), Fault> {
        // SAFETY: `run_by` gives an instance that is whole.
        self.run_by(|run, instance, invocation| unsafe { run(instance, invocation) })
    }

    /// Runs one invocation through `call`, which invokes the entry under a guard and returns the entry's result, or [`outcome::SIGNAL`]
    /// with the signal number in the bits above it (0 for an exceeded budget). After a signal, the instance must not be run again.
    ///
    /// # Errors
    /// Same as for [`Trial::run`].
    pub fn run_by(&mut self, call: impl FnOnce(Run, *mut c_void, &Invocation) -> u64) -> Result<(), Fault> {
        let invocation = Invocation { number: 0, time_ns: self.time_ns, now_ns: self.time_ns };
        self.time_ns += self.period_ns;
        self.reported = 0;
        // Our own instance, with every address bound to a cell of its item's size, aligned to 64; `&mut self` excludes other accesses.
        let result = call(self.face.descriptor.run, self.instance.start.cast(), &invocation);
        let detail = result >> outcome::SHIFT;
        match result & outcome::MASK {
            outcome::DONE => {
                self.reported = detail;
                Ok(())
            }
            outcome::FAULT => Err(Fault::Returned(detail as u32)),
            outcome::NONFINITE => Err(Fault::NonFinite { item: self.face.items.get(detail as usize).map(|item| item.name.clone()).unwrap_or_default() }),
            outcome::FLOATS => Err(Fault::Floats),
            outcome::FORKED => Err(Fault::Forked),
            outcome::SIGNAL if detail & outcome::LOST != 0 => Err(Fault::Lost((detail & !outcome::LOST) as i32)),
            outcome::SIGNAL if detail == 0 => Err(Fault::Budget),
            outcome::SIGNAL => Err(Fault::Signal(detail as i32)),
            // SAFETY: an entry of this process has returned it.
            outcome::THREW => Err(Fault::Threw { what: unsafe { What::of(result) }.text() }),
            _ => Err(Fault::Panicked),
        }
    }

    /// Returns the conditions reported by the last invocation, in order of declaration.
    pub fn reported(&self) -> Vec<String> {
        self.face.items.iter().enumerate().filter(|(index, _)| self.reported >> index & 1 == 1).map(|(_, item)| item.name.clone()).collect()
    }

    /// Returns the number of the next invocation.
    pub fn next_number(&self) -> u64 {
        // SAFETY: an instance begins with its header.
        unsafe { (*self.instance.start.cast::<Header>()).number & !RUNNING }
    }

    fn find(&self, name: &str) -> Result<(usize, ItemFace), TrialError> {
        match self.face.item(name) {
            Some((index, item)) => Ok((index, item.clone())),
            None => Err(TrialError::NoSuchItem {
                block: self.face.name.clone(),
                item: name.to_string(),
                items: self.face.items.iter().map(|item| item.name.clone()).collect(),
            }),
        }
    }

    /// Returns the size of an item in bytes at the current block size.
    fn present_size(&self, item: &ItemFace) -> usize {
        match (item.sized, self.face.size().and_then(|(_, size)| size.offset)) {
            (true, Some(offset)) => {
                let n = self.instance.bytes()[offset..offset + 4].try_into().map(u32::from_ne_bytes).unwrap_or(0);
                item.element * n as usize
            }
            _ => item.size,
        }
    }
}

fn push_number(bytes: &mut Vec<u8>, base: &str, value: f64) -> bool {
    match base {
        "double" => bytes.extend(value.to_ne_bytes()),
        "float" => bytes.extend((value as f32).to_ne_bytes()),
        "int64_t" => bytes.extend((value as i64).to_ne_bytes()),
        "int32_t" => bytes.extend((value as i32).to_ne_bytes()),
        "int16_t" => bytes.extend((value as i16).to_ne_bytes()),
        "int8_t" => bytes.extend((value as i8).to_ne_bytes()),
        "uint64_t" => bytes.extend((value as u64).to_ne_bytes()),
        "uint32_t" => bytes.extend((value as u32).to_ne_bytes()),
        "uint16_t" => bytes.extend((value as u16).to_ne_bytes()),
        "uint8_t" => bytes.push(value as u8),
        "bool" => bytes.push(u8::from(value != 0.0)),
        _ => return false,
    }
    true
}

fn numbers(base: &str, bytes: &[u8]) -> Option<Vec<f64>> {
    macro_rules! each {
        ($ty:ty) => {
            bytes.chunks_exact(size_of::<$ty>()).map(|chunk| chunk.try_into().map(<$ty>::from_ne_bytes).map(|x| x as f64).ok()).collect()
        };
    }
    match base {
        "double" => each!(f64),
        "float" => each!(f32),
        "int64_t" => each!(i64),
        "int32_t" => each!(i32),
        "int16_t" => each!(i16),
        "int8_t" => each!(i8),
        "uint64_t" => each!(u64),
        "uint32_t" => each!(u32),
        "uint16_t" => each!(u16),
        "uint8_t" | "bool" => each!(u8),
        _ => None,
    }
}
