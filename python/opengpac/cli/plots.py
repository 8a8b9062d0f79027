# SPDX-License-Identifier: Apache-2.0
"""The commands `opengpac record` and `opengpac plot`: record a program, and plot a recording."""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import CallError, FileFailed, refuse
from ..recordings.recording import Recorded, Recording
from ..system import programs
from ..system.system import System
from ..values.quantities import duration_ns


def add_to(commands: Any) -> None:
    """Adds both commands to the parser."""
    record = commands.add_parser("record", help="run a program and record every system that it makes")
    record.add_argument(
        "-o", "--output", metavar="FILE", required=True, help="path of the MCAP file; further systems add their names to it"
    )
    record.add_argument("--svvs", metavar="NAME", action="append", help="SVVs to record, with * and ? (default: all)")
    record.add_argument("--cells", action="store_true", help="also record the private cells of verb instances")
    record.add_argument("--no-replay", action="store_true", help="omit the data that only 'opengpac replay' needs")
    record.add_argument("--split", metavar="SIZE", help="start a new file at this size, such as 500MB; requires --no-replay")
    record.add_argument("--keep", metavar="NUMBER", type=int, help="number of newest files to keep; requires --split")
    programs.add_to(record)
    record.set_defaults(run=_record)
    plot = commands.add_parser("plot", help="plot SVVs of a recording")
    plot.add_argument("recording")
    plot.add_argument("svvs", nargs="+", metavar="NAME", help="SVVs to plot, with * and ?")
    plot.add_argument("-o", "--output", metavar="PICTURE", help="path of the picture (default: the recording's name with .png)")
    plot.add_argument("--from", dest="begin", metavar="TIME", help="begin on the system's clock, for example 1s")
    plot.add_argument("--to", dest="end", metavar="TIME")
    plot.add_argument("--csv", metavar="FILE", help="also write the values as text; without -o no picture is made")
    plot.set_defaults(run=_plot)


class _Recording(programs.Watcher):
    """Watcher that records every system of the program, each into a separate file."""

    def __init__(self, given: argparse.Namespace) -> None:
        self.given = given
        self.recordings: list[tuple[System, Recording]] = []

    def made(self, system: System) -> None:
        path = Path(self.given.output)
        if self.recordings:
            path = path.with_stem(f"{path.stem}-{system.name}-{len(self.recordings) + 1}")
        # A remote system has already fixed its interrupt sources.
        replay = system.session is None and not self.given.no_replay
        given = self.given
        recording = system.record(path, svvs=given.svvs, cells=given.cells, replay=replay, split=given.split, keep=given.keep)
        self.recordings.append((system, recording))


def _record(given: argparse.Namespace) -> int:
    recording = _Recording(given)
    with programs.watched(recording):
        try:
            programs.run(given)
        finally:
            for system, written in recording.recordings:
                # Close in order: moving devices come to rest within the recording.
                system.close()
                print(written, file=sys.stderr)
    if not recording.recordings:
        print(f"nothing was recorded: program '{given.program}' created no system", file=sys.stderr)
        return 1
    return 0


def _plot(given: argparse.Namespace) -> int:
    recorded = Recorded(given.recording)
    names = recorded.names(*given.svvs)
    begin, end = (None if word is None else _time(word) for word in (given.begin, given.end))
    series = {name: _between(recorded[name], begin, end) for name in names}
    if not any(len(of) for of in series.values()):
        refuse(CallError, f"no values of {', '.join(names)} were recorded in that interval", "choose another interval with --from and --to")
    if given.csv:
        _write_csv(given.csv, series)
        print(given.csv)
    if given.output or not given.csv:
        print(_draw(given.output or str(Path(given.recording).with_suffix(".png")), recorded, series))
    return 0


def _time(word: str) -> float:
    return duration_ns(word, "a time") * 1e-9


def _between(of: np.ndarray, begin: float | None, end: float | None) -> np.ndarray:
    times = of["time"]
    return of[(times >= (begin if begin is not None else -np.inf)) & (times <= (end if end is not None else np.inf))]


def _columns(name: str, of: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Yields a series as columns of numbers: one for each element of an array or member of a struct."""
    values = of["value"] if of.dtype.names == ("number", "time", "value") else of
    if values.dtype.names:
        for member in values.dtype.names:
            yield from _columns(f"{name}.{member}", values[member])
    elif values.ndim > 1:
        flat = values.reshape(len(values), -1)
        yield from ((f"{name}[{index}]", flat[:, index]) for index in range(flat.shape[1]))
    else:
        yield name, values


def _write_csv(path: str, series: dict[str, np.ndarray]) -> None:
    try:
        with open(path, "w", newline="") as file:
            rows = csv.writer(file)
            rows.writerow(["name", "number", "time_s", "value"])
            for name, of in series.items():
                for column, values in _columns(name, of):
                    rows.writerows(
                        (column, n, repr(float(t)), v) for n, t, v in zip(of["number"], of["time"], values.tolist(), strict=True)
                    )
    except OSError as why:
        refuse(FileFailed, f"cannot write '{path}': {why.strerror}", "check that the folder exists and that you may write there")


def _draw(path: str, recorded: Recorded, series: dict[str, np.ndarray]) -> str:
    try:
        from matplotlib.figure import Figure
    except ImportError:
        refuse(CallError, "pictures need matplotlib, which is not installed", "run pip install 'opengpac[plot]', or use --csv FILE")
    units = list(dict.fromkeys(recorded.unit(name) for name in series))
    figure = Figure(figsize=(10, 2 + 2.4 * len(units)), layout="constrained")
    axes = figure.subplots(len(units), 1, sharex=True, squeeze=False)[:, 0]
    for axis, unit in zip(axes, units, strict=True):
        for name, of in series.items():
            if recorded.unit(name) == unit:
                for column, values in _columns(name, of):
                    # A value holds until the next one is stored.
                    axis.step(of["time"], values, where="post", label=column, linewidth=1)
        axis.set_ylabel(unit or "value")
        axis.grid(alpha=0.3)
        axis.legend(loc="upper right", fontsize="small")
    axes[-1].set_xlabel("time in s")
    try:
        figure.savefig(path, dpi=120)
    except (OSError, ValueError) as why:
        refuse(
            FileFailed,
            f"cannot create picture '{path}': {why}",
            "choose a file name that ends with .png, .svg or .pdf, in an existing folder",
        )
    return path
