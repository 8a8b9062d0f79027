# SPDX-License-Identifier: Apache-2.0
"""The commands `opengpac drivers` and `opengpac devices`: list the driver declarations, and the devices that the drivers find."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Iterable, Mapping
from typing import Any

from .. import drivers
from ..drivers.catalog import Found, is_file, manuals, on_host_of, searched
from ..errors import CallError, did_you_mean, refuse
from ..remote.calls import Remote
from ..remote.opening import open_session
from ..top import url_of
from ..values.quantities import duration_ns


def add_to(commands: Any) -> None:
    """Adds the two commands."""
    of_drivers = commands.add_parser("drivers", help="list drivers, or show what they declare")
    of_drivers.add_argument("action", nargs="?", choices=["list", "show"], default="list")
    of_drivers.add_argument("names", nargs="*", metavar="NAME|FILE")
    of_drivers.set_defaults(run=_drivers)
    devices = commands.add_parser("devices", help="find physical devices").add_subparsers(required=True, metavar="WHAT")
    scan = devices.add_parser("scan", help="find devices that a driver could open, without moving anything")
    scan.add_argument("--on", metavar="URL", help="search the host of this daemon: its URL, such as unix:///run/cell.sock, or its name")
    scan.add_argument("--token", help="token for a daemon on a port (default: OPENGPAC_TOKEN)")
    scan.add_argument("kind", metavar="NAME|FILE", nargs="?", help="driver to search with, or its file (default: all that can search)")
    scan.add_argument("options", nargs=argparse.REMAINDER, metavar="--OPTION VALUE", help="options of the driver that narrow the search")
    scan.set_defaults(run=_scan)


def _drivers(given: argparse.Namespace) -> int:
    if given.action == "list":
        print(drivers.list())
        return 0
    if not given.names:
        print("name a driver: opengpac drivers show mujoco", file=sys.stderr)
        return 1
    for name in given.names:
        for manual in manuals(name):
            print(manual)
    return 0


def _scan(given: argparse.Namespace) -> int:
    if given.on and given.kind and is_file(given.kind):
        refuse(CallError, f"the driver in '{given.kind}' can search only the host that has the file", "run the command there, without --on")
    where = options(given.options, [option for manual in manuals(given.kind) for option in manual.options]) if given.kind else {}
    found = drivers.scan(given.kind, **where) if given.on is None else _found_on(given, where)
    print(found)
    return 0 if found or not found.problems else 1


def _found_on(given: argparse.Namespace, where: Mapping[str, Any]) -> Found:
    """Returns the devices found on the host of a daemon. Does not take command away from the session that has it."""
    session = open_session(url_of(given.on, None), f"devices-scan-{os.getpid()}", token=given.token, command=False)
    try:
        return searched(on_host_of(Remote(session)), given.kind, where)
    finally:
        session.close()


def options(words: Iterable[str], declared: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """Parses a driver's options from the command line, `--port /dev/ttyUSB0 --timeout "20 ms"`, each according to its declared kind."""
    kinds = {option["name"]: option for option in declared}
    taken: dict[str, Any] = {}
    rest = iter(words)
    for word in rest:
        if not word.startswith("--"):
            refuse(CallError, f"'{word}' is not an option", "write --option value")
        name, equals, value = word[2:].partition("=")
        name = name.replace("-", "_")
        name = name if name in kinds or f"{name}_ns" not in kinds else f"{name}_ns"
        if name not in kinds:
            refuse(CallError, f"the driver has no option '{name}'", did_you_mean(name, kinds))
        taken[name] = _value(value if equals else next(rest, ""), kinds[name])
    return taken


def _value(text: str, option: Mapping[str, Any]) -> Any:
    """Parses the text according to the kind of the option: a list or table as JSON; a list also as comma-separated words."""
    name, kind = option["name"], option["kind"]
    if kind == "text":
        return text
    if kind == "list" and not text.startswith("["):
        return [word if not word.isdecimal() else int(word) for word in text.split(",")]
    if option["unit"] == "ns" and not text.isdecimal():
        return duration_ns(text, f"option '{name}'")
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        refuse(CallError, f"option '{name}' must be a {kind}, not {text!r}")
