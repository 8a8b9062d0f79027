# SPDX-License-Identifier: Apache-2.0
"""Checks of a change during development: lints, and tests of the crates that changed and of the Python that depends on them.

    python tests/fast.py                what differs from the last commit, or the last commit if nothing does
    python tests/fast.py supervisor     these crates

`make test` checks a change before it is handed over: every mapping, every page, the browser, long and rare tests.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).parent.parent
LINTED = ("--config", 'build.rustc-workspace-wrapper="clippy-driver"')
CARGO = ("-p", "bindings", "--features", "bindings/hosts", "--profile", "checked", "--quiet", *LINTED)
"""With `bindings` every crate has the features with which it was built for the package, and its compiler: nothing is rebuilt."""

SUITE = ["tests/python/conformance"]
IN_VIRTUAL_TIME = "not threads and not processes and not shared and not mixture and not real"

STANDS_ON = {
    "library": ["tests/python/library"],
    "hosts": ["tests/python/hosts/test_two_hosts.py", "tests/python/hosts/test_join_refused.py"],
    "places": ["tests/python/elsewhere/test_values.py", "tests/python/elsewhere/test_lost.py"],
    "process-kit": ["tests/python/test_guarded_program.py", "tests/python/elsewhere/test_lost.py"],
    "rtp": ["tests/python/elsewhere/test_values.py", "tests/python/elsewhere/test_lost.py"],
    "runtime": ["tests/python/test_writers.py", "tests/python/elsewhere/test_values.py"],
    "device": ["tests/python/test_plant_process.py"],
    "guard": ["tests/python/test_guarded_program.py", "tests/python/elsewhere/test_lost.py"],
    "scheduling": ["tests/python/test_guarded_program.py"],
    "shared-memory": ["tests/python/elsewhere/test_values.py", "tests/python/elsewhere/test_closing.py"],
    "api": ["tests/python/remote/test_calls.py", "tests/python/remote/test_answers.py"],
    "daemon": ["tests/python/test_daemon.py", "tests/python/test_command.py"],
    "control": ["tests/python/remote/test_calls.py", "tests/python/studio/test_calls.py"],
    "drivers": ["tests/python/test_plant_process.py"],
    "recorder": ["tests/python/test_recording.py"],
    "mcap": ["tests/python/test_recording.py"],
    "replay": ["tests/python/test_replay.py"],
    "modules": ["tests/python/test_containment.py", "tests/python/test_trials.py"],
    "block": ["tests/python/test_containment.py", "tests/python/test_trials.py"],
    "model": ["tests/python/definitions", "tests/python/test_bad_input.py"],
    "supervisor": ["tests/python/cell"],
    "kernel": ["tests/python/test_writers.py", "tests/python/test_exchange.py"],
}
"""Crate → the Python tests that depend on it, besides the suite in virtual time; other crates have the suite only."""


def changed() -> list[str]:
    """Returns the files that differ from the last commit; the files of the last commit if none does."""
    now = _git("diff", "--name-only", "HEAD") + _git("ls-files", "--others", "--exclude-standard")
    return now or _git("diff", "--name-only", "HEAD~1", "HEAD")


def _git(*words: str) -> list[str]:
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()


def crates_of(files: Iterable[str]) -> list[str]:
    """Returns the folders of the crates that contain the files."""
    found = {parts[1] for parts in (Path(file).parts for file in files) if parts[0] == "crates" and len(parts) > 2}
    return sorted(crate for crate in found if (ROOT / "crates" / crate / "Cargo.toml").is_file())


def package_of(crate: str) -> str:
    """Returns the name of a crate in its Cargo.toml, which is that of its folder except for a few."""
    lines = (ROOT / "crates" / crate / "Cargo.toml").read_text().splitlines()
    return next(line.split('"')[1] for line in lines if line.startswith("name = "))


def commands(crates: list[str], files: list[str]) -> list[list[str]]:
    """Returns the commands to run, the quickest first."""
    python = [file for file in files if file.endswith((".py", ".pyi")) and (ROOT / file).exists()]
    checked = [file for file in python if file.startswith(("python/", "examples/", "bench/"))]
    tests = [file for file in python if Path(file).name.startswith("test_")]
    packages = [word for crate in crates for word in ("-p", package_of(crate))]
    on_them = dict.fromkeys(path for crate in crates for path in STANDS_ON.get(crate, []))
    found: list[list[str]] = [["cargo", "fmt", "--all", "--check"], ["ruff", "check", "python", "tests", "examples", "bench", "packaging"]]
    if checked:
        found.append(["pyright", *checked])
    if packages:
        test = ["cargo", "test", *packages, *CARGO, "--tests"]
        found += [["python", "tests/lints.py", *test, "--no-run"], test]
    if tests or on_them:
        found.append(["pytest", "-q", *dict.fromkeys([*tests, *on_them])])
    if packages or checked:
        found.append(["pytest", "-q", *SUITE, "-k", IN_VIRTUAL_TIME])
    if any(file.startswith("studio/") for file in files):
        found.append(["npm", "--prefix", "studio", "run", "--silent", "check"])
    return found


def main() -> None:
    """Runs the command."""
    crates = sys.argv[1:]
    for crate in crates:
        if not (ROOT / "crates" / crate / "Cargo.toml").is_file():
            sys.exit(f"there is no crate '{crate}': {', '.join(sorted(path.parent.name for path in ROOT.glob('crates/*/Cargo.toml')))}")
    files = [] if crates else changed()
    begin = time.monotonic()
    for command in commands(crates or crates_of(files), files):
        if command[0] in ("python", "pytest", "ruff", "pyright"):
            command = [str(Path(sys.executable).parent / command[0]), *command[1:]]
        if Path(command[0]).name == "pytest":
            command = [*command, "-n", "3"]
        print("$", " ".join([Path(command[0]).name, *command[1:]]), flush=True)
        ended = subprocess.run(command, cwd=ROOT)
        if ended.returncode not in (0, 5 if "pytest" in command[0] else 0):
            sys.exit(f"failed after {time.monotonic() - begin:.0f} s")
    print(f"all well after {time.monotonic() - begin:.0f} s")


if __name__ == "__main__":
    main()
