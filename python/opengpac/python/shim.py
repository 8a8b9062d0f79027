# SPDX-License-Identifier: Apache-2.0
"""C code around a compiled body: its declaration according to `opengpac.h`, and one call to the body.

Therefore staging, the check for finite values and publication on success work as for any block in C.
"""

from __future__ import annotations

import json

from .compiling import NONE, OK, SYMBOL
from .items import Item
from .words import Condition, Input, Output, Parameter, State

REGISTERS = 10
"""Maximum number of floats that are kept in registers for the body; there are 16 registers in total."""

FLOAT = """\
#if defined(__x86_64__)
#define OG_FLOAT(x) __asm__("" : "+x"(x))
#elif defined(__aarch64__)
#define OG_FLOAT(x) __asm__("" : "+w"(x))
#else
#define OG_FLOAT(x) ((void)0)
#endif"""


def source(name: str, doc: str, items: list[Item], body: str, file: str, line: int) -> str:
    """Returns the text of a C file with one block."""
    conditions = [i.name for i in items if isinstance(i.word, Condition)]
    # Load floats from memory directly into float registers: a detour through integer registers costs a fifth of a PID's time.
    floats = [i.name for i in items if not i.written and not i.shape and i.element in ("double", "float")][:REGISTERS]
    own = [f"opengpac_{i.name}" if i.name in floats else _argument(i) for i in items]
    given = [*own, "invocation->number", "invocation->time_ns", "invocation->now_ns"]
    lines = [
        "#include <opengpac.h>",
        FLOAT,
        body,
        f"#line {line} {quoted(file)}",
        f"FUNCTION_BLOCK({name}, {quoted(doc)}, {', '.join(map(declared, items))})",
        f"#line {line} {quoted(file)}",
        "{",
        *(f"    bool opengpac_reports_{c} = 0;" for c in conditions),
        *(f"    {i.element} opengpac_{i.name} = self->{i.name};" for i in items if i.name in floats),
        *(f"    OG_FLOAT(opengpac_{name});" for name in floats),
        f"    int32_t opengpac_status = {SYMBOL}({', '.join(given)});",
        f"    if (opengpac_status != {OK} && opengpac_status != {NONE}) return FAULT(1);",
        *(f"    if (opengpac_reports_{c}) report({c});" for c in conditions),
        "    return OK;",
        "}",
    ]
    return "\n".join(lines) + "\n"


def quoted(text: str) -> str:
    """Returns a C string literal."""
    return json.dumps(text, ensure_ascii=False).replace("??", "?\\?")


def _argument(item: Item) -> str:
    if isinstance(item.word, Condition):
        return f"(void *)&opengpac_reports_{item.name}"
    if item.shape:
        return f"(void *)self->{item.name}"
    return f"{'(void *)&' if item.written else ''}self->{item.name}"


def declared(item: Item) -> str:
    """Returns the declaration of one item in a `FUNCTION_BLOCK`'s list, in C."""
    word, name = item.word, item.name
    doc = quoted(word.doc or name)
    if isinstance(word, Condition):
        return f"condition({name}, {doc})"
    tail = f"{doc}, {quoted(word.unit)}" if word.unit else doc
    zero = item.default if item.default is not None else "0"
    if isinstance(word, Input):
        if word.history:
            return f"in_history({item.type}, {name}, {word.history}, {tail})"
        if word.ratio:
            return f"in_ratio({item.type}, {name}, {word.ratio}, {tail})"
        mode = "_async" if word.mode == "asynchronous" else ""
        if item.default is None:
            return f"in{mode}({item.type}, {name}, {tail})"
        return f"in{mode}_default({item.type}, {name}, {zero}, {tail})"
    if isinstance(word, Output):
        if word.ratio:
            return f"out_ratio({item.type}, {name}, {word.ratio}, {tail})"
        return f"out{'_nonfinite' if word.nonfinite else ''}({item.type}, {name}, {tail})"
    kind = {State: "state", Parameter: "param"}[type(word)]
    return f"{kind}{'_keep' if isinstance(word, State) and word.keep else ''}({item.type}, {name}, {zero}, {tail})"
