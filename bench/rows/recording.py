# SPDX-License-Identifier: Apache-2.0
"""Recording, compared with the same run without it: firings of a chain whose every output is recorded, at full rate and under the
virtual clock."""

from __future__ import annotations

import contextlib
import tempfile
import time as clock
from collections.abc import Callable, Iterator
from pathlib import Path

from lines import Line, median, time

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

BLOCKS = 200
BAR_ATTACHED = 1.05


def measure(rounds: int, quick: bool) -> Iterator[Line]:
    """Measures a chain of 200 blocks at 1 kHz."""
    looks = 200 if quick else 2000
    with tempfile.TemporaryDirectory() as folder:
        yield _attached(Path(folder), rounds, looks)
        yield _for_replay(Path(folder), rounds, looks)
        yield _recorded(Path(folder), rounds, 500 if quick else 5000)


def _chain(cell: gpac.System) -> gpac.Verb[..., gpac.Report]:
    """Returns a chain of 200 gains fed by a signal generator; every output is a private cell."""
    blocks = {"wave": lib.signal_generator, **{f"g{n}": lib.gain for n in range(BLOCKS)}}
    ports = ["wave.y", *(f"g{n}.y" for n in range(BLOCKS))]
    cells = {f"c{n}": [port, f"g{n}.u"] for n, port in enumerate(ports[:-1])}
    start = [activate("wave", every="1 ms"), *(activate(f"g{n}") for n in range(BLOCKS))]
    fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
    cells["last"] = [ports[-1]]
    return gpac.Verb("chain", blocks=blocks, cells=cells, command_lists={"start": start}).on(fast)


def _in_turns(files: Path, rounds: int, taken: Callable[[Path | None], float]) -> tuple[float, list[float]]:
    """Returns the ratio of the times with and without a record, and the times without in each round; the records' names begin with
    `files`."""
    ratios, plain = [], []
    for turn in range(rounds):
        plain.append(taken(None))
        ratios.append(taken(files.with_name(f"{files.name}{turn}.mcap")) / plain[-1])
    return median(ratios), plain


def _attached(folder: Path, rounds: int, looks: int) -> Line:
    """Compares the time of a firing with and without a recorder that writes every SVV and the log."""
    with gpac.System("bench") as cell:
        _chain(cell).asynch()
        wave = lib.signal_generator
        out = gpac.Verb(
            "out", blocks={"w": wave}, instantiation_parameters={"y": "w.y"}, command_lists={"start": [activate("w", every="1 ms")]}
        )
        out.on(cell.sources["rtp0.fast"]).asynch(cell.svv("y"))

        def fires(record: Path | None) -> float:
            with contextlib.nullcontext() if record is None else cell.record(record):
                return _duration(cell, looks)

        ratio, plain = _in_turns(folder / "attached", rounds, fires)
    return _line("tap and recorder attached to a running cell", ratio, plain, BAR_ATTACHED, "≤ 1.05 ×")


def _for_replay(folder: Path, rounds: int, looks: int) -> Line:
    """Compares the time of a firing with and without a record for replay: a copy of all external input, and a digest of the values
    stored by 200 blocks."""

    def fires(record: Path | None) -> float:
        with gpac.System("bench") as cell:
            if record is not None:
                cell.record(record, replay=True)
            _chain(cell).asynch()
            return _duration(cell, looks)

    return _line("recorded for replay", *_in_turns(folder / "replay", rounds, fires), None, "")


def _duration(cell: gpac.System, looks: int) -> float:
    """Returns the median duration of firings of `fast`, ns."""
    taken = []
    for _ in range(looks):
        taken.append(cell.statistics["sources"]["rtp0.fast"]["duration_last_ns"])
        clock.sleep(0.001)
    return median(taken)


def _recorded(folder: Path, rounds: int, firings: int) -> Line:
    """Compares virtual time with and without recording every output of the chain to disk."""

    def took(record: Path | None) -> float:
        with gpac.System("bench", clock="virtual") as cell:
            _chain(cell).asynch()
            recording = None if record is None else cell.record(record, cells=True)
            begun = clock.perf_counter_ns()
            cell.advance(f"{firings} ms")
            if recording is not None:
                recording.stop()
            return (clock.perf_counter_ns() - begun) / firings

    line = _line("a chain of 200, every output recorded, virtual clock", *_in_turns(folder / "chain", rounds, took), None, "")
    line.note = "time waits for the disk here; the kernel's own share is the row 'recorded' of dispatch"
    return line


def _line(what: str, ratio: float, plain: list[float], bar: float | None, bar_text: str) -> Line:
    return Line("recording", what, time(ratio * median(plain)), f"without {time(median(plain))}", ratio, f"{ratio:.2f} ×", bar, bar_text)
