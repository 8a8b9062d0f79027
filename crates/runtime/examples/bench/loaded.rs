// SPDX-License-Identifier: Apache-2.0
//! The C side: the hand-written loops, and the blocks of a code module.
use opengpac::abi::{Descriptor, Module, Run};
use opengpac::bank::{self, Bank};
use std::collections::HashMap;
use std::ffi::{CStr, CString, c_char, c_long, c_uchar, c_void};

type New = unsafe extern "C" fn(c_long, *const c_uchar, *const u32, *const u32, c_long) -> *mut c_void;
type Cycles = unsafe extern "C" fn(*mut c_void, c_long) -> i64;

/// The loaded C side.
pub struct LoadResult {
    new: New,
    free: unsafe extern "C" fn(*mut c_void),
    loops: [Cycles; 4],
    blocks: HashMap<String, &'static Descriptor>,
}

/// The hand-written loops.
#[derive(Clone, Copy)]
pub enum Loop {
    /// Calls through function pointers.
    Calls = 0,
    /// Calls through function pointers, with a check of the outputs.
    Checked = 1,
    /// Everything in one function.
    Inlined = 2,
    /// 100 chained gains, written out.
    WrittenOut = 3,
}

impl LoadResult {
    /// Loads both libraries. Panics with the reason if one of them cannot be loaded, because this program is for developers.
    pub fn open(peer: &str, blocks: &str) -> LoadResult {
        let (peer, module) = (library(peer), library(blocks));
        // SAFETY: the symbols have these types in `bench/c/peer.c`; a module exports `opengpac_module` as the ABI specifies.
        unsafe {
            let list: unsafe extern "C" fn() -> *const Module = std::mem::transmute(symbol(module, c"opengpac_module"));
            let list = &*list();
            let blocks = std::slice::from_raw_parts(list.blocks, list.block_count as usize).iter().map(|block| &**block);
            let blocks: HashMap<_, _> = blocks.map(|block: &'static Descriptor| (text(block.name), block)).collect();
            let bank_of: unsafe extern "C" fn(Run) -> Option<Bank> = std::mem::transmute(symbol(module, c"opengpac_bank_1"));
            blocks.values().filter_map(|block| Some((block.run, bank_of(block.run)?))).for_each(|(run, bank)| bank::add(run, bank));
            LoadResult {
                new: std::mem::transmute::<*mut c_void, New>(symbol(peer, c"peer_new")),
                free: std::mem::transmute::<*mut c_void, unsafe extern "C" fn(*mut c_void)>(symbol(peer, c"peer_free")),
                loops: [c"peer_calls", c"peer_checked", c"peer_inlined", c"peer_written_out"]
                    .map(|name| std::mem::transmute::<*mut c_void, Cycles>(symbol(peer, name))),
                blocks,
            }
        }
    }

    /// Returns the block of the C module with this name.
    pub fn block(&self, name: &str) -> &'static Descriptor {
        self.blocks.get(name).copied().expect("the names here are those of bench/c/blocks.c")
    }

    /// Creates a hand-written program that does the same work: block i of `kinds` reads value `reads[i]` and writes value `writes[i]`.
    pub fn peer(&self, kinds: &[u8], reads: &[u32], writes: &[u32], values: usize) -> Peer<'_> {
        let kinds: Box<[u8]> = kinds.into();
        // SAFETY: the arrays have one entry per block, and `kinds` is kept as long as the peer.
        let peer = unsafe { (self.new)(kinds.len() as c_long, kinds.as_ptr(), reads.as_ptr(), writes.as_ptr(), values as c_long) };
        Peer { loaded: self, peer, _kinds: kinds }
    }
}

/// A hand-written program in C.
pub struct Peer<'a> {
    loaded: &'a LoadResult,
    peer: *mut c_void,
    _kinds: Box<[u8]>,
}

impl Peer<'_> {
    /// Runs `cycles` cycles and returns their duration, ns.
    pub fn run(&self, by: Loop, cycles: usize) -> f64 {
        // SAFETY: the peer was made by `peer_new`.
        unsafe { self.loaded.loops[by as usize](self.peer, cycles as c_long) as f64 }
    }
}

impl Drop for Peer<'_> {
    fn drop(&mut self) {
        // SAFETY: the peer was made by `peer_new`, and is freed once.
        unsafe { (self.loaded.free)(self.peer) };
    }
}

fn library(path: &str) -> *mut c_void {
    let name = CString::new(path).expect("a path has no NUL");
    // SAFETY: loads a library that `bench/run.py` has just compiled.
    let library = unsafe { libc::dlopen(name.as_ptr(), libc::RTLD_NOW | libc::RTLD_LOCAL) };
    assert!(!library.is_null(), "cannot load '{path}': run it by bench/run.py, which compiles it");
    library
}

fn symbol(library: *mut c_void, name: &CStr) -> *mut c_void {
    // SAFETY: the library is loaded and stays loaded.
    let found = unsafe { libc::dlsym(library, name.as_ptr()) };
    assert!(!found.is_null(), "there is no {name:?}");
    found
}

fn text(text: *const c_char) -> String {
    // SAFETY: names of descriptors end in NUL and live as long as the module.
    unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
}
