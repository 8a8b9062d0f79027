# SPDX-License-Identifier: Apache-2.0
"""Removes the frames of this package from tracebacks of refusals, so that the last line is the user's own.

The traceback is cut where it is displayed (by Python, a thread, IPython or pytest), not in public functions. Therefore calls have no
overhead, a debugger stops where the error was raised, and `except` sees the whole traceback. `OPENGPAC_TRACEBACK=full` shows every
frame.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator
from types import TracebackType

from .source_location import is_of_package, is_of_python


class ShortTraceback(Exception):
    """Exception whose traceback is displayed without the frames of this package; base class of the refusals."""

    def _render_traceback_(self) -> list[str]:
        """Returns the lines that IPython and Jupyter display."""
        from IPython.core.getipython import get_ipython

        shorten(self)
        shown = get_ipython().InteractiveTB  # type: ignore[union-attr]
        return shown.structured_traceback(type(self), self, self.__traceback__, tb_offset=shown.tb_offset)


def is_full() -> bool:
    """Returns whether `OPENGPAC_TRACEBACK=full` requests every frame."""
    return os.environ.get("OPENGPAC_TRACEBACK") == "full"


def shorten(error: BaseException | None) -> None:
    """Removes the frames of this package from the traceback of a refusal, and of each refusal that is its cause or context.

    Other exceptions keep all their frames: a built-in exception raised in this package is a bug in the package.
    """
    if is_full():
        return
    for found in _chain(error):
        if isinstance(found, ShortTraceback):
            found.__traceback__ = users(found.__traceback__)


def users(trace: TracebackType | None) -> TracebackType | None:
    """Returns the traceback with only the user's frames, or the whole traceback if it has none.

    Frames of Python's library are kept if they call the user's program: the start of a thread, or `contextlib` around a generator.
    """
    entries: list[TracebackType] = []
    while trace is not None:
        entries.append(trace)
        trace = trace.tb_next
    kept: TracebackType | None = None
    leads_to_user = False
    for entry in reversed(entries):
        if not is_of_python(entry.tb_frame):
            leads_to_user = not is_of_package(entry.tb_frame)
        if leads_to_user:
            kept = TracebackType(kept, entry.tb_frame, entry.tb_lasti, entry.tb_lineno)
    return kept or (entries[0] if entries else None)


def _chain(error: BaseException | None) -> Iterator[BaseException]:
    """Yields an exception, its causes and contexts, and the members of exception groups, each once."""
    waiting, seen = [error], set[int]()
    while waiting:
        found = waiting.pop()
        if found is None or id(found) in seen:
            continue
        seen.add(id(found))
        yield found
        waiting += [found.__cause__, found.__context__]
        if isinstance(found, BaseExceptionGroup):
            waiting += found.exceptions


def install() -> None:
    """Shortens the tracebacks that Python displays when a refusal ends a program or a thread. Idempotent.

    Previously installed hooks still display the tracebacks. IPython uses the exception's `_render_traceback_`, pytest its plugin.
    """
    if getattr(sys.excepthook, "_of_opengpac", False):
        return
    shows, shows_of_thread = sys.excepthook, threading.excepthook

    def excepthook(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        shorten(error)
        shows(kind, error, error.__traceback__ if isinstance(error, ShortTraceback) else trace)

    def excepthook_of_thread(given: threading.ExceptHookArgs) -> None:
        shorten(given.exc_value)
        if isinstance(given.exc_value, ShortTraceback):
            given = threading.ExceptHookArgs((given.exc_type, given.exc_value, given.exc_value.__traceback__, given.thread))
        shows_of_thread(given)

    excepthook._of_opengpac = True  # type: ignore[attr-defined]
    sys.excepthook = excepthook
    threading.excepthook = excepthook_of_thread
