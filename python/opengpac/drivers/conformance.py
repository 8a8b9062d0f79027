# SPDX-License-Identifier: Apache-2.0
"""`opengpac driver check`: whether a driver keeps what the interface of drivers promises to everybody else."""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from .. import _native, processes
from ..errors import CallError, Error, refusals, refuse
from .driver import Driver
from .in_python import python
from .loading import load


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """The command `driver`."""
    driver = commands.add_parser("driver", help="drivers of machines").add_subparsers(required=True, metavar="WHAT")
    check = driver.add_parser("check", help="run the conformance kit on a driver; a file is compiled first")
    check.add_argument(
        "driver", metavar="NAME|FILE", help="a driver that is known, a source in C, a file in Python, a shared object or a folder"
    )
    check.add_argument("options", nargs="*", metavar="OPTION=VALUE", help="options that it is checked with")
    check.add_argument("--exchanges", type=int, default=1_000_000, help="how many the check of memory makes, at most (1000000)")
    check.add_argument("-v", "--verbose", action="store_true", help="also list the checks that passed")
    check.add_argument("--json", action="store_true", help="the report for a program")
    check.set_defaults(run=run)


def run(given: argparse.Namespace) -> int:
    """Checks and prints the reports; 1 where a check failed."""
    options = dict(_option(text) for text in given.options)
    reports = [check(driver, exchanges=given.exchanges) for driver in _drivers(given.driver, options)]
    if given.json:
        print(json.dumps(reports))
    else:
        for report in reports:
            print(shown(report, given.verbose))
    return 0 if all(report["passed"] for report in reports) else 1


def check(driver: Driver, *, exchanges: int = 1_000_000) -> dict[str, Any]:
    """The report of the kit on a driver: {"driver", "passed", "checks": [{"check", "sentence", "verdict", "why"}], "text"}."""
    with tempfile.TemporaryDirectory() as folder:
        counting = _counting(Path(folder))
        started = processes.command_with_package if driver.kind == "python" else processes.command
        command = started("run_driver_check")
        with refusals:
            sanitizer = _native.sanitizer_in(folder)
            options = json.dumps(dict(driver.options))
            return json.loads(_native.check_conformance(driver.kind, options, command, exchanges, counting, sanitizer))


def shown(report: Mapping[str, Any], verbose: bool) -> str:
    """A report for people: what failed and its cause, and with `verbose` each check."""
    lines = report["text"].splitlines()
    return "\n".join(line for line in lines if verbose or not line.startswith(("passed ", "- ")))


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
    """`gain=2` is a number, `name=belt` a text, `ids=[1, 2]` a list."""
    name, is_one, value = text.partition("=")
    if not is_one:
        refuse(CallError, f"'{text}' is no option", "write name=value")
    try:
        return name, json.loads(value)
    except json.JSONDecodeError:
        return name, value


def _counting(folder: Path) -> str | None:
    """What counts allocations; None where no compiler makes it."""
    source = folder / "counting.c"
    source.write_text(_native.counting_text())
    try:
        with refusals:
            return _native.build([str(source)], str(folder / "counting.so"))
    except Error as why:
        print(f"allocations are seen only where they are not given back: {why}", file=sys.stderr)
        return None
