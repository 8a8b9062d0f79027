# SPDX-License-Identifier: Apache-2.0
"""Waits in an event loop for the end of a verb instance.

Under the monotonic clock, the loop watches a descriptor that becomes readable when an instance has ended. Under the virtual clock,
time advances firing by firing whenever the loop is otherwise idle.
"""

from __future__ import annotations

import asyncio
import os
from typing import TYPE_CHECKING, Any, TypeVar
from weakref import WeakKeyDictionary

from ..errors import Error, InvalidState, refusals
from .waiting import check_started, reported

if TYPE_CHECKING:
    from ..system.system import System
    from .instances import VerbInstance

R = TypeVar("R")


async def wait_async(instance: VerbInstance[R]) -> R:
    """Waits for the end and returns its report, like `VerbInstance.wait`; cancellation halts the instance."""
    if instance._deleted:
        return instance.wait()
    check_started(instance)
    try:
        if instance.system.virtual:
            await _Advancing.of(asyncio.get_running_loop()).ended(instance)
        else:
            await _Watch.of(instance.system, asyncio.get_running_loop()).ended(instance)
    except asyncio.CancelledError:
        if not instance.done:
            instance.halt()
        if instance._once:
            instance.delete()
        raise
    with refusals:
        report = reported(instance.system._native, instance.identity)
    return instance._finish(report)


class _Watch:
    """Watches one system's descriptor in one event loop on behalf of all instances awaited there."""

    _all: WeakKeyDictionary[System, dict[asyncio.AbstractEventLoop, _Watch]] = WeakKeyDictionary()

    def __init__(self, system: System, loop: asyncio.AbstractEventLoop) -> None:
        self._system, self._loop = system, loop
        with refusals:
            self._fd = system._native.ended_fd()
        self._waiting: dict[asyncio.Future[None], VerbInstance[Any]] = {}

    @classmethod
    def of(cls, system: System, loop: asyncio.AbstractEventLoop) -> _Watch:
        watches = cls._all.setdefault(system, {})
        for gone in [known for known in watches if known.is_closed()]:
            del watches[gone]
        return watches.setdefault(loop, cls(system, loop))

    async def ended(self, instance: VerbInstance[Any]) -> None:
        future = self._loop.create_future()
        self._waiting[future] = instance
        if len(self._waiting) == 1:
            self._loop.add_reader(self._fd, self._readable)
        try:
            self._look()  # it may have ended before the descriptor was watched
            await future
        finally:
            del self._waiting[future]
            if not self._waiting:
                self._loop.remove_reader(self._fd)

    def _readable(self) -> None:
        try:
            os.read(self._fd, 8)
        except BlockingIOError:
            return
        # Another event loop may wait for an instance of this system on the same descriptor.
        for watch in self._all.get(self._system, {}).values():
            if watch is self:
                watch._look()
            elif not watch._loop.is_closed():
                watch._loop.call_soon_threadsafe(watch._look)

    def _look(self) -> None:
        for future, instance in self._waiting.items():
            try:
                if not future.done() and instance.done:
                    future.set_result(None)
            except Error as error:
                # Pass the error of an unreachable remote system to the waiting task; the event loop would only log it.
                future.set_exception(error)


class _Advancing:
    """Advances the virtual clocks of the systems that one event loop waits for, while that loop is otherwise idle."""

    _all: WeakKeyDictionary[asyncio.AbstractEventLoop, _Advancing] = WeakKeyDictionary()

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._waiting: dict[asyncio.Future[None], VerbInstance[Any]] = {}
        self._scheduled = False

    @classmethod
    def of(cls, loop: asyncio.AbstractEventLoop) -> _Advancing:
        return cls._all.setdefault(loop, cls(loop))

    async def ended(self, instance: VerbInstance[Any]) -> None:
        future = self._loop.create_future()
        self._waiting[future] = instance
        self._schedule()
        try:
            await future
        finally:
            del self._waiting[future]

    def _schedule(self) -> None:
        if not self._scheduled:
            self._scheduled = True
            self._loop.call_soon(self._tick)

    def _tick(self) -> None:
        self._scheduled = False
        waiting = [(future, instance) for future, instance in self._waiting.items() if not future.done()]
        if not waiting:
            return
        if not getattr(self._loop, "_ready", ()):  # the loop's queue of what can run now: this callback was taken out of it
            self._advance(waiting)
        self._schedule()

    def _advance(self, waiting: list[tuple[asyncio.Future[None], VerbInstance[Any]]]) -> None:
        moving = {instance.system: False for _, instance in waiting}
        try:
            for system in moving:
                with refusals:
                    moving[system] = system._native.step()
        except Exception as error:
            for future, _ in waiting:
                if not future.done():
                    future.set_exception(error)
            return
        for future, instance in waiting:
            if instance.done:
                future.set_result(None)
            elif not moving[instance.system]:
                future.set_exception(
                    InvalidState(f"verb instance '{instance.name}' can never end: no further event is pending in its system")
                )
