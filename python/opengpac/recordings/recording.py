# SPDX-License-Identifier: Apache-2.0
"""Recordings: writes the activity of a running system to an MCAP file, and reads such a file back."""

from __future__ import annotations

import fnmatch
import json
import os
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from .. import _native, checking
from ..errors import CallError, UnknownName, ValueRefused, did_you_mean, refusals, refuse
from ..refusals.argument_types import taking
from ..values.encoding import dtype_of
from ..values.quantities import size_bytes

if TYPE_CHECKING:
    from ..system.observation import SystemObservation


class Recording:
    """A recording in progress. Created by `cell.record(path)`.

    It ends on `stop()`, at the end of its `with` block, or with its system. A write error ends it: `failure` contains the reason, and
    the system continues.
    """

    def __init__(self, system: SystemObservation, number: int, path: str, last: dict[str, Any] | None = None) -> None:
        self.system = system
        self.path = path
        """Path of the file; for a remote system, its name in the daemon's recordings folder."""
        self._number = number
        self._last = last

    def stop(self) -> dict[str, int]:
        """Stops the recording: writes all pending data, then the footer of the file. Returns the number of lost messages by channel,
        normally empty."""
        if self._last is None or self._last["running"]:
            with refusals:
                self._last = self._ended()
        return self.lost

    def _ended(self) -> dict[str, Any]:
        native = self.system._alive()
        while True:
            with refusals:
                summary = native.stop_recording(self._number)
                if not summary["running"]:
                    return summary

    @property
    def _summary(self) -> dict[str, Any]:
        last = self._last
        if last is None or last["running"]:
            with refusals:
                # The recording of a closed system has ended in order with it.
                last = self._last = self.system._native.recording(self._number)
        assert last is not None
        return last

    @property
    def files(self) -> list[str]:
        """Existing files, oldest first; the last one is being written. A split recording has several."""
        return self._summary["files"]

    @property
    def running(self) -> bool:
        """True while the recording runs. It stops before the disk is full, with a `failure`."""
        return self._summary["running"]

    @property
    def counts(self) -> dict[str, int]:
        """Number of messages written, by channel; during the recording, those already on disk. Messages in deleted files are included."""
        return self._summary["counts"]

    @property
    def lost(self) -> dict[str, int]:
        """Exact number of messages that could not be written, by channel; channels without losses are omitted."""
        return self._summary["lost"]

    @property
    def bytes(self) -> int:
        """Total size of the existing files."""
        return self._summary["bytes"]

    @property
    def free_bytes(self) -> int | None:
        """Number of free bytes on the disk at the latest write; `None` if this number is unknown."""
        return self._summary["free_bytes"]

    @property
    def failure(self) -> str | None:
        """Reason why writing failed, or None."""
        return self._summary["failure"]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if not self.system.closed:
            self.stop()

    def __repr__(self) -> str:
        summary = self._summary
        values = sum(count for name, count in summary["counts"].items() if not name.startswith("/"))
        lost = sum(summary["lost"].values())
        state = f"ended: {summary['failure']}" if summary["failure"] else "runs" if summary["running"] else "ended"
        return f"recording '{self.path}' ({state}): {values} values, {summary['bytes'] / 1e6:.1f} MB, {lost or 'nothing'} lost"


def begin(
    system: SystemObservation,
    path: str | os.PathLike[str],
    svvs: Sequence[str] | None,
    *,
    cells: bool,
    replay: bool,
    split: int | str | None,
    keep: int | None,
) -> Recording:
    """Begins a recording, as described in `System.record`."""
    if isinstance(svvs, str) or not all(isinstance(name, str) for name in ([] if svvs is None else svvs)):
        refuse(CallError, f"svvs= must be a list of names, not {svvs!r}", 'write svvs=["arm.*"], for example')
    if keep is not None and not 0 <= keep < 2**32:
        refuse(ValueRefused, f"keep= must be at least 2, not {keep}", "pass the number of files to keep")
    file = os.fspath(path)
    if system.session is None:
        file = str(Path(file).expanduser().absolute())
    options = {"svvs": ["*"] if svvs is None else list(svvs), "cells": cells, "replay": replay}
    split_bytes = None if split is None else size_bytes(split, "split=")
    if checking.active():
        # Nothing runs, and no file is made that could obstruct the run.
        if system.session is None:
            checking.would_record(file, system, options)
        nothing = {"files": [file], "running": False, "counts": {}, "lost": {}, "bytes": 0, "free_bytes": None, "failure": None}
        return Recording(system, 0, file, nothing)
    with refusals:
        begun = system._alive().record(file, **options, split_bytes=split_bytes, keep=keep)["recording"]
    return Recording(system, begun, file)


DAMAGE_SHOWN = 3
"""Maximum number of unreadable sections of a damaged file that a warning lists."""


@dataclass(frozen=True)
class RecordingDamage:
    """A section of a recording's file that cannot be read; `recorded.damage` lists all of them. Created by `gpac.open_recording`."""

    begins: int
    """Offset of the first unreadable byte in the file."""
    ends: int
    """Offset of the first byte after the unreadable section."""
    what: str
    """Reason why the section cannot be read."""
    span: tuple[float, float] | None
    """Time span in which data are lost, in s on the system's clock; None if it cannot be determined."""
    lost: dict[str, int] | None
    """Number of lost messages, by channel: empty if no message is lost, None if it cannot be determined."""

    @classmethod
    def _of(cls, said: Mapping[str, Any]) -> Self:
        span = None if said["from_ns"] is None else (said["from_ns"] * 1e-9, said["to_ns"] * 1e-9)
        return cls(said["begins"], said["ends"], said["what"], span, said["lost"])

    def __str__(self) -> str:
        if self.lost == {}:
            loss = "no message is lost"
        else:
            count = "messages" if self.lost is None else f"{sum(self.lost.values())} messages of {', '.join(self.lost)}"
            when = "" if self.span is None else f" between {self.span[0]:.6g} s and {self.span[1]:.6g} s"
            loss = f"{count}{when} are lost" + ("; the file does not contain their number" if self.lost is None else "")
        return f"bytes {self.begins} to {self.ends}: {self.what}; {loss}"


class Recorded(Mapping[str, np.ndarray]):
    """A recording read back: a mapping from names of SVVs to structured arrays of `number`, `time` (s on the system's clock) and
    `value`.

    Returned by `gpac.open_recording(path)`.

    `recorded["arm.joint1.sensed"]["value"]` has one row per publication, with the shape (n,) followed by the shape of the type, in
    `recorded.unit(name)`. Names of private cells are `INSTANCE:CELL`. Raises `KeyError` for a name that was not recorded,
    `ValueRefused` for a file that cannot be read.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = str(Path(path).expanduser())
        with refusals:
            self._native = _native.open_recording(self.path)
            self._series: dict[str, Any] = json.loads(self._native.series_json())
            about = json.loads(self._native.about_json())
        self.complete: bool = about["complete"]
        """False if the file is incomplete because its recorder was killed or the disk was full; it then contains all data up to that
        time."""
        self.lost: dict[str, int] = about["lost"]
        """Number of messages that its recorder could not write in time, by channel; channels without losses are omitted."""
        self.damage: list[RecordingDamage] = [RecordingDamage._of(one) for one in about["damage"]]
        """Sections of the file that cannot be read, with their location, time and messages; everything else is included."""
        self.metadata: dict[str, dict[str, str]] = about["metadata"]
        """Metadata of the system in the file: name, version, configuration, and the epoch of its clock."""
        if self.damage:
            shown = "; ".join(str(one) for one in self.damage[:DAMAGE_SHOWN])
            rest = len(self.damage) - DAMAGE_SHOWN
            more = f"; see recording.damage for {rest} more" if rest > 0 else ""
            places = "one place" if len(self.damage) == 1 else f"{len(self.damage)} places"
            warnings.warn(f"recording '{self.path}' is damaged in {places}: {shown}{more}", UserWarning, stacklevel=4)

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self._series:
            raise KeyError(f"'{self.path}' has no SVV '{name}'; {did_you_mean(name, self) or 'list them with list(recording)'}")
        with refusals:
            numbers, times, values = self._native.series(name)
        dtype = dtype_of(self._series[name]["type"])
        array = np.zeros(self._series[name]["count"], dtype=[("number", "<u8"), ("time", "<f8"), ("value", dtype)])
        array["number"] = np.frombuffer(numbers, "<u8")
        array["time"] = np.frombuffer(times, "<i8") * 1e-9
        array["value"] = np.frombuffer(values, dtype) if len(array) else array["value"]
        return array

    def __iter__(self) -> Iterator[str]:
        return iter(self._series)

    def __len__(self) -> int:
        return len(self._series)

    def unit(self, name: str) -> str:
        """Returns the unit of the SVV called `name`, or an empty text."""
        return self._series[name]["unit"]

    def names(self, *patterns: str) -> list[str]:
        """Returns the names that match one of the `patterns`, where `*` stands for any characters and `?` for one character. Raises
        `UnknownName` if no name matches."""
        found: list[str] = []
        for pattern in patterns:
            of = [name for name in self if fnmatch.fnmatchcase(name, pattern)]
            if not of:
                refuse(UnknownName, f"'{self.path}' has no SVV '{pattern}'", did_you_mean(pattern.strip("*?"), self))
            found += [name for name in of if name not in found]
        return found

    def _records(self, topic: str) -> list[Any]:
        with refusals:
            return [message for _, message in json.loads(self._native.records_json(topic))]

    @property
    def log(self) -> list[dict[str, Any]]:
        """Returns the entries of the log, like `cell.log()`."""
        return self._records("/log")

    @property
    def conditions(self) -> list[dict[str, Any]]:
        """Returns the log entries about conditions and faults."""
        return [entry for entry in self.log if entry["kind"] in ("condition", "fault")]

    @property
    def ends(self) -> list[dict[str, Any]]:
        """Returns the end reports: `number`, `instance` and `report`."""
        return self._records("/ends")

    @property
    def timing(self) -> dict[str, list[dict[str, Any]]]:
        """Returns firings, jitter, durations and overruns of each interrupt source, recorded once a second."""
        prefix = "/timing/"
        with refusals:
            topics = self._native.topics()
        return {topic[len(prefix) :]: self._records(topic) for topic in topics if topic.startswith(prefix)}

    def __repr__(self) -> str:
        values = sum(of["count"] for of in self._series.values())
        state = "" if self.complete else ", without an end"
        state += f", damaged in {len(self.damage)} places" if self.damage else ""
        return f"recording '{self.path}'{state}: {len(self)} SVVs and cells, {values} values, {sum(self.lost.values()) or 'nothing'} lost"


class Unmade(Recorded):
    """Recording that a checked program would have made. It has the SVVs without values, an empty log, and no ends."""

    def __init__(self, path: str, system: SystemObservation, options: Mapping[str, Any]) -> None:
        self.path = path
        self._native = _Nothing()
        # The counts of a closed system remain available.
        native = system._native
        with refusals:
            names = [name for name in native.names()["svvs"] if any(fnmatch.fnmatchcase(name, of) for of in options["svvs"])]
            abouts = {name: native.svv_about(name) for name in names}
        self._series = {name: {"type": about["type"], "unit": about["unit"], "count": 0} for name, about in abouts.items()}
        self._cells: bool = options["cells"]
        self.complete, self.lost, self.damage, self.metadata = True, {}, [], {}

    def __getitem__(self, name: str) -> np.ndarray:
        if self._cells and ":" in name:
            # The instances, and hence their cells, are known only in a run.
            return np.zeros(0, dtype=[("number", "<u8"), ("time", "<f8"), ("value", "<f8")])
        return super().__getitem__(name)


class _Nothing:
    """Stand-in for a file, without messages."""

    def series(self, _: str) -> tuple[bytes, bytes, bytes]:
        return b"", b"", b""

    def records_json(self, _: str) -> str:
        return "[]"

    def topics(self) -> list[str]:
        return []


@taking
def open_recording(path: str | os.PathLike[str]) -> Recorded:
    """Reads the recording at `path`, created by `cell.record()` or `opengpac record`.

    The result is a mapping of names to structured arrays of `number`, `time` (s) and `value`, with `log`, `conditions`, `ends`,
    `timing` and `lost`. The intact sections of a damaged file are included; a warning reports the location, time and messages of the
    others (`damage`). Raises `ValueRefused` if the file is not a recording. While a program is only checked (`opengpac check`), its
    own recordings have names, types and units, but no values.
    """
    unmade = checking.recorded(file := str(Path(path).expanduser().absolute()))
    return Recorded(path) if unmade is None else Unmade(file, *unmade)
