# SPDX-License-Identifier: Apache-2.0
"""Replay of recorded runs: the command `opengpac replay` and `gpac.replay`."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from .. import _native, checking
from ..errors import CallError, refusals, refuse
from ..refusals.argument_types import taking
from ..values.quantities import Quantity, duration_ns


@dataclass(frozen=True)
class Difference:
    """The first value that differs from the recorded value. Created by `gpac.replay`."""

    source: str
    """Name of the interrupt source, `processor.source`."""
    firing: int
    """Number of the firing, counted from the first firing of its source."""
    time: float
    """Release time of the firing, in s on the clock of the recording."""
    between: bool
    """True if the difference occurred between this firing and the next, in an action of a script, such as an `execute`."""
    block: str
    """Label of the block, `INSTANCE.LABEL`; empty if only the digest over all blocks of the source is known to differ."""
    port: str
    """Output whose value differs."""
    svv: str
    """SVV in which the output is stored; empty for a private cell or if unknown."""
    recorded: tuple[str, ...]
    """Elements of the recorded value, in full precision; hexadecimal digits for a structure."""
    replayed: tuple[str, ...]
    """Elements of the replayed value, in the same format."""
    how: str
    """Description of the deviation, if the execution of the source deviated from the record."""

    def __str__(self) -> str:
        where = f"{'after' if self.between else 'in'} firing {self.firing} of source '{self.source}' (at {self.time:.6f} s)"
        if not self.block:
            return f"{where}: {self.how}"
        recorded, replayed = (value[0] if len(value) == 1 else f"({', '.join(value)})" for value in (self.recorded, self.replayed))
        values = f"recorded {recorded}, now {replayed}{f' ({self.how})' if self.how else ''}"
        return f"block '{self.block}', output '{self.port}', {where}: {values}"


@dataclass(frozen=True)
class Replay:
    """Result of replaying a recording: its extent, and the findings. Returned by `gpac.replay`."""

    stopped: Literal["end", "condition", "time", "difference", "unplayable"]
    """Reason why the replay stopped: the recording ended, `until` holds, `to` was reached, a value differs, or the recording lacks the
    data needed to continue."""
    firings: int
    """Number of replayed firings of all sources."""
    same: bool
    """True if every value so far equals the recorded one, bit for bit."""
    source: str
    """Position at which the replay stopped: source, firing, and release time in s on the clock of the recording."""
    firing: int
    time: float
    difference: Difference | None
    fingerprint: str
    """Digest of all inputs and values so far. It is equal for two recordings of one run under the virtual clock."""
    message: str
    """Reason why the recording is `unplayable`, or another message; may be empty."""
    svvs: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Elements of each SVV requested with `show`, in full precision."""

    def __str__(self) -> str:
        at = f"firing {self.firing} of source '{self.source}' (at {self.time:.6f} s)"
        so_far = f"{self.firings:,} firings, all values equal to the recorded ones"
        if self.stopped == "unplayable":
            text = f"{self.firings:,} firings until {at}; {self.message}"
        elif self.difference is not None:
            text = f"{self.firings:,} firings; the first difference: {self.difference}"
        elif self.stopped == "end":
            text = f"{so_far}{f'; {self.message}' if self.message else ''}"
        else:
            text = f"{so_far}; {'the condition held' if self.stopped == 'condition' else 'the time was reached'} after {at}"
        return "\n".join([text, *(f"  {name} = {', '.join(value)}" for name, value in self.svvs.items())])


@taking
def replay(
    path: str | os.PathLike[str],
    *,
    until: str | None = None,
    to: float | str | Quantity | None = None,
    show: Sequence[str] = (),
    modules: Sequence[str | os.PathLike[str]] = (),
    trust: bool | Sequence[str] = False,
) -> Replay:
    """Replays the recording at `path`, created by `cell.record(path, replay=True)` or `opengpac record`, and compares every value with
    it.

    `until` is a condition over SVVs at which to stop: comparisons with numbers, joined by `and` and `or`, for example `"force > 20
    and joint.sensed[2] <= 0.5"`. `to` is a time on the clock of the recording. `show` selects the SVVs whose values are returned; `*`
    matches anything. `modules` are C or C++ sources, or code modules, that replace those of the same name in the recording: the first
    difference names block, port and firing.

    A recording includes the code modules of its blocks, and replaying it runs them with all of your privileges: `trust=True` declares
    that you trust the origin of the file, even if it is your own. A sequence of SHA-256 digests trusts only those modules. A
    recording with only library blocks includes none. Raises `CallError` for a file that is not a recording or that includes untrusted
    code, for a condition that cannot be parsed, and for an SVV that the recording does not contain. While a program is only checked
    (`opengpac check`), the replay of its own recordings has no firings.
    """
    file = Path(path)
    unmade = checking.recorded(str(file.expanduser().absolute()))
    if unmade is not None:
        return _unplayed(file, unmade[1])
    if not file.exists():
        refuse(CallError, f"record '{file}' does not exist", "create one: cell.record('run.mcap', replay=True)")
    asked: dict[str, Any] = {"until": until, "to_ns": None if to is None else duration_ns(to), "show": list(show)}
    asked["trust"] = trust if isinstance(trust, bool) else list(trust)
    with refusals:
        asked["with"] = [_module(Path(module)) for module in modules]
        found = json.loads(_native.replay(str(file), json.dumps(asked)))
    return _replay(found)


def _unplayed(file: Path, options: Mapping[str, Any]) -> Replay:
    """Returns the replay of a recording that a run would have made."""
    if not options["replay"]:
        refuse(CallError, f"'{file}' contains nothing to replay", "record with cell.record(path, replay=True)")
    return Replay("end", 0, True, "", 0, 0.0, None, "", "nothing ran: the program is only being checked")


def _module(file: Path) -> tuple[str, str]:
    if file.suffix == ".so":
        return file.stem, str(file)
    with refusals:
        return file.stem, _native.build([str(file.absolute())], None)


def _replay(found: dict[str, Any]) -> Replay:
    told = found["difference"]
    difference = told and Difference(
        told["source"], told["number"], told["time_ns"] / 1e9, told["between"], told["block"], told["port"], told["svv"],
        tuple(told["recorded"]), tuple(told["replayed"]), told["how"],
    )  # fmt: skip
    svvs = {svv["name"]: tuple(svv["value"]) for svv in found["svvs"]}
    at = (found["source"], found["number"], found["time_ns"] / 1e9)
    return Replay(found["stopped"], found["firings"], found["same"], *at, difference, found["fingerprint"], found["message"], svvs)


def add_to(commands: Any) -> None:
    """Adds the command `replay`."""
    again = commands.add_parser("replay", help="repeat a recorded run without its program, and compare every value")
    again.add_argument("record")
    again.add_argument("--until", metavar="CONDITION", help="stop when this condition holds: 'force > 20 and joint.sensed[2] <= 0.5'")
    again.add_argument("--to-time", metavar="TIME", help="stop after this time on the clock of the record: '2.5 s'")
    again.add_argument("--show", metavar="SVV", action="append", default=[], help="print this SVV at the end; * stands for any text")
    again.add_argument(
        "--with",
        metavar="FILE",
        action="append",
        default=[],
        dest="modules",
        help="C file, C++ file or module to use instead of the recorded one",
    )
    again.add_argument("--trust", action="store_true", help="run the native code of the record without asking")
    again.set_defaults(run=_again)


def _again(given: argparse.Namespace) -> int:
    trust = True if given.trust else _asked_for(Path(given.record))
    found = replay(given.record, until=given.until, to=given.to_time, show=given.show, modules=given.modules, trust=trust)
    print(found)
    return 0 if found.same else 1


def _asked_for(file: Path) -> Sequence[str]:
    """Asks the user at the terminal whether to trust the modules; returns the digests of the trusted ones, or none if there is no
    terminal."""
    if not (file.exists() and sys.stdin.isatty() and sys.stderr.isatty()):
        return ()
    with refusals:
        brought = json.loads(_native.replay_modules(str(file)))
    if not brought:
        return ()
    print(f"'{file}' contains native code, which a replay runs with all your privileges:", file=sys.stderr)
    for module in brought:
        print(f"  {module['name']}, {module['len']} bytes, SHA-256 {module['sha256']}", file=sys.stderr)
    print("The file does not identify who built it. Run it? [y/N] ", end="", file=sys.stderr, flush=True)
    return [module["sha256"] for module in brought] if sys.stdin.readline().strip().lower() in ("y", "yes") else ()
