# SPDX-License-Identifier: Apache-2.0
"""Broken drivers in Python: one good class with one defect each. Each is rejected by the intended check, with its cause.

A third of them is tried each day; `OPENGPAC_BROKEN_DRIVERS=all` tries all. Those in C are in
`crates/drivers/tests/conformance/faulty.rs`.
"""

from __future__ import annotations

import datetime
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from opengpac.drivers import conformance

GOOD = '''
import math, os, signal, sys, threading
from opengpac.driver import Driver, counter, part, read, write

KEPT = []

class Pump(Driver):
    """A pump."""
    flow = read("double", unit="m3/s")
    parts = read("float[2]")
    state = read("int16_t")
    speed = write("double", unit="rad/s")
    level = write("int16_t")
    lamp = write("bool")
    exchanges = counter("exchanges so far")
    arm = part(speed_max=2.0)
    belt = part(unit="m", command="effort", effort_max=10.0)

    def open(self):
        self.log = open(os.devnull, "w")
        self.seen = 0

    def exchange(self):
        if not math.isfinite(self.speed) or abs(self.speed) > 1e6:
            raise ValueError(f"speed {self.speed} is beyond the pump")
        self.seen += 1
        self.exchanges += 1
        self.flow = 0.1 * self.speed
        self.parts = [1.0, 2.0]
        self.state = 1
        self.arm.velocity = 0.0
        if self.arm.engaged and math.isfinite(self.arm.goal) and abs(self.arm.goal) < 10:
            self.arm.velocity = (self.arm.goal - self.arm.position) / 0.01
            self.arm.position = self.arm.goal
        push = max(-1.0, min(1.0, self.belt.effort)) if self.belt.engaged and math.isfinite(self.belt.effort) else 0.0
        self.belt.velocity = push
        self.belt.position += 0.01 * push

    def safe_state(self):
        self.log.flush()

    def close(self):
        self.log.close()
'''
SEEN = "        self.seen += 1\n"
CHECK = "        if not math.isfinite(self.speed) or abs(self.speed) > 1e6:\n"
SAFE = "        self.log.flush()\n"
CLOSE = "        self.log.close()\n"
OPEN = "        self.seen = 0\n"

BROKEN = {
    "open raises": (OPEN, OPEN + "        raise OSError('no such port')\n", "class-life", "open() raises OSError: no such port"),
    "exchange raises": (SEEN, "        raise KeyError('speed')\n", "class-life", "exchange() raises KeyError"),
    "safe state raises": (SAFE, "        self.valve.shut()\n", "class-life", "safe_state() raises AttributeError"),
    "safe state raises late": (SAFE, "        if self.seen > 5: 1 / 0\n", "class-life", "safe_state() raises ZeroDivisionError"),
    "close raises": (CLOSE, "        self.port.close()\n", "class-life", "close() raises AttributeError"),
    "reading is a text": ("= 0.1 * self.speed", "= 'fast'", "class-life", "channel 'flow' (double) cannot hold 'fast'"),
    "reading is None": ("= 0.1 * self.speed", "= None", "class-life", "channel 'flow' (double) cannot hold None"),
    "reading too wide": ("self.state = 1", "self.state = 40000", "class-life", "channel 'state' (int16_t) cannot hold 40000"),
    "array too long": ("[1.0, 2.0]", "[1.0, 2.0, 3.0]", "class-life", "channel 'parts' (float[2]) cannot hold"),
    "array too short": ("[1.0, 2.0]", "[1.0]", "class-life", "channel 'parts' (float[2]) cannot hold"),
    "first reading not a number": ("= 0.1 * self.speed", "= math.nan", "class-life", "reading 'flow' is nan after 1 exchanges"),
    "infinite reading": ("= 0.1 * self.speed", "= math.inf", "class-life", "reading 'flow' is inf"),
    "element not a number": ("[1.0, 2.0]", "[1.0, math.nan]", "class-life", "reading 'parts' is [1.0, nan]"),
    "late not a number": (
        "= 0.1 * self.speed",
        "= math.nan if self.seen > 200 else 0.0",
        "class-readings",
        "reading 'flow' is nan after 201",
    ),
    "late infinity": ("= 0.1 * self.speed", "= math.inf if self.seen > 300 else 0.0", "class-readings", "reading 'flow' is inf after 301"),
    "late exception": (
        SEEN,
        SEEN + "        if self.seen > 250: raise OSError('gone')\n",
        "class-readings",
        "OSError: gone at exchange 251",
    ),
    "overflows late": ("self.state = 1", "self.state = self.seen * 100", "class-readings", "channel 'state' (int16_t) cannot hold 32800"),
    "prints": (SEEN, SEEN + "        print('reading', self.seen)\n", "class-prints", "bytes in 20 exchanges"),
    "prints to standard error": (SEEN, SEEN + "        os.write(2, b'reading')\n", "class-prints", "it prints 140 bytes in 20"),
    "counter falls": (
        "self.exchanges += 1",
        "self.exchanges = self.seen % 50",
        "class-counters",
        "counter 'exchanges' decreases from 49 to 0",
    ),
    "counter below 0": ("self.exchanges += 1", "self.exchanges -= 1", "class-counters", "counter 'exchanges' decreases from 0 to -1"),
    "counter starts anew": (SEEN, SEEN + "        if self.seen == 99: self.exchanges = 0\n", "class-counters", "decreases from 98 to 1"),
    "not a number goes through": (
        CHECK,
        "        if math.isinf(self.speed):\n",
        "class-values",
        "'speed' that is not a number sets reading 'flow' to nan",
    ),
    "infinity goes through": (
        CHECK,
        "        if math.isnan(self.speed):\n",
        "class-values",
        "'speed' that is infinite sets reading 'flow' to inf",
    ),
    "minus infinity goes through": (
        CHECK,
        "        if math.isnan(self.speed) or self.speed == math.inf:\n",
        "class-values",
        "that is minus infinite",
    ),
    "safe state raises behind a refusal": (
        CHECK,
        CHECK + "            self.log = None\n",
        "class-values",
        "safe_state() raises AttributeError",
    ),
    "descriptor per exchange": (SEEN, SEEN + "        os.dup(2)\n", "class-descriptors", "exchanges leak 600 descriptors"),
    "descriptor per life": (OPEN, OPEN + "        os.dup(2)\n", "class-descriptors", "5 restarts leak 5 descriptors"),
    "thread per exchange": (
        SEEN,
        SEEN + "        if self.seen % 50 == 0: threading.Thread(target=threading.Event().wait, daemon=True).start()\n",
        "class-threads",
        " threads",
    ),
    "thread per life": (
        OPEN,
        OPEN + "        threading.Thread(target=threading.Event().wait, daemon=True).start()\n",
        "class-threads",
        "5 restarts leak 5 threads",
    ),
    "list grows": (SEEN, SEEN + "        KEPT.append(float(self.seen))\n", "class-memory", " bytes"),
    "buffers grow": (SEEN, SEEN + "        KEPT.append(bytearray(100))\n", "class-memory", " bytes"),
    "table grows": (
        SEEN,
        SEEN + "        self.__dict__.setdefault('past', {})[self.seen] = str(self.seen)\n",
        "class-memory",
        " bytes",
    ),
}


BROKEN |= {
    "exits": (SEEN, SEEN + "        sys.exit(3)\n", "class-life", "exchange() raises SystemExit: 3"),
    "exits as it is opened": (OPEN, OPEN + "        sys.exit('no port')\n", "class-life", "open() raises SystemExit: no port"),
    "recursion": (SEEN, SEEN + "        self.exchange()\n", "class-life", "exchange() raises RecursionError"),
    "no exchange": ("    def exchange(self):\n", "    def exchanges_with(self):\n", "class-life", "exchange() raises NotImplementedError"),
    "age of a text": (SEEN, "        self.seen += 1; return 'now'\n", "class-life", "exchange() cannot return 'now'"),
    "age below 0": (SEEN, "        self.seen += 1; return -0.5\n", "class-life", "exchange() cannot return -0.5"),
    "computes for long": (
        SEEN,
        SEEN + "        for _ in range(2_000_000): pass\n",
        "class-brief",
        "ms of computing time; wait for the machine with a blocking call",
    ),
    "changes the folder": (OPEN, OPEN + "        os.chdir('/')\n", "class-kept", "open() changes the working directory"),
    "changes the environment": (
        SEEN,
        SEEN + "        os.environ['TZ'] = str(self.seen)\n",
        "class-kept",
        "exchange() changes the environment",
    ),
    "changes the file mask": (SAFE, SAFE + "        os.umask(0o377)\n", "class-kept", "safe_state() changes the file mask"),
    "takes over a signal": (
        OPEN,
        OPEN + "        signal.signal(signal.SIGTERM, lambda *_: None)\n",
        "class-kept",
        "open() changes a signal handler",
    ),
    "part ignores its goal": (
        "            self.arm.position = self.arm.goal\n",
        "            pass\n",
        "class-parts",
        "'arm' does not change when it is commanded to move in either direction",
    ),
    "part ignores its effort": (
        "            self.belt.position += 0.01 * push\n"[4:],
        "        pass\n",
        "class-parts",
        "'belt' does not change when",
    ),
    "part goes the wrong way": (
        "self.belt.position += 0.01 * push",
        "self.belt.position -= 0.01 * push",
        "class-parts",
        "'belt' changes by -0.1",
    ),
    "velocity of the wrong sign": ("self.belt.velocity = push", "self.belt.velocity = -push", "class-parts", "while its velocity is -0.5"),
    "velocity always 0": ("self.belt.velocity = push", "self.belt.velocity = 0.0", "class-parts", "while its velocity is 0"),
    "part creeps": (
        "else 0.0\n        self.belt.velocity",
        "else 0.3\n        self.belt.velocity",
        "class-parts",
        "without a command",
    ),
    "position frozen late": (
        "self.belt.position += 0.01 * push",
        "self.belt.position += 0.01 * push if self.seen < 40 else 0.0",
        "class-parts",
        "'belt' does not change when",
    ),
    "raises when it is pushed": (
        "        push = max",
        "        if 0.1 < self.belt.effort < 1: raise OSError('over-current')\n        push = max",
        "class-parts",
        "exchange() raises OSError: over-current while part 'belt' is commanded to move slightly",
    ),
    "process per exchange": (
        SEEN,
        SEEN + "        if self.seen % 100 == 0: os.posix_spawnp('true', ['true'], os.environ)\n",
        "class-processes",
        " processes",
    ),
    "process per life": (
        OPEN,
        OPEN + "        os.posix_spawnp('true', ['true'], os.environ)\n",
        "class-processes",
        "5 restarts leak 5 processes",
    ),
}


def outcomes(folder: Path, source: str) -> list[dict[str, Any]]:
    """Returns the results of the checks of a class in this source."""
    (folder / "pump.py").write_text(source)
    given = json.dumps({"path": str(folder / "pump.py")})
    command = [sys.executable, "-m", "opengpac.drivers.class_checks"]
    done = subprocess.run(command, input=given, capture_output=True, text=True, check=True)
    return [json.loads(line) for line in done.stdout.splitlines()]


def test_the_good_class_passes(tmp_path: Path) -> None:
    assert [each["why"] for each in outcomes(tmp_path, GOOD)] == [""] * 12


SHARES = 1 if os.environ.get("OPENGPAC_BROKEN_DRIVERS") == "all" else 3
"""Number of shares of the list, one of which is tried each day."""
DAY = int(os.environ.get("OPENGPAC_SEED", datetime.date.today().toordinal()))


@pytest.mark.parametrize("name", [*BROKEN][DAY % SHARES :: SHARES])
def test_a_broken_class_is_rejected_with_its_cause(name: str, tmp_path: Path) -> None:
    right, wrong, check, cause = BROKEN[name]
    assert right in GOOD
    *passed, last = outcomes(tmp_path, GOOD.replace(right, wrong, 1))
    assert all(each["verdict"] == "passed" for each in passed)
    assert (last["check"], last["verdict"]) == (check, "failed"), last
    assert cause in last["why"], last["why"]
    assert "\n" not in last["why"]


ENDING = {
    "exits at once": ("        os._exit(3)\n", "its process exited with status 3"),
    "aborts": ("        os.abort()\n", "its process exited with status -6"),
    "waits for ever": ("        threading.Event().wait()\n", "it did not return within 15 s"),
}


@pytest.mark.parametrize("name", [*ENDING][DAY % SHARES :: SHARES])
def test_a_class_that_ends_its_process_or_hangs_is_told(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    wrong, cause = ENDING[name]
    monkeypatch.setattr(conformance, "CLASS_S", 15.0)
    (tmp_path / "pump.py").write_text(GOOD.replace(SEEN, SEEN + wrong, 1))
    report = conformance.check(gpac.drivers.python(tmp_path / "pump.py"), exchanges=200)
    (only,) = report["checks"]
    assert (only["check"], only["verdict"], only["why"]) == ("class-life", "failed", cause)
