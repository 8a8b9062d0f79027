# SPDX-License-Identifier: Apache-2.0
"""Shared parts of the example programs: options, the account of how their verbs ended, traces, and exit codes."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

import opengpac as gpac

BLOCKS = Path(__file__).parent / "blocks"
"""Folder of the examples' function blocks in C."""

SCENES = Path(__file__).parent / "scenes"
"""Folder of the arms' surroundings, as MJCF files."""


def parser(about: str | None) -> argparse.ArgumentParser:
    """Returns a parser with the options that every example has."""
    made = argparse.ArgumentParser(description=about)
    made.add_argument("--clock", choices=["real", "virtual"], default="real", help="virtual: as fast as it goes, and the same each time")
    made.add_argument("--output", type=Path, default=Path("out"), help="folder of plots")
    made.add_argument("--trace", type=Path, help="file for the recorded values, as a table of text")
    return made


def system(name: str, options: argparse.Namespace) -> gpac.System:
    """Returns the example's system, under the requested clock."""
    return gpac.System(name, clock="virtual" if options.clock == "virtual" else "monotonic")


def add_driver(parser: argparse.ArgumentParser) -> None:
    """Adds the option that selects how the arm is moved."""
    parser.add_argument(
        "--driver", choices=["mujoco", "ur"], default="mujoco", help="the arm: simulated, or by the driver of its controller"
    )


@contextmanager
def controller(options: argparse.Namespace, *, tool: str | None = None, scene: Path | None = None) -> Iterator[gpac.drivers.fake.ur | None]:
    """Yields the emulated controller that `--driver ur` uses in place of a real one, with its arm; `None` if the arm is simulated."""
    if options.driver == "mujoco":
        yield None
        return
    with gpac.drivers.fake.ur(gpac.deg([0, -90, 90, -90, -90, 0]), model="ur5e", tool=tool, scene=scene) as robot:
        yield robot


def commanding(robot: gpac.drivers.fake.ur | None) -> gpac.drivers.Driver | None:
    """Returns the driver of that controller's arm."""
    # This machine may be late where a real controller would not be.
    return None if robot is None else robot.driver(timeout="5 s", silence="5 s")


def studio(cell: gpac.System, options: argparse.Namespace) -> None:
    """Prints the address of the system's page, except under the virtual clock: the run would end before anybody opens the page."""
    if options.clock == "virtual":
        return
    try:
        print(f"studio: {cell.studio().url}", flush=True)
    except gpac.FileFailed as missing:
        # In a checkout without a built page everything else works.
        print(f"studio: none, {missing.message}; {missing.remedy}", flush=True)


def run(main: Callable[[], int]) -> None:
    """Runs a program and exits with its code; 130 after Ctrl-C, when leaving the system has halted all that ran."""
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        print("\nInterrupted: what ran was halted, the devices are disabled and their brakes hold", file=sys.stderr)
        sys.exit(130)


class Trace:
    """Values of SVVs with a history, collected in pieces before they drop out of the histories."""

    def __init__(self, *svvs: gpac.SVV[Any]) -> None:
        self._svvs = svvs
        self._last: dict[str, float] = {}
        self._rows: dict[str, list[np.ndarray]] = {}

    def collect(self) -> None:
        """Collects the new entries of the histories."""
        for svv in self._svvs:
            rows = svv.history[:]
            new = rows[rows["time"] > self._last.get(svv.name, -1.0)]
            if len(new):
                self._last[svv.name] = float(new["time"][-1])
                self._rows.setdefault(svv.name, []).append(new)

    def of(self, svv: gpac.SVV[Any]) -> tuple[np.ndarray, np.ndarray]:
        """Returns times (s) and values. Exits the program if nothing was recorded, as when it is only checked."""
        if svv.name not in self._rows:
            sys.exit(f"nothing was recorded of '{svv.name}'")
        rows = np.concatenate(self._rows[svv.name])
        return rows["time"], rows["value"]

    def table(self, every: float) -> str:
        """Returns a row for every `every` seconds: the time, and the value of each SVV then; `nan` before its first value."""
        last = max(self._last.values(), default=0.0)
        times = np.arange(int(last / every) + 1) * every
        names, columns = ["time"], [times]
        for svv in self._svvs:
            at, values = self.of(svv)
            held = np.searchsorted(at, times + 1e-9, side="right") - 1
            for k, column in enumerate(np.atleast_2d(values.T)):
                names.append(svv.name if values.ndim == 1 else f"{svv.name}[{k}]")
                columns.append(np.where(held >= 0, column[held], np.nan))
        rows = [" ".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True)]
        return "\n".join([" ".join(names), *rows]) + "\n"

    def save(self, file: Path | None, every: float) -> None:
        """Writes the table if a file was requested."""
        if file is not None:
            self.collect()
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(self.table(every))


class Account:
    """Account of how each verb ended, and how it should have."""

    def __init__(self, trace: Trace | None = None) -> None:
        self._trace = trace
        self.rows: list[tuple[str, str, str, str]] = []
        self._begun = 0

    def begin(self, what: str) -> None:
        """Announces the next step."""
        self._begun += 1
        print(f"  {self._begun}. {what} …", flush=True)

    def end(self, what: str, report: gpac.Report, wanted: str, more: str = "") -> None:
        """Records how a verb ended."""
        if self._trace is not None:
            self._trace.collect()
        self.rows.append((what, report.condition, wanted, f"{report.time:.2f} s{more}"))
        print(f"     {report.condition} after {report.time:.2f} s{more}", flush=True)

    def expect(self, what: str, holds: bool, more: str = "") -> None:
        """Records whether a figure is as expected."""
        self.rows.append((what, "holds" if holds else "fails", "holds", more))
        print(f"     {what}: {more or holds}", flush=True)

    @property
    def as_wanted(self) -> bool:
        """True if every verb ended as expected and every figure holds."""
        return all(condition == wanted for _, condition, wanted, _ in self.rows)

    def verdict(self) -> int:
        """Prints the account; returns the exit code, 0 if all is as expected."""
        print("\nHow each verb ended")
        for what, condition, wanted, more in self.rows:
            print(f"  {what:<34} {condition:<11} {'as it should' if condition == wanted else 'should be ' + wanted:<16} {more}")
        print("All verbs ended as they should" if self.as_wanted else "A verb did not end as it should")
        return 0 if self.as_wanted else 1
