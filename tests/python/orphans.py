# SPDX-License-Identifier: Apache-2.0
"""A system whose servo and another block run in a process of its own, which outlives it: as a program that is killed, and for the test.

python orphans.py SYSTEM MODULES does SECOND

`does`: `begins` creates the system; `adopts` creates it again over the running process; `takes` takes command of that. The program
prints a line at each step, and begins when it reads a line; then it waits to be killed. `SECOND` places a second processor: empty for
none, `own` for a process of its own, otherwise the name of a process that both share.
"""

from __future__ import annotations

import json
import os
import signal
import struct
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import opengpac as gpac
from afar import children, until
from daemons import environment
from opengpac import _native, activate, library, motion
from opengpac.robots import Joint

HOLDS = 0.5
"""Position in which the first program leaves the joint."""

LEVEL = 7.0
"""Value that the first program keeps."""

HOLD_ERROR = 0.01
"""Maximum distance of the joint from its set-point: as a velocity drive with a proportional servo it stays far below."""


class Cell:
    """System, created or adopted: the joint `axis`, held by its servo, and verbs that continue when their program is cut off."""

    def __init__(self, name: str, modules: dict[str, str], adopt: bool = False, second: str = "", **changes: Any) -> None:
        self.system = gpac.System(name, progress=False, adopt=adopt)
        self.system.processor("rtp0")
        shared = second not in ("", "own")
        self.rtp1 = self.system.processor("rtp1", process=second if shared else True)
        self.after = self.system.processor("rtp2", process=second if shared else True).software("after", priority=50) if second else None
        self.fast = self.rtp1.timer("fast", period="1 ms", priority=80)
        self.slow = self.rtp1.timer("slow", period="20 ms", priority=60)
        options = {"step": "1 ms", "linger": "10 s", **changes}
        driver = gpac.drivers.plant_process(gpac.drivers.loopback("x"), name=name, **options)
        drives = self.rtp1.physical_device("drives", driver, exchange=self.fast)
        self.joint = Joint("axis", drive=drives["x"], on=self.fast, kp=20.0, kd=0.0, max_following_error=0.5)
        self.modules = modules
        self.level = self.system.svv("level")

    def keeping(self, level: float) -> gpac.VerbInstance[Any]:
        """Keeps the SVV `level` at the given value."""
        verb = gpac.Verb(
            "keeping",
            blocks={"kept": library.signal_generator(amplitude=0.0)},
            instantiation_parameters={"y": "kept.y"},
            input_parameters={"level": "kept.offset"},
            command_lists={"start": [activate("kept", every="2 ms")]},
            if_cut_off="continue",
        )
        return verb.on(self.fast).asynch(self.level, level=level)

    def chain(self) -> gpac.VerbInstance[Any]:
        """Counts on the first processor, and doubles each number on the second."""
        assert self.after is not None
        count = self.system.download(self.modules["count"], "count")["count"]
        verb = gpac.Verb(
            "chain",
            blocks={"count": count, "twice": library.gain(k=2.0)},
            instantiation_parameters={"numbers": ["count.y", "twice.u"], "doubled": "twice.y"},
            command_lists={"start": [activate("twice"), activate("count", every="2 ms")]},
            if_cut_off="continue",
        )
        self.doubled = self.system.svv("doubled", history=200)
        return verb.on({"count": self.fast, "twice": self.after}).asynch(self.system.svv("numbers"), self.doubled)

    def counting(self) -> gpac.VerbInstance[Any]:
        """Starts the same verb and instance name with another block."""
        count = self.system.download(self.modules["count"], "count")["count"]
        verb = gpac.Verb(
            "keeping",
            blocks={"kept": count},
            instantiation_parameters={"y": "kept.y"},
            command_lists={"start": [activate("kept", every="2 ms")]},
        )
        return verb.on(self.fast).asynch(self.level)

    def goes(self, to: float) -> None:
        """Moves the joint."""
        motion.move_absolute(self.joint, to, time_limit="60 s")


class Orphaned:
    """Programs that are killed one after the other, and the processes that continue to run."""

    def __init__(self, name: str, modules: dict[str, str], second: str = "") -> None:
        self.name = name
        self.second = second
        self.modules = modules
        self.programs: list[subprocess.Popen[str]] = []
        self.process = 0
        """Process of `rtp1`."""
        self.others: list[int] = []
        """Processes of other processors."""
        self.guards: list[int] = []
        self.positions: list[float] = []

    def program(self, does: str) -> subprocess.Popen[str]:
        """Returns a program that is ready to begin: it has loaded its modules."""
        made = subprocess.Popen(
            [sys.executable, __file__, self.name, json.dumps(self.modules), does, self.second],
            env=environment(PYTHONPATH=os.pathsep.join([str(Path(__file__).parent), environment()["PYTHONPATH"]])),
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        self.programs.append(made)
        assert line(made) == "ready"
        return made

    def begin(self) -> subprocess.Popen[str]:
        """Starts the first program, which holds the joint."""
        made = self.program("begins")
        go(made, "begins")
        (self.process, *self.others), self.guards = children("run_processor", made.pid), children("run_guard", made.pid)
        return made

    def kill(self, program: subprocess.Popen[str]) -> None:
        """Kills a program. Its children hold its output, so its end of file never comes."""
        program.send_signal(signal.SIGKILL)
        program.wait(60)
        for pipe in (program.stdin, program.stdout):
            assert pipe is not None
            pipe.close()

    def cell(self, **changes: Any) -> Cell:
        """Returns the same system, adopting the running process."""
        return Cell(self.name, self.modules, adopt=True, second=self.second, **changes)

    def there(self) -> dict[str, Any]:
        """Returns the state of the plant; empty if it has ended."""
        text = _native.plant_state(self.name)
        return {} if text is None else json.loads(text)

    def is_safe(self) -> bool:
        """Returns whether the guard has made the outputs safe."""
        return bool(self.there().get("is_safe"))

    def look(self) -> float:
        """Returns the position of the joint; checks that its outputs have never been made safe."""
        state = self.there()
        assert state, "there is a plant"
        assert not state["is_safe"], "the guard has not acted"
        self.positions.append(struct.unpack_from("d", bytes(state["readings"]))[0])
        return self.positions[-1]

    def held(self, at: float = HOLDS, looks: int = 20) -> bool:
        """Returns whether the joint stands still, in many samples."""
        return all(abs(self.look() - at) < HOLD_ERROR for _ in range(looks))

    def sockets(self) -> list[str]:
        """Returns the remaining sockets of the system in the user's folder."""
        folder = Path(os.environ.get("XDG_RUNTIME_DIR", "/nowhere"))
        folder = folder / "opengpac" if folder.is_dir() else Path(f"/tmp/opengpac-{os.getuid()}")
        return [path.name for path in folder.iterdir() if path.name.endswith(f"-{self.process}") or path.name == f"plant-{self.name}"]

    def close(self) -> None:
        """Kills the programs; checks that nothing is left over."""
        for program in self.programs:
            if program.poll() is None:
                self.kill(program)


def line(program: subprocess.Popen[str]) -> str:
    """Returns the next line that a program prints."""
    assert program.stdout is not None
    return program.stdout.readline().strip()


def go(program: subprocess.Popen[str], does: str) -> None:
    """Lets the program begin, and waits until it has done so."""
    assert program.stdin is not None
    program.stdin.write("go\n")
    program.stdin.flush()
    assert line(program) == does


def lives(pid: int) -> bool:
    """Returns whether a process exists and has not ended."""
    try:
        return (Path("/proc") / str(pid) / "stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def main(name: str, modules: str, does: str, second: str) -> None:
    """Prints that it is ready, waits for a line, performs its step, and waits to be killed."""
    print("ready", flush=True)
    sys.stdin.readline()
    cell = Cell(name, json.loads(modules), adopt=does != "begins", second=second)
    cell.joint.enable()
    cell.keeping(LEVEL if does == "begins" else 1.0)
    if second:
        cell.chain()
    if does == "begins":
        cell.goes(HOLDS)
        until(lambda: cell.level.value == LEVEL, "it is kept")
    if does == "takes":
        cell.system.take_over()
    print(does, flush=True)
    while True:
        time.sleep(60)


if __name__ == "__main__":
    main(*sys.argv[1:])
