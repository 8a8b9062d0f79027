# SPDX-License-Identifier: Apache-2.0
"""Measures the windows without a guard: kills or stops guards and, after a span, everything else that could make the outputs safe.

    python tests/faults/windows.py             with one guard process lost, and with both: each span, 3 times
    python tests/faults/windows.py --times 10  more often
    python tests/faults/windows.py --load 13   with that many processes that compute

With threads the second victim is the program, killed or stopped; with processes under `continue` it is supervisor and processor, both
killed. The plant has no watchdog of its own. A window is the longest span after which its outputs did not become safe within 2 s; the
report is in `out/windows.json`. It fails if the loss of a single guard process opens a window.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import leftovers
from leftovers import Before
from plant import Plant, until
from watched import KILL, SIGNALS, STOP, Program, put_away

OUT = Path(__file__).parent.parent.parent / "out" / "windows.json"
SPANS_MS = (0, 1, 2, 5, 10, 20, 30, 50, 100, 200)
"""Spans from the loss of the guards to that of the guarded processes."""
WITHIN_S = 2.0


@dataclass(frozen=True)
class Kind:
    """Losses: a number of guard processes, and then the program (threads), or supervisor and processor (processes)."""

    process: bool
    guards: int
    of_guards: str
    of_others: str

    @property
    def name(self) -> str:
        """Description of the kind."""
        guards = "one guard" if self.guards == 1 else "all guards"
        others = "supervisor and processor" if self.process else "program"
        return f"{'processes' if self.process else 'threads'}: {self.of_guards} {guards}, then {self.of_others} {others}"


def kinds() -> list[Kind]:
    """Returns all kinds."""
    found = []
    for guards in (1, 2):
        for of_guards in (KILL, STOP):
            found += [Kind(False, guards, of_guards, of_others) for of_others in (KILL, STOP)]
            found.append(Kind(True, guards, of_guards, KILL))
    return found


@dataclass
class Loss:
    """Consequences of one loss."""

    kind: str
    span_ms: float
    is_safe: bool
    safe_ms: float | None = None


def lose(kind: Kind, span_ms: float) -> Loss:
    """Makes the losses; returns whether the outputs became safe, and how long after the second loss."""
    before, plant = Before(), Plant()
    program = Program(plant, process=kind.process, if_cut_off="continue" if kind.process else None)
    try:
        plant.until_pushed()
        guards = program.started("run_guard")[: kind.guards]
        others = [program.process.pid, *(program.started("run_processor") if kind.process else [])]
        begun = time.monotonic()
        for guard in guards:
            os.kill(guard, SIGNALS[kind.of_guards])
        while time.monotonic() < begun + span_ms * 1e-3:
            time.sleep(0.0005)
        lost_ns = time.monotonic_ns()
        for process in others:
            os.kill(process, SIGNALS[kind.of_others])
        safe_ms = _safe_ms(plant, lost_ns)
        return Loss(kind.name, span_ms, safe_ms is not None, safe_ms)
    finally:
        if kind.of_others == KILL:
            # A plant without commanders does not wait for the program's end.
            program.process.wait()
        else:
            program.end()
        put_away(before)


def _safe_ms(plant: Plant, lost_ns: int) -> float | None:
    instant: list[int] = []

    def is_over() -> bool:
        state = plant.state()
        if state is not None and state["is_safe"]:
            instant.append(state["obeyed_ns"])
        time.sleep(0.0005)
        return bool(instant) or state is None or time.monotonic_ns() > lost_ns + WITHIN_S * 1e9

    until(is_over, "the plant does not answer")
    return max(0, instant[0] - lost_ns) * 1e-6 if instant else None


def table(found: list[Loss]) -> str:
    """Returns the window of each kind, and the slowest loss that became safe."""
    lines = [f"{'':74}{'window, ms':>10} {'safe after, ms':>15}"]
    for name in dict.fromkeys(loss.kind for loss in found):
        of_kind = [loss for loss in found if loss.kind == name]
        window = max((loss.span_ms for loss in of_kind if not loss.is_safe), default=None)
        times = sorted(loss.safe_ms for loss in of_kind if loss.safe_ms is not None)
        span = f"{times[len(times) // 2]:.1f}, {times[-1]:.1f} max" if times else "never"
        lines.append(f"{name:74}{'none' if window is None else f'{window:g}':>10} {span:>15}")
    return "\n".join(lines)


@contextlib.contextmanager
def load(count: int) -> Iterator[None]:
    """Runs `count` processes that compute for the duration of the block."""
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.wait()


def main() -> None:
    """Measures all kinds."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--times", type=int, default=3)
    parser.add_argument("--load", type=int, default=0, help="processes that compute beside it")
    parser.add_argument("--guards", type=int, choices=(1, 2), help="how many guard processes are lost")
    given = parser.parse_args()
    leftovers.enter_alone([__file__, *sys.argv[1:]])
    found: list[Loss] = []
    with contextlib.suppress(KeyboardInterrupt), load(given.load):
        for kind in (kind for kind in kinds() if given.guards in (None, kind.guards)):
            found += [lose(kind, span_ms) for span_ms in SPANS_MS for _ in range(given.times)]
            print(table(found[-len(SPANS_MS) * given.times :]), flush=True)
    print(table(found))
    OUT.parent.mkdir(exist_ok=True)
    OUT.write_text(json.dumps([asdict(loss) for loss in found], indent=1))
    one = {kind.name for kind in kinds() if kind.guards == 1}
    sys.exit(1 if any(loss.kind in one and not loss.is_safe for loss in found) else 0)


if __name__ == "__main__":
    main()
