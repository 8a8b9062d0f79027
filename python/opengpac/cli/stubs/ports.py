# SPDX-License-Identifier: Apache-2.0
"""Types of a block: its ports by name if it is labelled, the arguments of its uses and trials, and the result of a trial."""

from __future__ import annotations

import keyword

from ...definition.blocks import Block
from ...python import PythonBlock


def block_class(name: str, block: Block) -> list[str]:
    """Returns the classes of a block in a stub; a type checker reports ports that the block does not have."""
    items = {n: item for n, item in block.items.items() if n.isidentifier() and not keyword.iskeyword(n)}
    constant = [n for n, item in items.items() if item.kind in ("parameter", "size", "input", "condition")]
    taken = "".join(f", {n}: _Any = ..." for n in constant if n not in ("self", "steps", "every"))
    after = f", *{taken}" if taken else ""
    base = "PythonBlock[...]" if isinstance(block, PythonBlock) else "Block"
    return [
        f"class {name}_Ports(_gpac.Occurrence):",
        *(f"    {n}: _gpac.Reference" for n in items),
        "    def __getattr__(self, name: _Never) -> _Never: ...  # type: ignore[override]",
        "",
        f"class {name}_Use(_gpac.BlockUse):",
        f"    def labelled(self, label: str) -> {name}_Ports: ...  # type: ignore[override]",
        "",
        f"class {name}_Trial(_Trial):",
        *(f"    {n}: _np.ndarray" for n, item in items.items() if item.kind == "output"),
        "    def __getattr__(self, name: _Never) -> _Never: ...  # type: ignore[override]",
        "",
        f"class {name}_Block(_gpac.{base}):",
        f"    def __call__(self{after}) -> {name}_Use: ...  # type: ignore[override]",
        f"    def labelled(self, label: str) -> {name}_Ports: ...",
        f"    def run(self, steps: int | None = ..., every: _gpac.Quantity = ...{after}) -> {name}_Trial: ...  # type: ignore[override]",
        "",
    ]
