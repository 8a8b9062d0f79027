// SPDX-License-Identifier: Apache-2.0
//! Descriptors as ordinary, checked Rust values: a block as seen by the programming system and the supervisor.

mod check;
mod text;

use crate::abi::{self, Descriptor, Item, Module, TypeDescriptor, flag};
use check::check_block;
use core::ffi::{CStr, c_char};
pub use text::{TypeText, normalise};

/// Kind of an item.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    Input,
    Output,
    DeviceRead,
    DeviceWrite,
    Condition,
    Parameter,
    State,
    Size,
}

/// Relation of a port's updates to the block's invocations.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Mode {
    Synchronous,
    /// Ratio port with its n.
    Ratio(u32),
    Asynchronous,
}

/// One item of a block.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ItemFace {
    pub kind: Kind,
    /// Mode of a port; synchronous for items that are not ports.
    pub mode: Mode,
    pub name: String,
    /// Normalised type text: `double`, `double[6]`, `double[n]`, `pose`; empty for a condition without a value.
    pub type_text: String,
    /// Unit; empty if there is none.
    pub unit: String,
    pub doc: String,
    /// True for an input that may be left unbound.
    pub has_default: bool,
    /// True for an output whose value need not be finite.
    pub nonfinite: bool,
    /// True for a state that survives a restart.
    pub keep: bool,
    /// True for an array whose number of elements is given by the block's size.
    pub sized: bool,
    /// Number of values of a history input, else 0; `type_text` and `element` describe one value.
    pub history: u32,
    /// Minimum and maximum number of elements, for a size.
    pub limits: Option<(u32, u32)>,
    /// Offset of the value in the instance or, for a condition, of its preset, in bytes.
    pub offset: Option<usize>,
    /// Size of the value in bytes.
    pub size: usize,
    /// Size in bytes of one element of a sized item or of one value of a history; otherwise the same as `size`.
    pub element: usize,
    /// Offset of the address of a port or device in the instance, in bytes.
    pub address: Option<usize>,
    /// Offset of the value last reported with a condition, in bytes.
    pub report: Option<usize>,
    /// Value in the image: the default of an input, parameter or preset, or the initial value of a state.
    pub initial: Vec<u8>,
}

/// One function block.
#[derive(Clone, Debug)]
pub struct BlockFace {
    pub name: String,
    /// Description, whose first sentence states what the block computes.
    pub doc: String,
    /// File of the block's declaration.
    pub file: String,
    pub line: u32,
    pub items: Vec<ItemFace>,
    /// Size of an instance in bytes.
    pub instance_size: usize,
    pub instance_align: usize,
    /// Descriptor that the kernel installs. Modules are never unloaded.
    pub descriptor: &'static Descriptor,
}

/// One struct type.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TypeFace {
    pub name: String,
    /// Declaration: `struct { double x; double[4] q; }`
    pub declaration: String,
    pub doc: String,
    pub size: usize,
    pub align: usize,
}

/// A code module.
#[derive(Clone, Debug)]
pub struct ModuleFace {
    pub blocks: Vec<BlockFace>,
    pub types: Vec<TypeFace>,
    pub target: String,
    pub compiler: String,
}

impl core::fmt::Debug for Descriptor {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Descriptor").field("name", &string(self.name)).field("item_count", &self.item_count).finish_non_exhaustive()
    }
}

/// Reason why a module's tables are refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// The module was built for a different version of the ABI.
    AbiVersion { module: u32, here: u32 },
    /// The module contains no blocks.
    NoBlocks,
    /// An entry of the tables contradicts `abi`. `item` is empty if the error concerns the block itself, and `block` if it concerns the
    /// module.
    Invalid { block: String, item: String, what: String },
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Refusal::AbiVersion { module, here } => {
                write!(f, "the module has ABI version {module}, but this system has {here}: compile it again with this system's opengpac.h")
            }
            Refusal::NoBlocks => write!(f, "the module has no function block: declare one with FUNCTION_BLOCK"),
            Refusal::Invalid { block, item, what } if item.is_empty() => write!(f, "block '{block}' of the module is damaged: {what}"),
            Refusal::Invalid { block, item, what } => write!(f, "item '{block}.{item}' of the module is damaged: {what}"),
        }
    }
}

impl std::error::Error for Refusal {}

const BLOCKS_MAX: u32 = 10_000;

impl BlockFace {
    /// Reads a descriptor of this program or of a module that is never unloaded, and checks it against `types`.
    ///
    /// # Errors
    /// Fails if the descriptor contradicts `abi`.
    pub fn read(descriptor: &'static Descriptor, types: &[TypeFace]) -> Result<BlockFace, Refusal> {
        if descriptor.abi != abi::ABI {
            return Err(Refusal::AbiVersion { module: descriptor.abi, here: abi::ABI });
        }
        let name = string(descriptor.name).ok_or_else(|| invalid("", "", "the name of a block is missing or not UTF-8"))?;
        let bad = |what: &str| invalid(&name, "", what);
        if descriptor.item_count as usize > abi::ITEMS_MAX {
            return Err(bad("it has more than 32 items"));
        }
        if descriptor.image.is_null() || descriptor.run as usize == 0 || (descriptor.items.is_null() && descriptor.item_count > 0) {
            return Err(bad("it has no image, no entry or no items"));
        }
        check::check_memory(&name, descriptor)?;
        let mut items = Vec::new();
        for index in 0..descriptor.item_count as usize {
            // SAFETY: a descriptor has `item_count` items, `abi::Descriptor` says so.
            let item = unsafe { &*descriptor.items.add(index) };
            items.push(read_item(&name, descriptor, item)?);
        }
        let face = BlockFace {
            doc: string(descriptor.doc).ok_or_else(|| bad("its description is not UTF-8"))?,
            file: string(descriptor.file).ok_or_else(|| bad("its file name is not UTF-8"))?,
            line: descriptor.line,
            items,
            instance_size: descriptor.instance_size as usize,
            instance_align: descriptor.instance_align as usize,
            descriptor,
            name,
        };
        check_block(&face, types)?;
        Ok(face)
    }

    /// Returns the description of a block that is written in Rust and compiled into this program.
    ///
    /// # Panics
    /// Panics if the descriptor created by the derive macro contradicts `abi`, which should be impossible for a declaration that compiles. Item names are unique because they are field names.
    pub fn of<B: crate::FunctionBlock>() -> BlockFace {
        let types: Result<Vec<_>, _> = B::types().into_iter().map(TypeFace::read).collect();
        match types.and_then(|types| BlockFace::read(B::descriptor(), &types)) {
            Ok(face) => face,
            Err(refusal) => panic!("{refusal}"),
        }
    }

    /// Returns the item with this name and its index.
    pub fn item(&self, name: &str) -> Option<(usize, &ItemFace)> {
        self.items.iter().enumerate().find(|(_, item)| item.name == name)
    }

    /// Returns the block's size item and its index, if it has one.
    pub fn size(&self) -> Option<(usize, &ItemFace)> {
        self.items.iter().enumerate().find(|(_, item)| item.kind == Kind::Size)
    }
}

impl TypeFace {
    /// Reads a type of this program or of a module that is never unloaded.
    ///
    /// # Errors
    /// Fails if a name or text is not UTF-8, or the size is impossible.
    pub fn read(descriptor: &'static TypeDescriptor) -> Result<TypeFace, Refusal> {
        let name = string(descriptor.name).ok_or_else(|| invalid("", "", "the name of a type is missing or not UTF-8"))?;
        let bad = |what: &str| invalid("", &name, what);
        let face = TypeFace {
            declaration: normalise(&string(descriptor.declaration).ok_or_else(|| bad("its declaration is not UTF-8"))?),
            doc: string(descriptor.doc).ok_or_else(|| bad("its description is not UTF-8"))?,
            size: descriptor.size as usize,
            align: descriptor.align as usize,
            name: name.clone(),
        };
        if !face.align.is_power_of_two() || face.size == 0 || !face.size.is_multiple_of(face.align) {
            return Err(bad("its size and alignment contradict each other"));
        }
        Ok(face)
    }
}

impl ModuleFace {
    /// Reads the result of `opengpac_module()`.
    ///
    /// # Errors
    /// Fails if the ABI version differs, the module has no blocks, or the tables contradict `abi`.
    ///
    /// # Safety
    /// `module` must be null or point to a table as specified by `abi::Module` (of any version), and the module that contains the table must never be unloaded.
    pub unsafe fn read(module: *const Module) -> Result<ModuleFace, Refusal> {
        if module.is_null() {
            return Err(invalid("", "", "opengpac_module() returned nothing"));
        }
        // SAFETY: the version comes first in every version of the table.
        let version = unsafe { *module.cast::<u32>() };
        if version != abi::ABI {
            return Err(Refusal::AbiVersion { module: version, here: abi::ABI });
        }
        // SAFETY: the caller's promise, for this version.
        let module = unsafe { &*module };
        if module.block_count == 0 {
            return Err(Refusal::NoBlocks);
        }
        if module.block_count > BLOCKS_MAX || module.type_count > BLOCKS_MAX || module.blocks.is_null() {
            return Err(invalid("", "", "its table of blocks is damaged"));
        }
        let mut types: Vec<TypeFace> = Vec::new();
        for index in 0..module.type_count as usize {
            // SAFETY: a module has `type_count` types that live as long as it.
            let ty = TypeFace::read(unsafe { &**module.types.add(index) })?;
            match types.iter().find(|other| other.name == ty.name) {
                Some(other) if other.declaration == ty.declaration => {}
                Some(_) => return Err(invalid("", &ty.name, "two files of the module declare this type differently")),
                None => types.push(ty),
            }
        }
        let mut blocks: Vec<BlockFace> = Vec::new();
        for index in 0..module.block_count as usize {
            // SAFETY: a module has `block_count` blocks that live as long as it.
            let block = BlockFace::read(unsafe { &**module.blocks.add(index) }, &types)?;
            if blocks.iter().any(|other| other.name == block.name) {
                return Err(invalid(&block.name, "", "the module has two blocks of this name"));
            }
            blocks.push(block);
        }
        order_blocks(&mut blocks);
        let types = order_types(types);
        let text = |text, what: &str| string(text).ok_or_else(|| invalid("", "", what));
        Ok(ModuleFace { blocks, types, target: text(module.target, "its target is not UTF-8")?, compiler: text(module.compiler, "its compiler is not UTF-8")? })
    }
}

/// Restores the order of declaration, which a compiler may reverse.
fn order_blocks(blocks: &mut [BlockFace]) {
    let files: Vec<String> = blocks.iter().map(|block| block.file.clone()).collect();
    blocks.sort_by_key(|block| (files.iter().position(|file| *file == block.file), block.line));
}

/// Sorts types so that each follows the types of its members.
fn order_types(types: Vec<TypeFace>) -> Vec<TypeFace> {
    let mut rest = types;
    let mut ordered: Vec<TypeFace> = Vec::new();
    rest.sort_by(|a, b| a.name.cmp(&b.name));
    while !rest.is_empty() {
        let uses = |ty: &TypeFace, name: &str| ty.declaration.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').any(|word| word == name);
        let free = rest.iter().position(|ty| !rest.iter().any(|other| other.name != ty.name && uses(ty, &other.name)));
        // Members named like types may look like a cycle; any order will do then.
        ordered.push(rest.remove(free.unwrap_or(0)));
    }
    ordered
}

fn read_item(block: &str, descriptor: &'static Descriptor, item: &Item) -> Result<ItemFace, Refusal> {
    let name = string(item.name).ok_or_else(|| invalid(block, "", "the name of an item is missing or not UTF-8"))?;
    let bad = |what: &str| invalid(block, &name, what);
    let text = |text, what: &str| string(text).ok_or_else(|| invalid(block, &name, what));
    let kind = match item.kind {
        abi::kind::INPUT => Kind::Input,
        abi::kind::OUTPUT => Kind::Output,
        abi::kind::DEVICE_READ => Kind::DeviceRead,
        abi::kind::DEVICE_WRITE => Kind::DeviceWrite,
        abi::kind::CONDITION => Kind::Condition,
        abi::kind::PARAMETER => Kind::Parameter,
        abi::kind::STATE => Kind::State,
        abi::kind::SIZE => Kind::Size,
        _ => return Err(bad("its kind is unknown")),
    };
    let mode = match item.mode {
        abi::mode::SYNCHRONOUS => Mode::Synchronous,
        abi::mode::RATIO if item.ratio > 0 => Mode::Ratio(item.ratio),
        abi::mode::ASYNCHRONOUS => Mode::Asynchronous,
        _ => return Err(bad("its mode is unknown")),
    };
    check::check_item(block, &name, descriptor, item, kind)?;
    let some = |offset: u32| (offset != abi::NONE).then_some(offset as usize);
    let offset = some(item.offset);
    let initial = match offset {
        // SAFETY: `check_item` has found offset and size inside the image.
        Some(offset) => unsafe { core::slice::from_raw_parts(descriptor.image.cast::<u8>().add(offset), item.size as usize) }.to_vec(),
        None => Vec::new(),
    };
    Ok(ItemFace {
        kind,
        mode,
        type_text: normalise(&text(item.type_text, "its type is not UTF-8")?),
        unit: text(item.unit, "its unit is not UTF-8")?,
        doc: text(item.doc, "its description is not UTF-8")?,
        has_default: item.flags & flag::DEFAULT != 0,
        nonfinite: item.flags & flag::NONFINITE != 0,
        keep: item.flags & flag::KEEP != 0,
        sized: item.flags & flag::SIZED != 0,
        history: if item.flags & flag::HISTORY != 0 { item.ratio } else { 0 },
        limits: (kind == Kind::Size).then_some((item.ratio, item.element)),
        offset,
        size: item.size as usize,
        element: item.element as usize,
        address: some(item.address),
        report: some(item.report),
        initial,
        name: name.clone(),
    })
}

fn invalid(block: &str, item: &str, what: &str) -> Refusal {
    Refusal::Invalid { block: block.to_string(), item: item.to_string(), what: what.to_string() }
}

fn string(text: *const c_char) -> Option<String> {
    if text.is_null() {
        return None;
    }
    // SAFETY: the strings of a descriptor end in NUL and live as long as its module.
    unsafe { CStr::from_ptr(text) }.to_str().ok().map(str::to_string)
}
