# SPDX-License-Identifier: Apache-2.0
"""User-defined drivers from files: C or C++ sources, shared objects, or folders of them."""

from __future__ import annotations

import hashlib
import json
import os
import signal
import subprocess
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from .. import _native
from ..errors import CallError, ModuleError, did_you_mean, refusals, refuse
from ..refusals.argument_types import taking
from ..storage.cache import put, user_cache
from ..storage.files import is_source
from ..system import processes
from ..values.quantities import duration_ns
from .driver import Driver

_TRIAL_SECONDS = 60


class Drivers:
    """Drivers of a file or a folder. Returned by `gpac.drivers.load`.

    Calling it creates a driver with options, like `gpac.drivers.loopback(...)`: `axis(gain=2)` if there is a single driver,
    `machines.axis(gain=2)` if there are several. A number may be a text with a unit, `gain="2 rad/s"`; a time declared as `period_ns`
    can also be set by `period="5 ms"`. Undeclared options are refused.
    """

    def __init__(self, origin: str, kinds: Mapping[str, tuple[str, dict[str, Any]]]) -> None:
        self._origin, self._kinds = origin, dict(kinds)

    def __call__(self, **options: Any) -> Driver:
        if len(self._kinds) != 1:
            refuse(CallError, f"'{self._origin}' has {len(self._kinds)} drivers", f"name one: .{next(iter(self._kinds))}(...)")
        return self._made(next(iter(self._kinds)), options)

    def __getattr__(self, name: str) -> Drivers:
        if name.startswith("_"):
            raise AttributeError(name)
        if name not in self._kinds:
            refuse(CallError, f"'{self._origin}' has no driver '{name}'", did_you_mean(name, self._kinds))
        return Drivers(self._origin, {name: self._kinds[name]})

    def __iter__(self) -> Iterator[str]:
        return iter(self._kinds)

    def __len__(self) -> int:
        return len(self._kinds)

    def __repr__(self) -> str:
        return f"<drivers {', '.join(self._kinds)} of '{self._origin}'>"

    @property
    def help(self) -> str:
        """Manual of each driver: the machine that it drives, and its options."""
        return "\n".join(_manual(declared) for _, declared in self._kinds.values())

    @property
    def manuals(self) -> Iterator[tuple[str, Mapping[str, Any]]]:
        """Yields the kind and the declaration of each driver."""
        return iter(self._kinds.values())

    def _made(self, name: str, options: Mapping[str, Any]) -> Driver:
        kind, declared = self._kinds[name]
        words = {word["name"]: word for word in declared["options"]}
        given = dict(_option(words, option, value) for option, value in options.items() if value is not None)
        try:
            text = json.dumps(given)
        except (TypeError, ValueError) as why:
            refuse(
                CallError,
                f"the options of driver '{name}' cannot be sent: {options!r}: {why}",
                "pass strings, numbers, booleans, lists and dictionaries",
            )
        with refusals:
            problem = _native.check_driver(kind, text)
        if problem is not None:
            refuse(CallError, problem)
        return Driver(kind, given)


def _option(words: Mapping[str, dict[str, Any]], name: str, value: Any) -> tuple[str, Any]:
    """Returns an option in the driver's format."""
    word = words.get(name)
    if word is None and f"{name}_ns" in words:
        return f"{name}_ns", duration_ns(value, f"option '{name}'")
    if word is not None and isinstance(value, str) and word["unit"] and word["kind"] in ("number", "whole"):
        with refusals:
            number = _native.number_in(value, word["unit"])
        return name, round(number) if word["kind"] == "whole" else number
    return name, os.fspath(value) if isinstance(value, os.PathLike) else value


def _manual(declared: Mapping[str, Any]) -> str:
    lines = [f"{declared['kind']}: {declared['doc']}"]
    for word in declared["options"]:
        unit = f" [{word['unit']}]" if word["unit"] else ""
        unit += f" within {word['range']}" if "range" in word else ""
        default = "needed" if word["default"] is None else f"else {word['default']}"
        lines.append(f"  {word['name']:<14} {word['kind']}{unit}, {default}: {word['doc']}")
    return "\n".join(lines)


@taking
def load(path: str | os.PathLike[str]) -> Drivers:
    """Loads the drivers at `path`: a C or C++ source file (which it compiles), a shared object, or a folder of such files.

    The drivers are declared as described in `opengpac_driver.h`. They run in the process that opens a device with them: this program, or
    the process of a processor. Each file is first tried out in a separate process.
    """
    asked = Path(path).expanduser()
    if not asked.exists():
        refuse(ModuleError, f"file '{asked}' does not exist", "pass a source in C, a shared object or a folder")
    files = sorted(file for file in asked.iterdir() if file.suffix == ".so" or is_source(file)) if asked.is_dir() else [asked]
    if not files:
        refuse(ModuleError, f"folder '{asked}' has no driver", "put C sources or shared objects into it")
    kinds: dict[str, tuple[str, dict[str, Any]]] = {}
    for file in files:
        kept = _kept(file)
        for declared in _declared(kept, file):
            name = declared["kind"]
            if name in kinds:
                refuse(ModuleError, f"driver '{name}' is defined in two files of '{asked}'", "remove one")
            kinds[name] = f"{name}@{kept}", declared
    return Drivers(str(asked), kinds)


def _kept(file: Path) -> Path:
    """Returns a copy of the shared object, stored by its content, so that every process of this user finds it even if the file changes."""
    if is_source(file):
        with tempfile.TemporaryDirectory() as folder, refusals:
            content = Path(_native.build([str(file.absolute())], str(Path(folder) / "built.so"))).read_bytes()
    elif file.suffix == ".so":
        content = file.read_bytes()
    else:
        sources = ", ".join(f".{ending}" for ending in _native.source_endings())
        remedy = f"pass a source in C or C++ ({sources}), a shared object (.so) or a folder"
        refuse(ModuleError, f"'{file}' is not a driver file", remedy)
    folder_kept = user_cache() / "drivers"
    kept = folder_kept / f"{file.stem}-{hashlib.sha256(content).hexdigest()[:16]}.so"
    if kept.exists() and kept.read_bytes() == content:
        return kept
    try:
        folder_kept.mkdir(parents=True, exist_ok=True, mode=0o700)
        put(kept, content)
    except OSError as why:
        refuse(
            ModuleError,
            f"the driver of '{file}' cannot be stored in '{folder_kept}': {why}",
            "set XDG_CACHE_HOME to a writable folder",
        )
    return kept


def _declared(kept: Path, file: Path) -> list[dict[str, Any]]:
    """Returns the declarations of the drivers in a shared object. Runs its code in a separate process first."""
    command = [*processes.command("run_driver_trial"), str(kept)]
    try:
        tried = subprocess.run(command, capture_output=True, timeout=_TRIAL_SECONDS, stdin=subprocess.DEVNULL, check=False)
    except subprocess.TimeoutExpired:
        refuse(ModuleError, f"'{file}' did not load within {_TRIAL_SECONDS} s: its initialisation does not end")
    if tried.returncode < 0:
        refuse(
            ModuleError,
            f"'{file}' crashed the process that tried to load it: {signal.Signals(-tried.returncode).name}",
            "debug its initialisation",
        )
    with refusals:
        read = json.loads(_native.load_drivers(str(kept)) if tried.returncode == 0 else json.dumps({"problem": _said(tried.stderr)}))
    if "problem" in read:
        refuse(ModuleError, read["problem"].replace(str(kept), str(file)))
    return read["drivers"]


def _said(printed: bytes) -> str:
    return printed.decode(errors="replace").strip() or "the process that tried to load it failed without a message"
