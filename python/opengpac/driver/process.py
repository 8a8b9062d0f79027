# SPDX-License-Identifier: Apache-2.0
"""Process of a driver in Python: its main function, and the adapter between the compiled core and an object of the driver's class."""

from __future__ import annotations

import importlib
import importlib.util
import json
import signal
import sys
import threading
from pathlib import Path
from typing import Any

from .. import _native
from ..values.numbers import number
from . import handover
from .base import Driver, channels_of, place_of
from .manual import about, services_of, the_driver
from .members import NOTHING_NEW, Channel, Counter

_Placed = tuple[Channel, int, dict[str, Any], str]
"""A channel, its offset in its group, and the dictionary and key at which the object stores its value."""
_AGE_MAX_S = 1e6
"""Maximum age of readings, s; a program has no use for older ones."""


class Exchange:
    """Adapter between an object of a driver's class and the compiled core: it receives the commands and returns the readings, both as
    bytes."""

    def __init__(self, options_json: str) -> None:
        options: dict[str, Any] = json.loads(options_json)
        self._device = json.dumps([options.get(word) for word in ("path", "module", "class", "options")], sort_keys=True)
        for path in options.get("paths", []):
            if path not in sys.path:
                sys.path.append(path)
        self._kind = loaded(options.get("path"), options.get("module"), options.get("class"))
        self._driver: Driver = self._kind(**options.get("options", {}))
        self._declared = channels_of(self._kind)
        self._reads: list[_Placed] = []
        self._writes: list[_Placed] = []
        self._counters = [*self._kind.members(Counter)]
        self._services = services_of(self._kind)
        self._readings = bytearray()
        # Under virtual time services are called from another thread; the class expects a single one.
        self._busy = threading.RLock()

    @property
    def beside(self) -> str:
        """Returns the declarations other than channels as JSON: services, counters and parts."""
        told = about(self._kind)
        return json.dumps({name: told[name] for name in ("services", "counters", "parts") if told[name]})

    @property
    def channels(self) -> str:
        """Returns the channels as JSON."""
        return json.dumps([
            {
                "name": name, "write": c.write, "type": c.type, "unit": c.unit, "doc": c.doc, "slew": c.slew,
                "safe": [*c.pack(c.initial)] if c.write else [],
            }
            for name, c in self._declared.items()
        ])  # fmt: skip

    def place(self, offsets: list[int], readings_len: int) -> None:
        """Sets the offset of each channel, in the order of `channels`, and the length of the readings."""
        placed = [(c, offset, *place_of(self._driver, c)) for c, offset in zip(self._declared.values(), offsets, strict=True)]
        self._reads = [each for each in placed if not each[0].write]
        self._writes = [each for each in placed if each[0].write]
        self._readings = bytearray(readings_len)

    def open(self) -> None:
        """Opens the device. In a separate process, waits first until an orphaned process has released it."""
        with self._busy:
            if handover.is_process:
                self._sign = handover.taken_over(self._device)
            self._driver.open()

    def exchange(self, commands: bytes, engaged: bytes = b"") -> tuple[bytes, list[int], float | None]:
        """Performs one exchange: the driver reads the commands from its channels, and stores its readings in them.

        Returns the readings, the counters, and the age of the readings in s, or None if the machine has reported nothing since the
        previous exchange. `engaged` indicates for each written channel whether a verb commands it; by default, all are engaged.
        """
        with self._busy:
            for index, (channel, offset, values, name) in enumerate(self._writes):
                values[name] = channel.unpack(commands, offset)
                if "." in channel.name:
                    values["engaged"] = engaged == b"" or engaged[index] != 0
            age_s = _age_of(self._driver.exchange())
            for channel, offset, values, name in self._reads:
                packed = channel.pack(values[name])
                self._readings[offset : offset + len(packed)] = packed
            return bytes(self._readings), [max(0, int(self._driver.__dict__[name])) for name in self._counters], age_s

    def serve(self, service: str, arguments_json: str) -> str:
        """Runs a service and returns its result as JSON. Refuses unknown services and results of the wrong type."""
        if service not in self._services:
            raise LookupError(f"it has no service '{service}'")
        with self._busy:
            answer = getattr(self._driver, service)(**json.loads(arguments_json))
        kind = self._services[service].answer
        answer = number(answer)
        whole_for_number = kind is float and isinstance(answer, int) and not isinstance(answer, bool)
        if not whole_for_number and not (answer is None if kind is None else isinstance(answer, kind)):
            raise TypeError(f"service '{service}' returns {answer!r}, but declares {kind.__name__ if kind else None}")
        return json.dumps(answer)

    def safe_state(self) -> None:
        """Brings the outputs to their safe state."""
        with self._busy:
            for channel, _, values, name in self._writes:
                values[name] = channel.initial
                if "." in channel.name:
                    values["engaged"] = False
            self._driver.safe_state()

    def close(self) -> None:
        """Closes the device."""
        with self._busy:
            self._driver.close()


def _age_of(told: Any) -> float | None:
    """Returns the age of readings in s, from the return value of `exchange`. Refuses other values."""
    if told is None:
        return 0.0
    if told is NOTHING_NEW:
        return None
    told = number(told)
    if isinstance(told, int | float) and not isinstance(told, bool) and 0.0 <= told <= _AGE_MAX_S:
        return float(told)
    remedy = f"return nothing, opengpac.driver.NOTHING_NEW, or the age of the readings, from 0 to {_AGE_MAX_S:.0f} s"
    raise ValueError(f"exchange() cannot return {told!r}: {remedy}")


def loaded(path: str | None, module: str | None, name: str | None) -> type[Driver]:
    """Loads the class from a file or a module."""
    if path is None:
        found = importlib.import_module(module or "")
        return the_driver(vars(found), found.__name__, f"module '{module}'", name)
    file = Path(path)
    # Modules next to the driver are importable, like those of a program.
    if str(file.parent) not in sys.path:
        sys.path.insert(0, str(file.parent))
    spec = importlib.util.spec_from_file_location(file.stem, file)
    if spec is None or spec.loader is None:
        raise ImportError(f"'{path}' is not a Python file")
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return the_driver(vars(found), found.__name__, f"'{path}'", name)


def main() -> int:
    """Runs the driver until the device is closed or the program exits."""
    # Keyboard interrupts are handled by the program, which closes its devices.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    handover.is_process = True
    why = _native.run_plant()
    if why:
        print(why, file=sys.stderr)
    return 1 if why else 0


if __name__ == "__main__":
    sys.exit(main())
