# SPDX-License-Identifier: Apache-2.0
"""Tries a wheel as a user with neither Rust nor Node would: creates an environment, installs with pip, and moves an arm.

    python packaging/try_wheel.py WHEEL [--at-most SECONDS] [--virtual] [--c]

The time is counted from `pip install`, including downloads, until the arm is at its goal. The dependencies come from the package
index. With --virtual the arm only moves under the virtual clock: an emulated processor is too slow for real time. With --c a block in
C is built too, by the compiler that the extra of this name installs.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
import venv
from pathlib import Path

HERE = Path(__file__).parent

ARM = """\
import sys
import opengpac as gpac
cell = gpac.System("line", clock=sys.argv[1])
arm = gpac.robots.load("ur5e").enable()
goal = gpac.deg([10, -80, 80, -90, -90, 10])
arrived = gpac.robots.move(arm, goal=goal, speed=2.0)
assert abs(arrived.position - goal).max() < 0.01, arrived.position
"""

REST = """\
import os, pathlib, shutil, urllib.request
import opengpac as gpac
from opengpac import _native, activate, library, on

assert not any(map(shutil.which, ("cargo", "rustc", "node", "npm"))), os.environ["PATH"]
home = pathlib.Path(gpac.__file__).parent
assert "site-packages" in str(home), home
assert (home / "include" / "opengpac.h").read_text() == _native.header_text()
assert (home / "include" / "opengpac_driver.h").read_text() == _native.driver_header_text()

with gpac.System("line", progress=False) as cell:
    # A separate process that the guard watches: both are programs of the wheel.
    there = cell.processor("there", process=True).timer("fast", period="5 ms", priority=50)
    brief = gpac.Verb(
        "brief",
        blocks={"clock": library.time_limit},
        input_parameters={"seconds": "clock.limit"},
        command_lists={"start": [activate("clock", every="5 ms")]},
        conditions={"over": on("clock.expired")},
    )
    try:
        brief.on(there)(seconds=0.05)
    except gpac.Terminated as end:
        assert "'over'" in str(end), end
    page = cell.studio().url.split("#")[0]
    with urllib.request.urlopen(page) as answer:
        assert answer.status == 200 and b"<html" in answer.read().lower()
print("processor, guard, page and header are there")
"""

BLOCK = """\
import opengpac as gpac
from pathlib import Path
Path("twice.c").write_text(
    '#include <opengpac.h>\\n'
    'FUNCTION_BLOCK(twice, "Twice its input.", in(double, u, "input"), out(double, y, "twice as much"))\\n'
    '{ self->y = 2 * self->u; return OK; }\\n'
)
with gpac.System("line", clock="virtual") as cell:
    assert cell.download("twice.c").twice.run(u=[1.0, 2.0]).y.tolist() == [2.0, 4.0]
print("a block in C was built by the compiler of the extra")
"""


def tried(wheel: Path, folder: Path, virtual: bool, in_c: bool) -> float:
    """Returns the seconds from `pip install` until an arm has arrived; exits with an error if a step fails."""
    new = folder / "new"
    venv.create(new, with_pip=True)
    # Only the new environment is on the path: no compiler, no Rust, no Node, no checkout.
    kept = {name: value for name, value in os.environ.items() if name.startswith(("PIP_", "SSL_"))}
    clean = {**kept, "HOME": str(folder), "PATH": str(new / "bin")}

    def run(*words: str) -> None:
        ended = subprocess.run([str(new / "bin" / "python"), *words], env=clean, cwd=folder)
        if ended.returncode != 0:
            sys.exit(f"{' '.join(words)[:60]} … ended with {ended.returncode}")

    begin = time.monotonic()
    install = ("-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-c", str(HERE / "constraints.txt"))
    run(*install, f"{wheel}[mujoco]")
    run("-c", ARM, "virtual" if virtual else "monotonic")
    seconds = time.monotonic() - begin
    if not virtual:
        run("-c", REST)
    if in_c:
        run(*install, f"{wheel}[c]")
        run("-c", BLOCK)
    return seconds


def main() -> None:
    """Runs the command."""
    given = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    given.add_argument("wheel", type=Path)
    given.add_argument("--at-most", type=float, metavar="SECONDS", help="fail if it takes longer")
    given.add_argument("--virtual", action="store_true", help="run only on the virtual clock")
    given.add_argument("--c", action="store_true", help="also build a block in C, without a compiler of the machine")
    options = given.parse_args()
    with tempfile.TemporaryDirectory(prefix="opengpac-wheel-") as folder:
        seconds = tried(options.wheel.resolve(), Path(folder), options.virtual, options.c)
    print(f"{options.wheel.name}: the arm arrived {seconds:.1f} s after pip install began")
    if options.at_most is not None and seconds > options.at_most:
        sys.exit(f"this exceeds the limit of {options.at_most:g} s")


if __name__ == "__main__":
    main()
