# SPDX-License-Identifier: Apache-2.0
"""Drivers written in Python: classes derived from `opengpac.driver.Driver`, each of which runs in a separate process."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

from .. import driver as written
from ..errors import CallError, refuse
from ..refusals.argument_types import taking
from ..values.encoding import plain
from ..values.quantities import Quantity, optional_ns
from .driver import Driver, given


@taking
def python(
    source: str | os.PathLike[str] | type[written.Driver],
    *,
    class_: str | None = None,
    period: Quantity | None = None,
    age_max: Quantity | None = None,
    timeout: Quantity | None = None,
    **options: Any,
) -> Driver:
    """A driver written in Python, which runs in a separate process. `source` is a file, `"package.module:Class"`, or the class itself.

    `period` (10 ms) is the interval of its `exchange`; `options` are those that the class declares. The source that exchanges with
    the device never waits for it: it takes the latest readings, whose age is the channel `age`; if they are older than `age_max` (10
    periods, at least 100 ms) the device is lost. `class_` selects the class if the file contains several. `timeout` is the device's
    watchdog, as for `gpac.drivers.loopback`. Under the virtual clock the class runs in this process, at each firing of its source.
    """
    return Driver(
        "python",
        given(
            **where(source, class_),
            options={name: plain(value, f"option '{name}' of the driver") for name, value in options.items()} or None,
            paths=[str(Path(path).absolute()) for path in sys.path if Path(path).is_dir()],
            period_ns=optional_ns(period, "the period"),
            age_max_ns=optional_ns(age_max, "the maximum age"),
            timeout_ns=optional_ns(timeout, "the timeout"),
        ),
    )


def where(source: Any, class_: str | None) -> dict[str, str | None]:
    """Returns the driver options that locate a driver's class."""
    if isinstance(source, type) and issubclass(source, written.Driver):
        if source.__module__ == "__main__":
            refuse(
                CallError,
                f"driver {source.__name__} is defined in the program itself, which its process would run again",
                "move it to a separate file and pass its path, or import it from there",
            )
        return {"module": source.__module__, "class": source.__qualname__}
    if isinstance(source, str) and ":" in source and os.sep not in source:
        module, _, name = source.partition(":")
        return {"module": module, "class": name}
    if not isinstance(source, str | os.PathLike):
        refuse(CallError, f"a driver in Python must be a file or a class, not {source!r}", 'pass its file, "thermometer.py", or its class')
    path = Path(source).expanduser().absolute()
    if not path.is_file():
        refuse(CallError, f"file '{source}' does not exist", "pass the file with the driver's class")
    return {"path": str(path), "class": class_}
