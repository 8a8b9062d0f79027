# SPDX-License-Identifier: Apache-2.0
"""The process of a driver in Python: what it runs, and how the compiled core exchanges with an object of the driver's class."""

from __future__ import annotations

import importlib
import importlib.util
import json
import signal
import sys
from pathlib import Path
from typing import Any

from . import _native
from .driver import Channel, Driver, the_driver


class Exchange:
    """An object of a driver's class, as the compiled core sees it: bytes of commands in, bytes of readings out."""

    def __init__(self, options_json: str) -> None:
        options: dict[str, Any] = json.loads(options_json)
        for path in options.get("paths", []):
            if path not in sys.path:
                sys.path.append(path)
        self._kind = _loaded(options.get("path"), options.get("module"), options.get("class"))
        self._driver: Driver = self._kind(**options.get("options", {}))
        self._declared: dict[str, Channel] = dict(self._kind.members(Channel))
        self._reads: list[tuple[Channel, int]] = []
        self._writes: list[tuple[Channel, int]] = []
        self._readings = bytearray()

    @property
    def channels(self) -> str:
        """Its channels, as JSON."""
        return json.dumps([
            {
                "name": name, "write": c.write, "type": c.type, "unit": c.unit, "doc": c.doc, "slew": c.slew,
                "safe": [*c.pack(c.initial)] if c.write else [],
            }
            for name, c in self._declared.items()
        ])  # fmt: skip

    def place(self, offsets: list[int], readings_len: int) -> None:
        """Says where each channel lies, in the order of `channels`, and how long the readings are."""
        placed = [*zip(self._declared.values(), offsets, strict=True)]
        self._reads = [(c, offset) for c, offset in placed if not c.write]
        self._writes = [(c, offset) for c, offset in placed if c.write]
        self._readings = bytearray(readings_len)

    def open(self) -> None:
        """Opens the device."""
        self._driver.open()

    def exchange(self, commands: bytes) -> bytes:
        """One exchange: the driver finds the commands in its channels, and leaves readings there."""
        values = self._driver.__dict__
        for channel, offset in self._writes:
            values[channel.name] = channel.unpack(commands, offset)
        self._driver.exchange()
        for channel, offset in self._reads:
            packed = channel.pack(values[channel.name])
            self._readings[offset : offset + len(packed)] = packed
        return bytes(self._readings)

    def safe_state(self) -> None:
        """Brings the outputs to their safe state."""
        for channel, _ in self._writes:
            self._driver.__dict__[channel.name] = channel.initial
        self._driver.safe_state()

    def close(self) -> None:
        """Closes the device."""
        self._driver.close()


def _loaded(path: str | None, module: str | None, name: str | None) -> type[Driver]:
    """The class, from a file or from a module."""
    if path is None:
        found = importlib.import_module(module or "")
        return the_driver(vars(found), found.__name__, f"module '{module}'", name)
    file = Path(path)
    # Modules beside it are found as those of a program are.
    if str(file.parent) not in sys.path:
        sys.path.insert(0, str(file.parent))
    spec = importlib.util.spec_from_file_location(file.stem, file)
    if spec is None or spec.loader is None:
        raise ImportError(f"'{path}' is no file of Python")
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    return the_driver(vars(loaded), loaded.__name__, f"'{path}'", name)


def main() -> int:
    """Serves until the device is closed or the program is gone."""
    # An interrupt from the keyboard is for the program, which closes its devices.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    why = _native.run_plant()
    if why:
        print(why, file=sys.stderr)
    return 1 if why else 0


if __name__ == "__main__":
    sys.exit(main())
