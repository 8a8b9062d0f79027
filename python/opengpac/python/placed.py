# SPDX-License-Identifier: Apache-2.0
"""Whether a block that stays Python lies on a processor of its own: a real-time thread must not wait for an interpreter."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any

from ..blocks import Block, BlockUse
from ..errors import PlacementError, refuse

if TYPE_CHECKING:
    from ..system import System
    from ..verbs import Verb


def interpreted(uses: Mapping[str, BlockUse], within: str = "") -> Iterator[tuple[str, str]]:
    """Label and name of each block that stays Python, in graphs too."""
    for label, use in uses.items():
        if not isinstance(use.block, Block):
            yield from interpreted(use.block.blocks, f"{within}{label}.")
        elif not getattr(use.block, "native", True):
            yield within + label, use.block.name.rpartition(".")[2]


def check_placed(verb: Verb[..., Any], system: System) -> None:
    """Refuses such a block where the call places it on a thread of this program. Where no call says so, its first invocation is a fault."""
    for label, block in verb.interpreted_blocks:
        source = next((source for pattern, source in verb.placement.items() if _matches(pattern, label, verb.name)), None)
        there = system.sources.get(source or "")
        if there is None or there.processor.apart is not False or system.virtual:
            continue
        text = f"block '{label}' of verb '{verb.name}' runs as Python ({block}), and '{there.name}' is a thread of this program"
        remedy = f"place it on a source of cell.processor(…, process=True): .on({{'{label}': …}})"
        refuse(PlacementError, text, remedy)


def _matches(pattern: str, label: str, verb: str) -> bool:
    return any(fnmatchcase(name, pattern) for name in (label, f"{verb}.{label}"))
