# SPDX-License-Identifier: Apache-2.0
"""Simulated machines, and devices for tests."""

from __future__ import annotations

import importlib.util
import os
import secrets
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..errors import CallError, DeviceFailed, refuse
from ..refusals.argument_types import taking
from ..system import processes
from ..values.quantities import Quantity, duration_ns, optional_ns
from .driver import Driver, given


@taking
def mujoco(path: str | os.PathLike[str], *, timestep: Quantity | None = None, contacts: int = 0) -> Driver:
    """A robot arm simulated by MuJoCo: one MJCF file, one part for each actuated joint.

    Each part has `position`, `velocity`, `bias` (read) and `effort` (written); a tool has `tool.force` and `tool.push`. With `contacts`,
    1 to 64, the channel `contacts` gives that number of contacts, the largest forces first, as six numbers each: position (x y z, m) and
    force of the first shape on the second (x y z, N), in the world frame; zeros if there are fewer. The studio draws them as arrows.
    """
    library = mujoco_folder()
    if library is None:
        refuse(DeviceFailed, "the Python package 'mujoco' is not installed", "pip install 'opengpac[mujoco]'")
    step = None if timestep is None else duration_ns(timestep, "the time step") * 1e-9
    return Driver("mujoco", given(path=str(Path(path).expanduser().absolute()), library=library, timestep=step, contacts=contacts or None))


def mujoco_folder() -> str | None:
    """Returns the path of MuJoCo's library here: `OPENGPAC_MUJOCO`, else the folder of the Python package; None if there is none."""
    told = os.environ.get("OPENGPAC_MUJOCO")
    found = importlib.util.find_spec("mujoco") if told is None else None
    return told if found is None or not found.submodule_search_locations else next(iter(found.submodule_search_locations))


@taking
def loopback(
    *parts: str,
    initial: Sequence[float] = (),
    fail_at: Quantity | None = None,
    nan_at: Quantity | None = None,
    slew: float | None = None,
    timeout: Quantity | None = None,
    command: str | None = None,
) -> Driver:
    """Parts that follow their effort exactly, x' = u: for tests. `fail_at` loses the device, `nan_at` breaks its positions.

    With `command="position"` they take `goal` in place of `effort`, as arms whose controller closes the loop do.

    `timeout` is its watchdog: without a new command for so long after one that moves it, it goes to its safe state by itself, and is
    `device_lost` at the next reading.
    """
    return Driver(
        "loopback",
        given(
            parts=list(parts),
            initial=list(initial),
            fail_at_ns=optional_ns(fail_at, "fail_at"),
            nan_at_ns=optional_ns(nan_at, "nan_at"),
            slew=slew,
            command=command,
            timeout_ns=optional_ns(timeout, "the timeout"),
        ),
    )


@taking
def plant_process(
    driver: Driver,
    *,
    name: str | None = None,
    step: Quantity | None = None,
    linger: Quantity | None = None,
    silent: Quantity | None = None,
    timeout: Quantity | None = None,
) -> Driver:
    """A simulated machine in a process of its own, at its own pace: it outlives the processor that commands it, as a real one does.

    `driver` is what it runs, `gpac.drivers.mujoco("arm.xml")` or another; channels and parts are the same. Under the virtual clock it
    runs in place. The value stands for one machine: a system that opens it while it runs takes it over, so give each device a value of its
    own. `name` is what it is found by (else one is made up), `step` its period (else the model's, or 1 ms). It ends when its device is
    closed, and `linger` (10 s) after its commander was lost and none has come back. A plant that makes no step for `silent`
    (0.5 s) is `device_lost`.

    `timeout` is its own watchdog, as drives have one: without a new command for so long after one that moves anything, it goes to its
    safe state by itself, whatever failed, and is `device_lost` until `reset()` or `reopen()`. The period of the source that exchanges it
    is at most half of that. Without `timeout` it has none.
    """
    if not isinstance(driver, Driver):
        refuse(CallError, f"a plant process is given {driver!r}", 'give what it runs: gpac.drivers.mujoco("arm.xml")')
    return Driver(
        "plant_process",
        given(
            driver={"kind": driver.kind, "options": dict(driver.options)},
            command=processes.command("run_plant"),
            name=f"{driver.kind}-{secrets.token_hex(6)}" if name is None else name,
            step_ns=optional_ns(step, "the step"),
            linger_ns=optional_ns(linger, "the time to linger"),
            silent_ns=optional_ns(silent, "the time without a step"),
            timeout_ns=optional_ns(timeout, "the timeout"),
        ),
    )


@taking
def scripted(channels: Sequence[Mapping[str, Any]], table: Sequence[Mapping[str, Any]] = (), *, timeout: Quantity | None = None) -> Driver:
    """Channels of any numeric type that read a table of values: for tests.

    A channel is `{name, direction, type, unit, safe, slew, loop_of}`, a row of the table `{at_ns, values: {name: value}}`. `timeout` as
    of `loopback`.
    """
    for what, rows in (("channels", channels), ("table", table)):
        for entry in rows:
            if not isinstance(entry, Mapping):
                refuse(
                    CallError,
                    f"{what} of gpac.drivers.scripted() holds {entry!r}",
                    "give dictionaries: {'name': 'a.b', 'direction': 'read'}",
                )
    options = given(
        channels=[dict(c) for c in channels], table=[dict(row) for row in table], timeout_ns=optional_ns(timeout, "the timeout")
    )
    return Driver("scripted", options)
