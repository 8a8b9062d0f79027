# SPDX-License-Identifier: Apache-2.0
"""The command `opengpac robots`: the arms that `gpac.robots.load` knows by name."""

from __future__ import annotations

import argparse
from typing import Any

from .errors import UnknownName, did_you_mean, refuse
from .tables import Table


def add_to(commands: Any) -> None:
    """Adds the command."""
    robots = commands.add_parser("robots", help="the arms that are known by name: joints, reach, package, and whether that is installed")
    robots.add_argument("names", nargs="*", metavar="NAME", help="show the home, tool and source of these")
    robots.set_defaults(run=_robots)


def _robots(given: argparse.Namespace) -> int:
    from .robots.catalogue import KNOWN

    if not given.names:
        rows = [
            [arm.name, len(arm.home), f"{arm.reach:.2f} m", f"{arm.package.name} {arm.package.version}", _installed(arm)]
            for arm in KNOWN.values()
        ]
        print(Table("arms known by name", ["name", "joints", "reach", "package", "installed"], rows))
        print("\nOne of them: opengpac robots NAME; any other arm: gpac.robots.load(FILE).")
        return 0
    for name in given.names:
        if name not in KNOWN:
            refuse(UnknownName, f"there is no arm '{name}'", did_you_mean(name, KNOWN))
        arm = KNOWN[name]
        print(Table(f"{name}: {len(arm.home)} joints, reach {arm.reach:.2f} m", ["joint", "home"], [*arm.home.items()]))
        print(f"tool: the frame of '{arm.tool}'\nsource: {arm.source}\ninstalled: {_installed(arm)}")
    return 0


def _installed(arm: Any) -> str:
    """Returns `yes`, or the command that installs its package."""
    return "yes" if arm.is_installed() else arm.package.installing
