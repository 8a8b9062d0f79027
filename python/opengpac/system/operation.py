# SPDX-License-Identifier: Apache-2.0
"""Commands for a whole system: its emergency stop, pauses, the mode, the speed override of motions, its alarms."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, cast

from ..devices.logical import LogicalDevice
from ..devices.physical import Channel
from ..drivers.catalog import Found, on_host_of, searched
from ..errors import CallError, EmergencyStopped, refusals, refuse
from ..refusals.argument_types import all_taking
from ..studio.workspaces import Workspaces
from ..values.quantities import Quantity, optional_ns
from .alarms import Alarms
from .forcing import Force, ForcedSignal
from .forcing import force as _force
from .forcing import forced as _forced
from .forcing import release as _release
from .observation import SystemObservation
from .svvs import SVV

if TYPE_CHECKING:
    from .system import System


_LOOK = 0.01
"""Interval between attempts to reset an emergency stop, s."""


@all_taking
class SystemCommands(SystemObservation):
    """Commands that act on a whole `System`."""

    virtual: bool
    svv: Callable[..., SVV[Any]]
    _svv: Callable[[str], SVV[Any]]

    @property
    def override(self) -> float:
        """Speed override of every motion of `gpac.motion` in this system, from 0 to 1; 0 holds all motions. Changes are smooth."""
        return self._svv("override").value if "override" in self.names["svvs"] else 1.0

    @override.setter
    def override(self, share: float) -> None:
        if "override" not in self.names["svvs"]:
            self.svv("override", initial=1.0, within=(0.0, 1.0))
        self._svv("override").value = share

    def emergency_stop(self, reason: str) -> None:
        """Ends every action, brings devices to their safe state, and latches the stop; records the `reason`. It is not a certified
        safety function."""
        with refusals:
            self._alive().emergency_stop(reason)

    def emergency_stop_input(self, channel: Channel, *, trips: bool = True) -> None:
        """Triggers an emergency stop whenever `channel` reads true; with `trips=False`, whenever it reads false, as for a normally
        closed contact.

        Outputs of the channel's own source are safe from the write in the firing that read it, those of other sources from their next
        firing. Loss of the channel's device also triggers the stop.
        """
        if not isinstance(channel, Channel):
            refuse(
                CallError,
                f"an emergency stop input must be a channel of a physical device, not {channel!r}",
                "pass io['stop'], for example",
            )
        with refusals:
            self._alive().emergency_stop_input(channel.device.name, channel.name, not trips)

    def reset(self, within: Quantity | None = None) -> dict[str, str]:
        """Resets an emergency stop, and reopens lost devices. Everything remains disabled, and no action resumes.

        Returns the physical devices that are still lost, each with the reason; empty if there are none.

        Raises `EmergencyStopped`, which names a cause, while one is present: immediately, or, with `within`, if it persists for that
        time.
        """
        native = self._alive()
        with refusals:
            until_ns = native.now() + (optional_ns(within, "within") or 0)
        while True:
            try:
                with refusals:
                    return native.reset()
            except EmergencyStopped:
                with refusals:
                    is_over = native.now() >= until_ns
                if is_over:
                    raise
            if self.virtual:
                with refusals:
                    native.step()
            else:
                time.sleep(_LOOK)

    def pause(self, *devices: LogicalDevice) -> list[str]:
        """Suspends every action on all devices, or only on these `devices`; returns the names of the instances, once they are suspended.

        Verbs that keep devices running, such as servos, continue. Verbs started in the meantime are held back until `resume`.
        """
        with refusals:
            return self._alive().pause(_names(devices, "pause"))

    def resume(self, *devices: LogicalDevice) -> list[str]:
        """Ends a pause, completely or for these `devices`; returns the names of the instances that resume or start.

        An instance that was suspended by a separate call stays suspended.
        """
        with refusals:
            return self._alive().resume_program(_names(devices, "resume"))

    @property
    def paused(self) -> bool | list[str]:
        """True if the whole program is paused; otherwise the names of the paused devices, if any."""
        return self.statistics["paused"]

    @property
    def mode(self) -> str:
        """Mode: `automatic`, or `manual`, in which only verbs declared with `manual=True` start. Setting it is refused while an action
        runs."""
        with refusals:
            return self._alive().mode()

    @mode.setter
    def mode(self, mode: str) -> None:
        if mode not in ("automatic", "manual"):
            refuse(
                CallError,
                f"the mode of system '{self.name}' must be 'automatic' or 'manual', not {mode!r}",
                "write mode = 'manual', for example",
            )
        with refusals:
            self._alive().set_mode(mode)

    def enabling_switch(self, channel: Channel) -> None:
        """Sets the channel that is true while a person holds the enabling switch; in manual mode, actions start and continue only while
        it is true."""
        if not isinstance(channel, Channel):
            refuse(
                CallError, f"an enabling switch must be a channel of a physical device, not {channel!r}", "pass io['switch'], for example"
            )
        with refusals:
            self._alive().enabling_switch(channel.device.name, channel.name)

    def force(self, signal: LogicalDevice, value: Any) -> Force:
        """Forces an input or output of `gpac.cell`: an input has this value instead of its reading, an output instead of its command.

        As a context manager, `with cell.force(part, True): …`, it releases the signal at the end of the block.

        value: a bool, or a number in the unit of the channel. The force lasts until it is released, its session ends, its device is
        disabled or lost, or an emergency stop occurs; an alarm `forced` is active until then. A disabled output stays safe. A remote
        system requires the role `configure` and command.

        Raises `NotEnabled` for a device that is not enabled, `NotAllowed` for an emergency stop input or the enabling switch,
        `OutOfRange` for a value beyond the limits of an analog output, `CallError` for a device without a channel of its own.
        """
        return _force(cast("System", self), signal, value)

    def release(self, *signals: LogicalDevice) -> list[str]:
        """Ends the forces of these signals, or of all; returns their names. Raises `InvalidState` for one that is not forced."""
        return _release(cast("System", self), signals)

    @property
    def forced(self) -> dict[str, ForcedSignal]:
        """Forced signals, by the names of their devices."""
        return _forced(cast("System", self))

    def scan_devices(self, kind: str | None = None, **options: Any) -> Found:
        """Searches for devices that a driver could open, on the host of this system, without moving any machine. `kind` and `options`
        are as in `gpac.drivers.scan`.

        For a remote system this requires the role `configure`, because it opens ports there.
        """
        return searched(on_host_of(self._alive()), kind, options)

    @property
    def alarms(self) -> Alarms:
        """Alarms that require attention: active or not yet acknowledged."""
        return Alarms(cast("System", self))

    @property
    def workspaces(self) -> Workspaces:
        """Layouts of panels for the studio: those shipped by programs, and those stored by users."""
        return Workspaces(cast("System", self))


def _names(devices: tuple[Any, ...], call: str) -> list[str] | None:
    for device in devices:
        if not isinstance(device, LogicalDevice):
            refuse(
                CallError,
                f"{call}() applies to logical devices, not to {device!r}",
                "pass logical devices, or nothing for all; for a group call its pause() and resume()",
            )
    return [device.name for device in devices] or None
