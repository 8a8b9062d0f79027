# SPDX-License-Identifier: Apache-2.0
"""`opengpac driver check`: checks whether a driver conforms to the driver interface."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from rich.console import Console

from .. import _native
from ..errors import CallError, Error, refusals, refuse
from ..system import processes
from . import class_checks
from .driver import Driver
from .in_python import python
from .loading import load


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Adds the command `driver`."""
    driver = commands.add_parser("driver", help="check drivers of machines").add_subparsers(required=True, metavar="WHAT")
    check = driver.add_parser("check", help="run the conformance kit on a driver; a file is compiled first")
    check.add_argument("driver", metavar="NAME|FILE", help="name of a driver, C source, Python file, shared object or folder")
    check.add_argument("options", nargs="*", metavar="OPTION=VALUE", help="options of the driver for the checks")
    check.add_argument(
        "--exchanges", type=int, default=1_000_000, help="maximum number of exchanges in the check of memory (default: 1000000)"
    )
    check.add_argument(
        "--machine-is-safe",
        action="store_true",
        help="send extreme commands without asking, since no machine is connected or nothing can move",
    )
    check.add_argument("--all", action="store_true", help="continue after a failed check")
    check.add_argument("-v", "--verbose", action="store_true", help="also list passed checks")
    check.add_argument("--json", action="store_true", help="print the report as JSON")
    check.set_defaults(run=run)


def run(given: argparse.Namespace) -> int:
    """Runs the checks and prints the reports; returns 1 if a check failed."""
    options = dict(_option(text) for text in given.options)
    drivers = [*_drivers(given.driver, options)]
    if not given.machine_is_safe:
        for driver in drivers:
            _ask(driver)
    reports = []
    with Console(stderr=True).status("checking") as status:
        for driver in drivers:

            def goes_on(name: str, verdict: str, kind: str = driver.kind) -> bool:
                status.update(f"{kind}: {name} {verdict}")
                return given.all or verdict != "failed"

            reports.append(check(driver, exchanges=given.exchanges, goes_on=goes_on))
    if given.json:
        print(json.dumps(reports))
    else:
        for report in reports:
            print(shown(report, given.verbose))
        if not given.all and not all(report["passed"] for report in reports):
            print("Stops at the first failed check, unless --all is set.", file=sys.stderr)
    return 0 if all(report["passed"] for report in reports) else 1


def check(
    driver: Driver, *, exchanges: int = 1_000_000, goes_on: Callable[[str, str], bool] = lambda _check, _verdict: True
) -> dict[str, Any]:
    """Returns the test kit's report on a driver: {"driver", "passed", "checks": [{"check", "sentence", "verdict", "why"}], "text"}.

    `goes_on` is called with the name and the verdict of each finished check, and stops the checks by returning False. For a driver in
    Python, the checks on its class always stop at the first failure.
    """
    of_class = _of_class(driver, goes_on) if driver.kind == "python" else []
    if any(each["verdict"] == "failed" for each in of_class):
        return _report(driver.kind, of_class)
    with tempfile.TemporaryDirectory() as folder:
        counting = _counting(Path(folder))
        started = processes.command_with_package if driver.kind == "python" else processes.command
        command = started("run_driver_check")
        with refusals:
            sanitizer = _native.sanitizer_in(folder)
            options = json.dumps(dict(driver.options))
            report = json.loads(_native.check_conformance(driver.kind, options, command, exchanges, counting, sanitizer, goes_on))
    return _report(report["driver"], of_class + report["checks"]) if of_class else report


def shown(report: Mapping[str, Any], verbose: bool) -> str:
    """Returns a human-readable report: the failures with their reasons, and with `verbose` each check."""
    lines = report["text"].splitlines()
    return "\n".join(line for line in lines if verbose or not line.startswith(("passed ", "- ")))


SIMULATED = ("loopback", "mujoco", "scripted")
"""Drivers that do not move a machine."""
CLASS_S = 50.0
"""Time limit of one check of a class, so that a hang is reported within a minute."""


def _ask(driver: Driver) -> None:
    """Asks the user for permission to send extreme commands. Refuses if there is no terminal or the user declines."""
    if driver.kind in SIMULATED:
        return
    what = "the kit sends infinite, extreme and absurd commands to any machine that is connected with these options"
    if sys.stdin.isatty():
        print(f"{what}.\nIs it certain that no machine is connected or that nothing can move? [y/N] ", end="", file=sys.stderr, flush=True)
        if sys.stdin.readline().strip().lower() in ("y", "yes"):
            return
    refuse(CallError, f"driver '{driver.kind}' was not checked: {what}", "disconnect or secure the machine, then pass --machine-is-safe")


def _of_class(driver: Driver, goes_on: Callable[[str, str], bool]) -> list[dict[str, Any]]:
    """Checks the class of a driver in Python directly, until the first failure."""
    given = {name: driver.options[name] for name in ("path", "module", "class", "options", "paths") if driver.options.get(name) is not None}
    command = [sys.executable, "-m", "opengpac.drivers.class_checks"]
    outcomes: list[dict[str, Any]] = []
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None and process.stdout is not None
        process.stdin.write(json.dumps(given))
        process.stdin.close()
        for name, sentence in class_checks.SENTENCES.items():
            limit = threading.Timer(CLASS_S, process.kill)
            limit.start()
            line = process.stdout.readline()
            is_late = not limit.is_alive()
            limit.cancel()
            why = ""
            if not line:
                why = f"it did not return within {CLASS_S:.0f} s" if is_late else f"its process exited with status {process.wait()}"
            outcome = {"check": name, "sentence": sentence, "verdict": "failed", "why": why} if why else json.loads(line)
            outcomes.append(outcome)
            if not goes_on(name, outcome["verdict"]) or outcome["verdict"] == "failed":
                process.kill()
                break
    return outcomes


def _report(driver: str, checks: list[dict[str, Any]]) -> dict[str, Any]:
    """Returns a report of these checks, in the format of the compiled core."""
    words = {"passed": "passed", "failed": "FAILED", "not applicable": "-"}
    lines = []
    for each in checks:
        why = {"passed": "", "failed": f": {each['why']}", "not applicable": f" ({each['why']})"}[each["verdict"]]
        lines.append(f"{words[each['verdict']]:<7} {each['check']:<28} {each['sentence']}{why}")
    counts = [sum(each["verdict"] == verdict for each in checks) for verdict in words]
    lines.append(f"driver '{driver}': {counts[0]} passed, {counts[1]} failed, {counts[2]} not applicable")
    return {"driver": driver, "passed": counts[1] == 0, "checks": checks, "text": "\n".join(lines)}


def _drivers(name: str, options: Mapping[str, Any]) -> Iterator[Driver]:
    if Path(name).suffix == "" and not Path(name).is_dir():
        yield Driver(name, dict(options))
        return
    if Path(name).suffix == ".py":
        yield python(name, **options)
        return
    loaded = load(name)
    for kind in loaded:
        yield getattr(loaded, kind)(**options)


def _option(text: str) -> tuple[str, Any]:
    """Parses an option: `gain=2` is a number, `name=belt` is text, and `ids=[1, 2]` is a list."""
    name, is_one, value = text.partition("=")
    if not is_one:
        refuse(CallError, f"'{text}' is not an option", "write name=value")
    try:
        return name, json.loads(value)
    except json.JSONDecodeError:
        return name, value


def _counting(folder: Path) -> str | None:
    """Builds and returns the library that counts allocations, or None if no compiler can build it."""
    source = folder / "counting.c"
    source.write_text(_native.counting_text())
    try:
        with refusals:
            return _native.build([str(source)], str(folder / "counting.so"))
    except Error as why:
        print(f"only leaked allocations are detected: {why}", file=sys.stderr)
        return None
