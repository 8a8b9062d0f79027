# SPDX-License-Identifier: Apache-2.0
"""The command `opengpac robots`: lists the arms that `gpac.robots.load` supports by name."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ..errors import CallError, UnknownName, did_you_mean, refuse
from ..values.tables import Table


def add_to(commands: Any) -> None:
    """Adds the command."""
    robots = commands.add_parser("robots", help="list the arms that are known by name, with joints, reach and package")
    robots.add_argument("names", nargs="*", metavar="NAME", help="arm whose home, tool and source are shown")
    robots.add_argument("--draw", metavar="FILE", help="draw the named arm at its home position, as SVG")
    robots.set_defaults(run=_robots)


def _robots(given: argparse.Namespace) -> int:
    from ..robots.catalogue import ELSEWHERE, KNOWN, refuse_elsewhere

    if given.draw and len(given.names) != 1:
        refuse(CallError, f"--draw needs exactly one arm, not {len(given.names)}", "write opengpac robots NAME --draw FILE")
    if not given.names:
        rows = [
            [arm.name, len(arm.home), f"{arm.reach:.2f} m", f"{arm.package.name} {arm.package.version}", _installed(arm)]
            for arm in KNOWN.values()
        ]
        print(Table("arms known by name", ["name", "joints", "reach", "package", "installed"], rows))
        print(f"\nNo package contains {', '.join(ELSEWHERE)}; see where their models are with opengpac robots NAME.")
        print("Show one of them with opengpac robots NAME; load any other arm with gpac.robots.load(FILE).")
        return 0
    for name in given.names:
        refuse_elsewhere(name)
        if name not in KNOWN:
            refuse(UnknownName, f"there is no arm '{name}'", did_you_mean(name, KNOWN))
        arm = KNOWN[name]
        print(Table(f"{name}: {len(arm.home)} joints, reach {arm.reach:.2f} m", ["joint", "home"], [*arm.home.items()]))
        print(f"tool: the frame of '{arm.tool}'\nsource: {arm.source}\ninstalled: {_installed(arm)}")
        if given.draw:
            _draw(name, Path(given.draw))
    return 0


def _draw(name: str, file: Path) -> None:
    from ..robots import load, sketch

    arm = load(name, clock="virtual")
    with arm.system:
        drawing = sketch.drawn(name, sketch.chain(arm, arm.values("home")))
    try:
        file.write_text(drawing)
    except OSError as error:
        refuse(CallError, f"cannot write '{file}': {error.strerror}", "choose a writable file")
    print(f"wrote '{file}'")


def _installed(arm: Any) -> str:
    """Returns `yes`, or the command that installs the arm's package if it is not installed."""
    return "yes" if arm.is_installed() else arm.package.installing
