# SPDX-License-Identifier: Apache-2.0
"""Special requirements of blocks: a fixed activation interval, the order of joints at their ports, or a dedicated processor. Blocks
declare them as attributes of `Block`, regardless of the module that creates the block."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any

from ..errors import DefinitionError, PlacementError, SchedulingError, refuse
from .blocks import Block, BlockUse

if TYPE_CHECKING:
    from ..system.system import System
    from .verbs import Verb


def check_rates(uses: Mapping[str, BlockUse], lists: Mapping[str, Sequence[Mapping[str, Any]]]) -> None:
    """Refuses command lists that activate a block at an interval other than its fixed one."""
    for command in (command for commands in lists.values() for command in commands):
        label, every = str(command.get("block")), command.get("every_ns")
        block = uses[label].block if label in uses else None
        if isinstance(block, Block) and block.period_ns is not None and every is not None and every != block.period_ns:
            own = _text(block.period_ns)
            text = f"'{label}' is activated every {_text(every)}, but {block._own_interval} {own}"
            refuse(SchedulingError, text, f"write every='{own}'")


def _text(ns: int) -> str:
    return f"{ns / 1e6:g} ms"


def check_order(verb: Verb[..., Any], arguments: Mapping[str, Any]) -> None:
    """Refuses joint variables that are bound to a port in an order other than the block's.

    A variable belongs to a joint if its name contains the joint's name, `ur5e.wrist_1.sensed`. Variables without a joint name are not
    compared.
    """
    for parameter, targets in verb.instantiation_parameters.items():
        name, _, member = parameter.partition(".")
        given = arguments.get(name)
        if given is None:
            continue
        variables = (
            [getattr(one, member, one) if member else one for one in given]
            if isinstance(given, Sequence) or (member and isinstance(given, Iterable))
            else []
        )
        bound = [str(getattr(variable, "name", "")) for variable in variables]
        for target in [targets] if isinstance(targets, str) else targets:
            label, _, port = str(target).partition(".")
            block = verb.blocks[label].block if label in verb.blocks else None
            names = block.names.get(port, ()) if isinstance(block, Block) else ()
            check_names(f"'{target}'", names, f"'{parameter}'", bound)


def check_names(taker: str, names: Sequence[str], giver: str, bound: Sequence[str]) -> None:
    """Refuses joint variables in an order other than that of `names`. `taker` and `giver` name the two ends in messages; `bound`
    contains the variables."""
    if names and len(bound) == len(names) and _differ(bound, names):
        text = f"{taker} expects the order {', '.join(names)}, but {giver} has {', '.join(bound)}"
        refuse(DefinitionError, text, "bind them in the order of the policy")


def _differ(bound: Sequence[str], names: Sequence[str]) -> bool:
    parts = [set(name.split(".")) & set(names) for name in bound]
    return any(found and expected not in found for found, expected in zip(parts, names, strict=True))


def interpreted(uses: Mapping[str, BlockUse], within: str = "") -> Iterator[tuple[str, str]]:
    """Yields the label and the name of each block that needs an interpreter, including blocks within graphs: no real-time thread may
    wait for an interpreter."""
    for label, use in uses.items():
        if not isinstance(use.block, Block):
            yield from interpreted(use.block.blocks, f"{within}{label}.")
        elif not use.block.native:
            yield within + label, use.block.name.rpartition(".")[2]


def check_placed(verb: Verb[..., Any], system: System) -> None:
    """Refuses interpreted blocks that the call places on a thread of this program. A block without a placement is not refused here; its
    first invocation faults."""
    for label, block in verb.interpreted_blocks:
        source = next((source for pattern, source in verb.placement.items() if _matches(pattern, label, verb.name)), None)
        there = system.sources.get(source or "")
        if there is None or there.processor.apart is not False or system.virtual:
            continue
        text = (
            f"block '{label}' of verb '{verb.name}' runs in a Python interpreter ({block}), but '{there.name}' is a thread of this program"
        )
        remedy = f"place it on a source of cell.processor(…, process=True): .on({{'{label}': …}})"
        refuse(PlacementError, text, remedy)


def _matches(pattern: str, label: str, verb: str) -> bool:
    return any(fnmatchcase(name, pattern) for name in (label, f"{verb}.{label}"))
