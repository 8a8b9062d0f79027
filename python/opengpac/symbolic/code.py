# SPDX-License-Identifier: Apache-2.0
"""C code of a block: CasADi's output, and a `FUNCTION_BLOCK` that calls it. Work vectors are on the stack and do not outlive an
invocation, so instances share no state, and a fault leaves no state behind."""

from __future__ import annotations

import ctypes
import re
from typing import Any

from .. import _native
from ..errors import DefinitionError, refuse
from ..python.shim import declared, quoted
from ..python.words import Condition
from .arguments import Argument, Arguments
from .solvers import reporting

WORK_BYTES_MAX = 256 << 10
_HEADERS = {"math.h", "stdarg.h", "string.h", "float.h", "limits.h", "stdint.h", "stddef.h"}
_ALLOCATES = re.compile(r"\b(malloc|calloc|realloc|free)\s*\(")


_MACROS = {
    "FUNCTION_BLOCK", "TYPE", "fpclassify", "isfinite", "isgreater", "isgreaterequal", "isinf", "isless", "islessequal",
    "islessgreater", "isnormal", "isunordered", "report_value", "signbit", "va_arg", "va_copy", "va_end",
}  # fmt: skip
"""Function-like macros of the headers that the generated C code includes."""


def named_for_c(function: Any) -> Any:
    """Returns the function under a name that is valid in C, because CasADi exports it under its own name, which may be `sin` or `int`."""
    name, library = str(function.name()), ctypes.CDLL(None)
    if _native.is_word_of_c(name) or name in _MACROS or name.startswith("casadi_") or hasattr(library, name):
        return function.slice(f"{name}_of_casadi", list(range(function.n_in())), list(range(function.n_out())))
    return function


def generated(library: Any, function: Any, block: str, publish_unsolved: bool = False) -> str:
    """Returns the C code that CasADi generates for a function; refuses the function if it cannot run in a block."""
    try:
        generator = library.CodeGenerator("opengpac_casadi", {"with_header": False, "casadi_int": "long long int"})
        generator.add(function)
        text = str(generator.dump())
    except (RuntimeError, NotImplementedError) as why:
        lines = [line.strip() for line in str(why).splitlines() if line.strip()]
        remedy = (
            "use only operations for which CasADi generates C: no Callback, and as solvers 'qrqp' in qpsol, or with 'sqpmethod' in nlpsol"
        )
        refuse(DefinitionError, f"block '{block}': CasADi generates no C for {function.name()}: {lines[-1] if lines else why}", remedy)
    errors = re.findall(r"#\s*error\s+(.+)", text)
    if errors:
        remedy = "use operations of CasADi itself; as solvers only 'qrqp' and 'sqpmethod' can be generated"
        refuse(DefinitionError, f"block '{block}': CasADi generates no C for a part of {function.name()}: {errors[0].strip()}", remedy)
    strange = sorted(set(re.findall(r'#\s*include\s*[<"]([^>"]+)[>"]', text)) - _HEADERS - {"stdio.h", "stdlib.h"})
    if strange:
        remedy = "use a solver that is generated completely: qpsol(…, 'qrqp', …), nlpsol(…, 'sqpmethod', …, {'qpsol': 'qrqp'})"
        refuse(DefinitionError, f"block '{block}': {function.name()} needs a library at run time: {', '.join(strange)}", remedy)
    if _ALLOCATES.search(text):
        found = _ALLOCATES.findall(text)[0]
        refuse(DefinitionError, f"block '{block}': the C code of {function.name()} calls {found}, but a block must not allocate")
    return reporting(text, function, block, publish_unsolved)


def work_bytes(function: Any) -> int:
    """Returns the size in bytes of a function's work vectors, including its arguments in CasADi's order."""
    sizes = sum(int(function.nnz_in(i)) for i in range(function.n_in())) + sum(int(function.nnz_out(i)) for i in range(function.n_out()))
    return 8 * (int(function.sz_arg()) + int(function.sz_res()) + int(function.sz_iw()) + int(function.sz_w()) + sizes)


def source(name: str, doc: str, arguments: Arguments, text: str, function: Any) -> str:
    """Returns the text of a C file with one block."""
    work = work_bytes(function)
    if work > WORK_BYTES_MAX:
        remedy = "make the problem smaller, or expand the function: function.expand()"
        refuse(
            DefinitionError,
            f"block '{name}' needs {work >> 10} kB of work vectors, but at most {WORK_BYTES_MAX >> 10} kB are available",
            remedy,
        )
    symbol = str(function.name())
    lines = [
        "#include <opengpac.h>",
        "#include <string.h>",
        "/* What CasADi exports stays in this file, and it prints nothing. */",
        "#define CASADI_SYMBOL_EXPORT static __attribute__((unused))",
        "#define CASADI_PRINTF(...) ((void)0)",
        text,
        f"FUNCTION_BLOCK({name}, {quoted(doc)}, {', '.join(map(declared, arguments.items))})",
        "{",
        f"    const casadi_real *opengpac_arg[{max(1, function.sz_arg())}] = {{0}};",
        f"    casadi_real *opengpac_res[{max(1, function.sz_res())}] = {{0}};",
        f"    casadi_int opengpac_iw[{max(1, function.sz_iw())}];",
        f"    casadi_real opengpac_w[{max(1, function.sz_w())}];",
        *(line for argument in arguments.inputs for line in _taken(argument)),
        *(line for argument in arguments.outputs for line in _offered(argument)),
        f"    if ({symbol}(opengpac_arg, opengpac_res, opengpac_iw, opengpac_w, 0)) return FAULT(1);",
        *(line for argument in arguments.outputs for line in _given(argument)),
        "    return OK;",
        "}",
    ]
    return "\n".join(lines) + "\n"


def _taken(argument: Argument) -> list[str]:
    """Returns the lines that pass an input to the function, either in place or copied in CasADi's order."""
    if argument.item is None:
        return []
    where = f"opengpac_arg[{argument.index}]"
    if argument.in_order:
        return [f"    {where} = (const casadi_real *)(const void *)&self->{argument.name};"]
    local = f"opengpac_in_{argument.index}"
    pairs = _pairs(argument)
    return [
        f"    casadi_real {local}[{argument.size}];",
        *(f"    {local}[{k}] = self->{argument.name}{at};" for k, at in pairs),
        f"    {where} = {local};",
    ]


def _offered(argument: Argument) -> list[str]:
    """Returns the lines that store a result in a temporary variable, because the function may read a state and write its next value in
    the same call."""
    if (argument.item is None and argument.back is None) or not argument.places:
        return []
    local = f"opengpac_out_{argument.index}"
    return [f"    casadi_real {local}[{len(argument.places)}];", f"    opengpac_res[{argument.index}] = {local};"]


def _given(argument: Argument) -> list[str]:
    """Returns the lines that store an output, and the next value of a state. Elements that are missing from the function's sparse output
    are 0."""
    if argument.item is not None and isinstance(argument.item.word, Condition):
        lines = [f"    if (opengpac_out_{argument.index}[0] != 0.0) report({argument.name});"] if argument.places else []
    else:
        lines = _stored(argument, argument.name) if argument.item is not None else []
    return lines + (_stored(argument, argument.back) if argument.back else [])


def _stored(argument: Argument, name: str) -> list[str]:
    local = f"opengpac_out_{argument.index}"
    if argument.in_order:
        return [f"    memcpy(&self->{name}, {local}, sizeof self->{name});"]
    zeros = [f"    memset(&self->{name}, 0, sizeof self->{name});"] if len(argument.places) < argument.size else []
    return zeros + [f"    self->{name}{at} = {local}[{k}];" for k, at in _pairs(argument)]


def _pairs(argument: Argument) -> list[tuple[int, str]]:
    """Returns pairs of the index of each of CasADi's elements and its index in the block's array."""
    if 1 in (argument.rows, argument.columns):
        vector = argument.size > 1
        return [(k, f"[{place}]" if vector else "") for k, place in enumerate(argument.places)]
    return [(k, f"[{place // argument.columns}][{place % argument.columns}]") for k, place in enumerate(argument.places)]
