# SPDX-License-Identifier: Apache-2.0
"""Whether a policy is used as it was trained: at its interval, and with its joints in their order."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ..blocks import BlockUse
from ..errors import DefinitionError, SchedulingError, refuse

if TYPE_CHECKING:
    from ..verbs import Verb


def check_rates(uses: Mapping[str, BlockUse], lists: Mapping[str, Sequence[Mapping[str, Any]]]) -> None:
    """Refuses a command list that activates a policy at another interval than that of its training."""
    for command in (command for commands in lists.values() for command in commands):
        label, every = str(command.get("block")), command.get("every_ns")
        trained = getattr(uses[label].block, "period_ns", None) if label in uses else None
        if trained is not None and every is not None and every != trained:
            block = uses[label].block
            name = block.name.rpartition(".")[2]
            meant = f"policy '{name}' was trained for" if hasattr(block, "names") else f"block '{name}' takes steps of"
            text = f"'{label}' is activated every {_text(every)}, {meant} {_text(trained)}"
            refuse(SchedulingError, text, f"write every='{_text(trained)}'")


def check_order(verb: Verb[..., Any], arguments: Mapping[str, Any]) -> None:
    """Refuses variables of joints that are bound to a policy's port in another order than that of its training.

    A variable is of a joint where that is a part of its name, `ur5e.wrist_1.sensed`. Those whose names have none are not compared.
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
            names = getattr(verb.blocks[label].block, "names", {}).get(port) if label in verb.blocks else None
            check_names(f"'{target}'", names or (), f"'{parameter}'", bound)


def check_names(taker: str, names: Sequence[str], giver: str, bound: Sequence[str]) -> None:
    """Refuses variables of joints in another order than that of `names`. `taker` and `giver` are what messages call the two ends."""
    if names and len(bound) == len(names) and _differ(bound, names):
        text = f"{taker} takes {', '.join(names)} in this order, {giver} gives {', '.join(bound)}"
        refuse(DefinitionError, text, "bind them in the policy's order")


def _differ(bound: Sequence[str], names: Sequence[str]) -> bool:
    parts = [set(name.split(".")) & set(names) for name in bound]
    return any(found and expected not in found for found, expected in zip(parts, names, strict=True))


def _text(ns: int) -> str:
    return f"{ns / 1e6:g} ms"
