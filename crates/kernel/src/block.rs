// SPDX-License-Identifier: Apache-2.0
//! A function block instance as the kernel sees it: its memory and its entry.
use crate::containment::trust;
use crate::memory::Cell;
use crate::probe::{BlockTimes, Times};
use opengpac::abi::{Descriptor, Header, Item, NONE, flag, kind};
use std::any::Any;
use std::sync::Arc;

/// Identifier of an installed block in events. Assigned by the supervisor and never reused in the lifetime of the system.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub struct BlockId(pub u32);

/// An installed function block instance.
pub struct Block {
    id: BlockId,
    name: String,
    descriptor: &'static Descriptor,
    /// The instance, laid out as described in `opengpac::abi`.
    memory: Cell,
    /// Allocated memory: the instance, possibly followed by the word of reported conditions.
    whole: Cell,
    /// Bit mask of the items whose condition has been reported since the last reset.
    reported: Option<Cell>,
    /// Image that `Op::Reset` restores: the descriptor's image with the bindings and values of this instance.
    initial: Box<[u8]>,
    /// Byte ranges (offset, length) of the instance that a reset restores: everything except the header, items declared `keep`, and the
    /// parameters, presets and sizes, which are set from outside the block.
    restored: Vec<(usize, usize)>,
    /// Cells that the item addresses point to, kept alive as long as the block.
    bound: Vec<Option<Cell>>,
    /// Keeps the code loaded.
    module: Arc<dyn Any + Send + Sync>,
    times: Times,
}

impl Block {
    /// Returns the number of bytes of a block's memory, including the word of reported conditions ([`Block::reported`]).
    pub fn memory_size(descriptor: &Descriptor) -> usize {
        (descriptor.instance_size as usize).next_multiple_of(size_of::<u64>()) + size_of::<u64>()
    }

    /// Installs a block: copies the descriptor's image into `memory` (at least instance_size bytes, aligned), with all addresses null.
    /// `module` keeps the code loaded. The code module must lay out the instance as `opengpac::abi` describes. Panics if `memory` is too
    /// small or misaligned.
    pub fn install(id: BlockId, name: &str, descriptor: &'static Descriptor, module: Arc<dyn Any + Send + Sync>, memory: Cell) -> Block {
        trust(descriptor.run);
        let size = descriptor.instance_size as usize;
        let whole = memory;
        let memory = whole.part(0, size);
        let reported = (whole.len() >= Block::memory_size(descriptor)).then(|| whole.part(size.next_multiple_of(size_of::<u64>()), size_of::<u64>()));
        reported.iter().for_each(|word| word.store(&0u64.to_ne_bytes()));
        assert_eq!(
            memory.start() as usize % descriptor.instance_align.max(1) as usize,
            0,
            "the memory of block '{name}' is not aligned as its descriptor requires"
        );
        // SAFETY: a descriptor's image is `instance_size` bytes and lives as long as its module.
        let initial: Box<[u8]> = unsafe { std::slice::from_raw_parts(descriptor.image.cast::<u8>(), size) }.into();
        memory.store(&initial);
        let items = items(descriptor);
        Block {
            id,
            name: name.to_owned(),
            descriptor,
            restored: restored(items, size),
            memory,
            whole,
            reported,
            initial,
            bound: vec![None; items.len()],
            module,
            times: Times::default(),
        }
    }

    /// Binds item `item` (a port or device) to `cell`. Call before the block is part of a table. Panics if the item has no address or the
    /// cell is smaller than the item.
    pub fn bind(&mut self, item: usize, cell: &Cell) {
        let declared = &self.items()[item];
        assert!(declared.address != NONE, "item {item} of block '{}' is not a port or device, so it cannot be bound", self.name);
        let (at, size) = (declared.address as usize, declared.size as usize);
        let sized = declared.flags & flag::SIZED != 0;
        assert!(sized || cell.len() >= size, "item {item} of block '{}' has {size} bytes, but its cell has {}", self.name, cell.len());
        self.write(at, &(cell.start() as usize).to_ne_bytes());
        self.bound[item] = Some(cell.clone());
    }

    /// Sets the value of a parameter, preset or size, before the block becomes part of a table. The value becomes part of the initial
    /// image that [`Op::Reset`](crate::Op::Reset) restores. Panics if the item has no value or `bytes` is longer than it.
    pub fn set(&mut self, item: usize, bytes: &[u8]) {
        let declared = &self.items()[item];
        assert!(declared.offset != NONE, "item {item} of block '{}' has no value", self.name);
        assert!(bytes.len() <= declared.size as usize, "item {item} of block '{}' has {} bytes, not {}", self.name, declared.size, bytes.len());
        self.write(declared.offset as usize, bytes);
    }

    /// Returns the cell of a parameter's, preset's or output's own value (`self.field`), for `Op::Store` and `Op::Capture`; for an output
    /// that is used in place, returns the cell to which it is bound.
    pub fn value(&self, item: usize) -> Cell {
        let declared = &self.items()[item];
        if let (kind::OUTPUT, NONE, Some(bound)) = (declared.kind, declared.offset, &self.bound[item]) {
            return bound.clone();
        }
        assert!(declared.offset != NONE, "item {item} of block '{}' has no value", self.name);
        self.memory.part(declared.offset as usize, declared.size as usize)
    }

    /// Returns the cell of the value last published by output `item`, i.e. `self.field` at its next invocation; `None` for any other
    /// item.
    pub fn published(&self, item: usize) -> Option<Cell> {
        let declared = self.items().get(item)?;
        (declared.kind == kind::OUTPUT && declared.offset != NONE).then(|| self.memory.part(declared.offset as usize, declared.size as usize))
    }

    /// Returns the cell of the value last reported with condition `item`; `None` if the condition has no value.
    pub fn report(&self, item: usize) -> Option<Cell> {
        let declared = self.items().get(item)?;
        (declared.kind == kind::CONDITION && declared.report != NONE).then(|| self.memory.part(declared.report as usize, declared.size as usize))
    }

    /// Returns the block's identifier in events.
    pub fn id(&self) -> BlockId {
        self.id
    }

    /// Returns the block's human-readable name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the durations of the block's invocations, as sampled by the probe in this process.
    pub fn block_times(&self) -> BlockTimes {
        self.times.read()
    }

    pub(crate) fn times(&self) -> &Times {
        &self.times
    }

    /// Returns the block's descriptor, as declared by its module.
    pub fn descriptor(&self) -> &'static Descriptor {
        self.descriptor
    }

    /// Returns the block's memory, the image that a reset restores, and the cells to which its items are bound.
    pub fn parts(&self) -> (&Cell, &[u8], &[Option<Cell>]) {
        (&self.whole, &self.initial, &self.bound)
    }

    /// Installs a copy of a block from another processor: copies `initial`, and replaces its addresses by those of `bound`. Fails with a
    /// message if the arguments do not fit the descriptor.
    pub fn like(
        (id, name): (BlockId, &str),
        descriptor: &'static Descriptor,
        module: Arc<dyn Any + Send + Sync>,
        memory: Cell,
        initial: &[u8],
        bound: &[Option<Cell>],
    ) -> Result<Block, String> {
        let items = items(descriptor);
        if initial.len() != descriptor.instance_size as usize || bound.len() != items.len() || memory.len() < initial.len() {
            return Err(format!("block '{name}' does not match its code module; check the version of the module"));
        }
        if !(memory.start() as usize).is_multiple_of(descriptor.instance_align.max(1) as usize) {
            return Err(format!("the memory of block '{name}' is not aligned"));
        }
        for (item, cell) in items.iter().zip(bound) {
            // `abi::Run` guarantees its code that every address is bound.
            if cell.is_none() != (item.address == NONE) {
                return Err(format!("an item of block '{name}' is not bound, or cannot be bound"));
            }
            let fits = cell.as_ref().is_none_or(|cell| item.flags & flag::SIZED != 0 || cell.len() >= item.size as usize);
            if !fits {
                return Err(format!("an item of block '{name}' is bound to a cell that is too short"));
            }
        }
        let mut block = Block::install(id, name, descriptor, module, memory);
        block.write(0, initial);
        for (index, item) in items.iter().enumerate().filter(|(_, item)| item.address != NONE) {
            match &bound[index] {
                Some(cell) => block.bind(index, cell),
                None => block.write(item.address as usize, &0usize.to_ne_bytes()),
            }
        }
        Ok(block)
    }

    /// Returns the owner that keeps the block's code loaded.
    pub fn module(&self) -> &Arc<dyn Any + Send + Sync> {
        &self.module
    }

    /// Returns the name of the block in its module.
    pub fn code_name(&self) -> &str {
        // SAFETY: a descriptor's name is a text that lives as long as its module.
        unsafe { std::ffi::CStr::from_ptr(self.descriptor.name) }.to_str().unwrap_or_default()
    }

    /// Returns the instance pointer that is passed to the block's entry.
    pub(crate) fn instance(&self) -> *mut u8 {
        self.memory.start()
    }

    /// Returns the memory of the instance.
    pub(crate) fn memory(&self) -> &Cell {
        &self.memory
    }

    /// Returns the instance's header, which the kernel writes between two invocations.
    pub fn header(&self) -> *mut Header {
        self.memory.start().cast()
    }

    /// Returns the address and length of the value last reported with condition `item`; length 0 if the condition has no value.
    pub(crate) fn report_bytes(&self, item: usize) -> (*const u8, usize) {
        match self.items().get(item) {
            Some(declared) if declared.kind == kind::CONDITION && declared.report != NONE => {
                (self.memory.start().wrapping_add(declared.report as usize), declared.size as usize)
            }
            _ => (std::ptr::null(), 0),
        }
    }

    /// Records the conditions that an invocation has reported, one bit per item. Called by the source's own thread.
    pub(crate) fn note(&self, conditions: u64) {
        let Some(word) = &self.reported else { return };
        let word = word.start().cast::<u64>();
        // SAFETY: the word belongs to this block, is aligned as the instance is, and only the source's thread writes it.
        unsafe { word.write_unaligned(word.read_unaligned() | conditions) };
    }

    /// Returns the word of the conditions reported since the last reset; bit i represents item i.
    pub fn reported(&self) -> Option<Cell> {
        self.reported.clone()
    }

    /// Restores the initial image, except for kept items, and sets the invocation number to 0. Called by the source's own thread between
    /// two invocations.
    pub(crate) fn reset(&self) {
        let start = self.memory.start();
        for &(at, len) in &self.restored {
            // SAFETY: the stretch lies within the instance and within `initial`, which has the same length.
            unsafe { start.add(at).copy_from_nonoverlapping(self.initial.as_ptr().add(at), len) };
        }
        // SAFETY: the instance starts with its header.
        unsafe { self.header().write(Header::default()) };
        if let Some(word) = &self.reported {
            // SAFETY: as in `note`.
            unsafe { word.start().cast::<u64>().write_unaligned(0) };
        }
    }

    /// Takes over the states, outputs and invocation number of another block that runs the same code; does nothing if the code differs.
    /// Called by the source's own thread between two invocations.
    pub fn keep(&self, from: &Block) {
        if !self.is_same_code(from) || std::ptr::eq(self, from) {
            return;
        }
        for item in self.items().iter().filter(|item| matches!(item.kind, kind::STATE | kind::OUTPUT) && item.offset != NONE) {
            let (at, len) = (item.offset as usize, item.size as usize);
            // SAFETY: both instances are as the one descriptor says, and they are two.
            unsafe { self.memory.start().add(at).copy_from_nonoverlapping(from.memory.start().add(at), len) };
        }
        // SAFETY: each instance starts with its header.
        unsafe { (*self.header()).number = (*from.header()).number };
    }

    /// Returns true if both blocks are instances of the same block of the same module.
    pub fn is_same_code(&self, other: &Block) -> bool {
        std::ptr::eq(self.descriptor, other.descriptor)
    }

    /// Returns true if an output of this block is stored in `cell` or a part of it.
    pub fn writes(&self, cell: &Cell) -> bool {
        let (start, end) = (cell.start() as usize, cell.start() as usize + cell.len());
        let outputs = self.items().iter().zip(&self.bound).filter(|(item, _)| item.kind == kind::OUTPUT);
        outputs.filter_map(|(_, bound)| bound.as_ref()).any(|bound| (bound.start() as usize) < end && start < bound.start() as usize + bound.len())
    }

    /// Returns the items to which the block writes through an address (outputs and device channels), each with its cell.
    pub fn stores(&self) -> impl Iterator<Item = (&'static Item, &Cell)> {
        let stored = self.items().iter().zip(&self.bound).filter(|(item, _)| matches!(item.kind, kind::OUTPUT | kind::DEVICE_WRITE));
        stored.filter_map(|(item, cell)| Some((item, cell.as_ref()?)))
    }

    pub fn items(&self) -> &'static [Item] {
        items(self.descriptor)
    }

    fn write(&mut self, at: usize, bytes: &[u8]) {
        self.memory.part(at, bytes.len()).store(bytes);
        self.initial[at..at + bytes.len()].copy_from_slice(bytes);
    }
}

fn items(descriptor: &'static Descriptor) -> &'static [Item] {
    if descriptor.item_count == 0 {
        return &[];
    }
    // SAFETY: a descriptor's table has `item_count` items and lives as long as its module.
    unsafe { std::slice::from_raw_parts(descriptor.items, descriptor.item_count as usize) }
}

/// Returns true if a reset leaves the item's value unchanged, because it is set from outside the block or declared `keep`.
fn is_kept(item: &Item) -> bool {
    match item.kind {
        kind::PARAMETER | kind::CONDITION | kind::SIZE => true,
        kind::STATE => item.flags & flag::KEEP != 0,
        _ => false,
    }
}

/// Returns the byte ranges of an instance of `size` bytes, excluding its header, that contain no kept state.
fn restored(items: &[Item], size: usize) -> Vec<(usize, usize)> {
    let mut kept: Vec<(usize, usize)> =
        items.iter().filter(|item| is_kept(item) && item.offset != NONE).map(|item| (item.offset as usize, item.size as usize)).collect();
    kept.sort_unstable();
    let mut stretches = Vec::new();
    let mut at = size_of::<Header>();
    for (offset, len) in kept.into_iter().chain([(size, 0)]) {
        if offset > at {
            stretches.push((at, offset - at));
        }
        at = offset + len;
    }
    stretches
}
