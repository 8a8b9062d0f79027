# SPDX-License-Identifier: Apache-2.0
"""Compiles a rewritten function to C through numba and LLVM. The result does not depend on the numba or Python runtime; a check of
LLVM's output ensures that.

This module uses numba's private interfaces, so the version is pinned: `pip install 'opengpac[numba]'`.
"""

from __future__ import annotations

import importlib
import json
import re
from collections.abc import Callable
from typing import Any, NoReturn

from ..errors import DefinitionError, Error
from .items import WIDTHS, Item, Refusing
from .rewriting import INVOCATION
from .translating import HEAD, Untranslatable, translated

VERSION = "0.68.1"
FORM = 3
"""Version of the generated code; part of the cache key."""
SYMBOL = "opengpac_python_body"
_LIBM = (
    "acos acosh asin asinh atan atan2 atanh cbrt ceil copysign cos cosh erf erfc exp exp2 expm1 fabs floor fmod hypot ldexp lgamma log "
    "log10 log1p log2 nearbyint pow remainder rint round sin sinh sqrt tan tanh tgamma trunc fma"
)
LIBM = frozenset(_LIBM.split()) | {f"{name}f" for name in _LIBM.split()} | {"memcpy", "memset", "memmove"}
LLVM = {"double": "double", "float": "float", "bool": "i8"} | {f"{s}int{n}_t": f"i{n}" for s in ("", "u") for n in (8, 16, 32, 64)}
CPU = "x86-64"
"""Target of the code, the same on every machine, so that a replay and other hosts run the same bytes."""

OK, NONE = 0, -2
"""Return values of numba's code if no exception occurred."""


def numba_modules() -> dict[str, Any]:
    """Returns numba's modules; imports them when the first block is compiled."""
    try:
        found = importlib.import_module("numba")
        wanted = ("core.compiler", "core.registry", "core.types", "core.errors")
        return {name: importlib.import_module(f"numba.{name}") for name in wanted} | {"version": found.__version__}
    except ImportError as why:
        text = f"a block in Python is compiled by numba, which is not installed ({why})"
        raise DefinitionError(text, remedy="run pip install 'opengpac[numba]'") from None


def compiled(function: Callable[..., None], items: list[Item], file: str, refusing: Refusing, line: int) -> str:
    """Compiles the function to C code for `opengpac_python_body`, with the arguments that `shim` passes."""
    numba = numba_modules()
    if numba["version"] != VERSION:
        refusing(line, f"it requires numba {VERSION}, but numba {numba['version']} is installed", "run pip install 'opengpac[numba]'")
    types = numba["core.types"]
    target = numba["core.registry"].cpu_target
    typing, context = target.typing_context, target.target_context
    typing.refresh()
    context.refresh()
    flags = numba["core.compiler"].Flags()
    # Without numba's runtime an allocation is a compile error; an exception of Python ends the invocation as a fault.
    flags.nrt, flags.enable_pyobject, flags.boundscheck, flags.error_model = False, False, True, "python"
    flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
    arguments = [_numba_type(types, item) for item in items] + [types.uint64, types.int64, types.int64]
    try:
        made = numba["core.compiler"].compile_extra(typing, context, function, tuple(arguments), types.none, flags, {})
    except Error:
        raise
    except Exception as why:
        _refuse(why, file, refusing, line)
    _check_types(made, items, refusing)
    return _linked(made, items, refusing, line)


def _numba_type(types: Any, item: Item) -> Any:
    element = getattr(types, WIDTHS[item.element].replace("bool_", "boolean"))
    if not item.shape and not item.written:
        return element
    return types.Array(element, max(len(item.shape), 1), "C", readonly=not item.written, aligned=True)


def _check_types(made: Any, items: list[Item], refusing: Refusing) -> None:
    """Refuses a number that does not fit an integer variable, because C would truncate it."""
    for item in items:
        if item.shape or not item.written or item.element in ("double", "float"):
            continue
        for name, found in made.type_annotation.typemap.items():
            if re.fullmatch(rf"{item.name}(\.\d+)*", name) and str(found).startswith("float"):
                remedy = f"write int(…), or declare '{item.name}' as float"
                refusing(item.line, f"'{item.name}' ({item.element}) cannot be assigned a {found}", remedy)


_ITEM = 'declare an array as an item, State(type="double[6]"), and change its elements'
REMEDIES = (
    ("NRT required|array_allocate|_empty_nd_impl|alloc", "it allocates memory", _ITEM),
    ("Cannot unify", "a variable has two incompatible types", "give it the same type on every path to that line"),
    ("readonly|read-only|Cannot modify", "it changes a value that the block may only read", "write to an output or a State"),
    ("UndefinedVariable|referenced before", "it reads a variable before it is assigned", "assign to it on every path to that line"),
)
"""Patterns of numba's messages, each with its meaning and an alternative."""


def _refuse(why: Exception, file: str, refusing: Refusing, line: int) -> NoReturn:
    text = str(why)
    loc = getattr(why, "loc", None)
    where = re.findall(rf"{re.escape(file)} \((\d+)\)|File \"{re.escape(file)}\", line (\d+)", text)
    if where:
        line = int(next(n for n in where[-1] if n))
    elif loc is not None and loc.filename == file:
        line = loc.line
    for pattern, what, remedy in REMEDIES:
        if re.search(pattern, text):
            refusing(line, what, remedy)
    lines = [one.strip() for one in text.splitlines() if one.strip() and not one.startswith(("Failed in", "During", "File", ">>>"))]
    refusing(line, f"numba cannot compile it: {lines[0] if lines else type(why).__name__}", "use numbers, arrays that are items, and math")


def _linked(made: Any, items: list[Item], refusing: Refusing, line: int) -> str:
    binding = importlib.import_module("llvmlite.binding")
    body = binding.parse_assembly(made.library.get_llvm_str())
    name = made.fndesc.llvm_func_name
    types = [str(argument.type) for argument in body.get_function(name).arguments]
    body.link_in(binding.parse_assembly(_wrapper(name, types, items, body.triple, body.data_layout)))
    inner = body.get_function(name)
    inner.linkage = "internal"
    inner.add_function_attribute("alwaysinline")
    machine = binding.Target.from_triple(body.triple).create_target_machine(cpu=CPU, features="", opt=2, reloc="pic", codemodel="default")
    builder = binding.create_pass_builder(machine, _options(binding))
    builder.getModulePassManager().run(body, builder)
    text = _without_leftovers(body, binding, builder)
    calls = {f.name for f in body.functions if f.is_declaration and not f.name.startswith("llvm.") and f"@{f.name}(" in text}
    strange = sorted(calls - LIBM)
    if strange:
        refusing(line, f"its machine code would call {', '.join(strange)}", "call only functions of math")
    try:
        return HEAD + translated(text, SYMBOL)
    except Untranslatable:
        return _called(machine.emit_assembly(body), items)


def _options(binding: Any) -> Any:
    """Returns the compiler options: no vectorisation, interleaving or unrolling, because only scalar code can be translated to C with
    bit-identical results."""
    options = binding.create_pipeline_tuning_options(speed_level=2)
    options.loop_vectorization = options.slp_vectorization = options.loop_interleaving = options.loop_unrolling = False
    return options


def _called(assembly: str, items: list[Item]) -> str:
    """Returns the body as assembly that C code can call."""
    types = [f"{i.element} *" if i.shape or i.written else i.element for i in items] + ["uint64_t", "int64_t", "int64_t"]
    lines = (*assembly.splitlines(), ".text")
    return "\n".join([
        f'extern int32_t {SYMBOL}({", ".join(types)}) __attribute__((visibility("hidden")));',
        *(f"__asm__({json.dumps(line + chr(10), ensure_ascii=False)});" for line in lines), "",
    ])  # fmt: skip


def _without_leftovers(body: Any, binding: Any, builder: Any) -> str:
    """Hides symbols that only numba's own callers need, removes those that are then unused, and returns the remaining text."""
    for variable in body.global_variables:
        if not variable.is_declaration:
            variable.linkage = "internal"
    manager = binding.create_new_module_pass_manager()
    manager.add_global_dead_code_eliminate_pass()
    manager.run(body, builder)
    return str(body)


def _wrapper(name: str, types: list[str], items: list[Item], triple: str, layout: str) -> str:
    """Returns the LLVM text of a function with C arguments, which calls numba's function with arrays of known length that have no owner."""
    outer, inner = [], [f"{types[0]} %ret", f"{types[1]} %exc"]
    before = ["%ret = alloca ptr", "%exc = alloca ptr", "store ptr null, ptr %exc"]
    at = 2
    for item in items:
        argument, llvm = f"%{item.name}", LLVM[item.element]
        if not item.shape and not item.written:
            outer.append(f"{llvm} {argument}")
            value = argument
            if types[at] != llvm:
                value = f"{argument}.cut"
                before.append(f"{value} = trunc {llvm} {argument} to {types[at]}")
            inner.append(f"{types[at]} {value}")
            at += 1
            continue
        outer.append(f"ptr noalias {argument}")
        shape = item.shape or (1,)
        size = {"double": 8, "float": 4, "i8": 1, "i16": 2, "i32": 4, "i64": 8}[llvm]
        count, strides = 1, []
        for length in reversed(shape):
            strides.insert(0, count * size)
            count *= length
        numbers = [*shape, *strides]
        inner += ["ptr null", "ptr null", f"i64 {count}", f"i64 {size}", f"ptr {argument}", *(f"i64 {n}" for n in numbers)]
        at += 5 + len(numbers)
    for word in INVOCATION:
        outer.append(f"i64 %opengpac_{word}")
        inner.append(f"i64 %opengpac_{word}")
    lines = "\n  ".join(before)
    return f"""target triple = "{triple}"
target datalayout = "{layout}"
declare i32 @{name}({", ".join(types)})
define i32 @{SYMBOL}({", ".join(outer)}) nounwind {{
  {lines}
  %status = call i32 @{name}({", ".join(inner)})
  ret i32 %status
}}
"""
