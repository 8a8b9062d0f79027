# SPDX-License-Identifier: Apache-2.0
"""Transitions of a verb that can never occur, because they would lead back to normal operation from lists that run only after a command
to end. Applies the model's rule, for tables and pictures."""

from __future__ import annotations

from collections.abc import Callable, Mapping

TOLD = frozenset({"halted", "aborted", "device_disabled", "time_limit", "device_lost", "processor_lost"})
"""System conditions that command a verb to end."""

Transitions = Mapping[tuple[str, str], str]


def never_made(transitions: Transitions, initial: str) -> set[tuple[str, str]]:
    """Returns the transitions that lead back to normal operation from lists that run only after a command to end.
    >>> chain = {("a", "halted"): "a.stop", ("a", "completed"): "b", ("a.stop", "completed"): "b"}
    >>> never_made(chain, "a")
    {('a.stop', 'completed')}
    """
    work = _reached([initial], transitions, lambda begins, condition, to: condition not in TOLD)
    first = [to for (begins, condition), to in transitions.items() if begins in work and condition in TOLD]

    def leads_on(begins: str, condition: str, to: str) -> bool:
        return _are_of_one_part(begins, to) if condition in TOLD else to not in work

    ending = _reached(first, transitions, leads_on) - work
    return {line for line, to in transitions.items() if line[0] in ending and not leads_on(*line, to)}


def _reached(first: list[str], transitions: Transitions, leads_on: Callable[[str, str, str], bool]) -> set[str]:
    """Returns the lists reachable from `first` by transitions that can occur."""
    found: set[str] = set()
    coming = [*first]
    while coming:
        name = coming.pop()
        if name not in found:
            found.add(name)
            coming += [to for (begins, condition), to in transitions.items() if begins == name and leads_on(begins, condition, to)]
    return found


def _are_of_one_part(one: str, other: str) -> bool:
    parts = [name.rpartition(".")[0] for name in (one, other)]
    first, second = (f"{part}." if part else "" for part in parts)
    return first.startswith(second) or second.startswith(first)
