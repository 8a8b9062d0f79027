# SPDX-License-Identifier: Apache-2.0
"""Waits in a thread for the end of a verb instance; `awaiting.py` waits in an event loop."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..errors import InvalidState, refusals, refuse
from . import progress

if TYPE_CHECKING:
    from .instances import VerbInstance


def wait(instance: VerbInstance[Any], timeout_ns: int | None) -> str:
    """Returns the end report's text. Raises `TimeoutError` after `timeout_ns` of the system's clock."""
    native = instance._alive()
    with refusals:
        deadline = None if timeout_ns is None else native.now() + timeout_ns
    slice_ns, line = progress.SLICE_NS, None
    try:
        while True:
            with refusals:
                left = None if deadline is None else max(0, deadline - native.now())
                text = _wait(native, instance.identity, left, slice_ns)
                is_late = text is None and deadline is not None and native.now() >= deadline
            if text is not None:
                return text
            if is_late:
                _too_late(instance, timeout_ns)
            if line is None and slice_ns:
                # Checked only now: most verbs end before anyone could read a line.
                wanted = progress.wanted(instance.system.progress)
                slice_ns, line = (slice_ns, progress.Line(instance)) if wanted else (0, None)
            if line is not None:
                line.show()
    finally:
        if line is not None:
            line.clear()


def _wait(native: Any, identity: int, timeout_ns: int | None, slice_ns: int) -> str | None:
    """Returns the end report's text, or None if the instance has not ended within `timeout_ns`, or, if `slice_ns` is not zero, within
    that much real time."""
    arguments = f'{{"instance": {identity}}}' if timeout_ns is None else f'{{"instance": {identity}, "timeout_ns": {timeout_ns}}}'
    text = native.begin("wait", arguments, slice_ns) if slice_ns else native.call("wait", arguments)
    return None if text == "null" else text


def reported(native: Any, identity: int) -> str | None:
    """Returns the report text of the latest start, or None before its end."""
    text = native.call("report", f'{{"instance": {identity}}}')
    return None if text == "null" else text


def check_started(instance: VerbInstance[Any]) -> None:
    """Refuses to wait for an instance that was never started."""
    if instance.state == "created":
        refuse(InvalidState, f"verb instance '{instance.name}' has not been started", "call start() first")


def _too_late(instance: VerbInstance[Any], timeout_ns: int | None) -> str:
    raise TimeoutError(
        f"verb instance '{instance.name}' did not end within {(timeout_ns or 0) * 1e-9:g} s; its state is '{instance.state}'"
    )
