// SPDX-License-Identifier: Apache-2.0
//! The C side: blocks and loops, compiled when the benchmark starts.
use opengpac::abi::{self, Descriptor};
use std::ffi::{CStr, CString, c_int, c_long, c_void};
use std::process::Command;

/// The four kinds, in the order of `loops.c`.
pub const KINDS: [&str; 4] = ["gain", "offset", "limit", "pid"];
/// Parameters of the loops' instances; those of the blocks are their defaults.
const PARAMETERS: [[f64; 3]; 4] = [[0.999, 0.0, 0.0], [0.001, 0.0, 0.0], [1e3, 0.0, 0.0], [0.5, 0.001, 0.1]];

#[repr(C)]
pub struct Work {
    u: *const f64,
    y: *mut f64,
    p: [f64; 3],
    s: [f64; 2],
}

#[repr(C)]
struct Call {
    run: *const c_void,
    instance: *mut Work,
}

/// The loaded code.
pub struct Module {
    pub blocks: [&'static Descriptor; 4],
    body: extern "C" fn(c_int) -> *const c_void,
    calls: extern "C" fn(*const c_void, c_long, c_long) -> c_long,
    checked: extern "C" fn(*const c_void, c_long, c_long) -> c_long,
    inlined: extern "C" fn(*const c_void, c_long, c_long, c_int) -> c_long,
}

impl Module {
    pub fn load() -> Module {
        let root = env!("CARGO_MANIFEST_DIR");
        let object = std::env::temp_dir().join(format!("opengpac-bench-{}.so", std::process::id()));
        let (include, source) = (format!("-I{root}/../block/include"), format!("{root}/examples/bench_dispatch/loops.c"));
        let flags = ["-std=c11", "-O2", "-shared", "-fPIC", "-ffp-contract=off", "-fvisibility=hidden"];
        let compiled = Command::new("cc").args(flags).args([&include, &source, "-o"]).arg(&object).status();
        assert!(compiled.expect("a C compiler is needed to compare with C").success());
        let path = CString::new(object.to_str().expect("the path of temporary files is text")).expect("a path has no NUL");
        // SAFETY: our own code, just compiled; its symbols have the types below.
        unsafe {
            let library = libc::dlopen(path.as_ptr(), libc::RTLD_NOW);
            drop(std::fs::remove_file(&object));
            assert!(!library.is_null(), "the compiled loops cannot be loaded");
            let symbol = |name: &CStr| libc::dlsym(library, name.as_ptr());
            let entry: extern "C" fn() -> *const abi::Module = std::mem::transmute(symbol(c"opengpac_module"));
            let module = &*entry();
            let blocks: &'static [*const Descriptor] = std::slice::from_raw_parts(module.blocks, module.block_count as usize);
            let find = |name: &str| blocks.iter().map(|block| &**block).find(|block| CStr::from_ptr(block.name).to_bytes() == name.as_bytes());
            Module {
                blocks: KINDS.map(|name| find(name).expect("`loops.c` has all four blocks")),
                body: std::mem::transmute::<*mut c_void, extern "C" fn(c_int) -> *const c_void>(symbol(c"loop_body")),
                calls: std::mem::transmute::<*mut c_void, extern "C" fn(*const c_void, c_long, c_long) -> c_long>(symbol(c"loop_calls")),
                checked: std::mem::transmute::<*mut c_void, extern "C" fn(*const c_void, c_long, c_long) -> c_long>(symbol(c"loop_checked")),
                inlined: std::mem::transmute::<*mut c_void, extern "C" fn(*const c_void, c_long, c_long, c_int) -> c_long>(symbol(c"loop_inlined")),
            }
        }
    }
}

/// Which cells block i of n reads and writes, and of which kind it is.
#[derive(Clone, Copy)]
pub struct Shape {
    pub name: &'static str,
    pub chained: bool,
    pub mixed: bool,
    pub kind: usize,
}

impl Shape {
    /// Index of the cell that block `i` reads; it writes cell `i + 1`.
    pub fn input(&self, i: usize) -> usize {
        if self.chained { i } else { 0 }
    }

    pub fn kind_of(&self, i: usize) -> usize {
        if self.mixed { i % 4 } else { self.kind }
    }
}

/// The work of a shape as C loops run it.
pub struct Loops<'a> {
    module: &'a Module,
    calls: Vec<Call>,
    kind: c_int,
    _work: Vec<Work>,
    _cells: Vec<f64>,
}

impl<'a> Loops<'a> {
    pub fn new(module: &'a Module, shape: Shape, n: usize) -> Loops<'a> {
        let mut cells = vec![1.0; n + 1];
        let start = cells.as_mut_ptr();
        let at = |index: usize| start.wrapping_add(index);
        let mut work: Vec<Work> = (0..n).map(|i| Work { u: at(shape.input(i)), y: at(i + 1), p: PARAMETERS[shape.kind_of(i)], s: [0.0; 2] }).collect();
        let first = work.as_mut_ptr();
        let calls = (0..n).map(|i| Call { run: (module.body)(shape.kind_of(i) as c_int), instance: first.wrapping_add(i) }).collect();
        Loops { module, calls, kind: shape.kind as c_int, _work: work, _cells: cells }
    }

    pub fn calls(&self, rounds: usize) {
        (self.module.calls)(self.calls.as_ptr().cast(), self.calls.len() as c_long, rounds as c_long);
    }

    pub fn checked(&self, rounds: usize) {
        let faults = (self.module.checked)(self.calls.as_ptr().cast(), self.calls.len() as c_long, rounds as c_long);
        assert_eq!(faults, 0);
    }

    pub fn inlined(&self, rounds: usize) {
        (self.module.inlined)(self.calls.as_ptr().cast(), self.calls.len() as c_long, rounds as c_long, self.kind);
    }
}
