# SPDX-License-Identifier: Apache-2.0
"""The C around a compiled body: its declaration in the words of `opengpac.h`, one call, and the body itself as assembly.

So staging, the check for finite values and publication on success are those of any block in C.
"""

from __future__ import annotations

import json

from .compiling import NONE, OK, SYMBOL
from .items import Item
from .words import Condition, Input, Output, Parameter, State


def source(name: str, doc: str, items: list[Item], assembly: str, file: str, line: int) -> str:
    """The text of a C file with one block."""
    types = [f"{i.element} *" if i.shape or i.written else i.element for i in items] + ["uint64_t", "int64_t", "int64_t"]
    conditions = [i.name for i in items if isinstance(i.word, Condition)]
    # In variables of their own: what the body stores one by one is not read back in pairs, which would wait for each store.
    scalars = [i for i in items if i.written and not i.shape and not isinstance(i.word, Condition)]
    given = [_argument(i) for i in items] + ["invocation->number", "invocation->time_ns", "invocation->now_ns"]
    lines = [
        "#include <opengpac.h>",
        f'extern int32_t {SYMBOL}({", ".join(types)}) __attribute__((visibility("hidden")));',
        *(f"__asm__({quoted(text)});" for text in (*assembly.splitlines(), ".text")),
        f"#line {line} {quoted(file, newline=False)}",
        f"FUNCTION_BLOCK({name}, {quoted(doc, newline=False)}, {', '.join(map(declared, items))})",
        f"#line {line} {quoted(file, newline=False)}",
        "{",
        *(f"    bool opengpac_reports_{c} = 0;" for c in conditions),
        *(f"    {i.element} opengpac_cell_{i.name} = self->{i.name};" for i in scalars),
        f"    int32_t opengpac_status = {SYMBOL}({', '.join(given)});",
        f"    if (opengpac_status != {OK} && opengpac_status != {NONE}) return FAULT(1);",
        *(f"    self->{i.name} = opengpac_cell_{i.name};" for i in scalars),
        *(f"    if (opengpac_reports_{c}) report({c});" for c in conditions),
        "    return OK;",
        "}",
    ]
    return "\n".join(lines) + "\n"


def quoted(text: str, newline: bool = True) -> str:
    """A string of C."""
    return json.dumps(text + ("\n" if newline else ""), ensure_ascii=False).replace("??", "?\\?")


def _argument(item: Item) -> str:
    if isinstance(item.word, Condition):
        return f"&opengpac_reports_{item.name}"
    if item.shape:
        return f"({item.element} *)(void *)self->{item.name}"
    return f"&opengpac_cell_{item.name}" if item.written else f"self->{item.name}"


def declared(item: Item) -> str:
    """One item of a `FUNCTION_BLOCK`'s list, in the words of C."""
    word, name = item.word, item.name
    doc = quoted(word.doc or name, newline=False)
    if isinstance(word, Condition):
        return f"condition({name}, {doc})"
    tail = f"{doc}, {quoted(word.unit, newline=False)}" if word.unit else doc
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
