# SPDX-License-Identifier: Apache-2.0
"""A program that is cut off during a random composition: the composition is halted or made safe, and nothing of it begins afterwards.

`OPENGPAC_CUT_OFFS` changes the number of compositions.
"""

from __future__ import annotations

import datetime
import os

import opengpac as gpac
from afar import until
from daemons import Daemon
from drawn_compositions import Trial, drawn_trial, of_svvs, work
from rig import Rig

TRIED = int(os.environ.get("OPENGPAC_CUT_OFFS", "10"))
"""Number of compositions that are cut off while they run."""


class FarRig(Rig):
    """Rig of a program that connects to an existing system."""

    def __init__(self, cell: gpac.System, built: dict[str, str]) -> None:
        self.cell, self.built, self._modules = cell, built, {}
        self.fast = cell.sources["rtp0.fast"]


def cut_off(trial: Trial, watcher: gpac.System, safe: bool) -> bool:
    """Starts the composition and cuts its program off while it runs; returns false if it had ended before. A composition that is to be
    `safe` does not brake either."""
    operator = trial.rig.cell
    assert operator.session is not None and watcher.session is not None
    at_ms = trial.rng.randint(0, 25) + 0.5
    vi = trial.drawn.verb.new_instance(*(trial.svvs[name] for name in trial.drawn.verb.instantiation_parameters)).start()
    operator.advance(f"{at_ms} ms")
    if vi.done:
        return False
    svvs = {name: watcher.svv(name) for name in trial.svvs}
    # Only a halt leads to the recovery declared for one, and to braking.
    seen = lambda: {name: svv.value for name, svv in svvs.items()} if safe else work(svvs, frozenset(trial.drawn.recovery))  # noqa: E731
    counted = seen()
    name = operator.session.name
    operator.session.abandon()
    session = watcher.session
    until(lambda: not any(line["name"] == name and line["alive"] for line in session.sessions), "the session is lost")
    session.take_command()
    where = f"seed {trial.seed}, cut off at {at_ms} ms: {trial.drawn.verb!r}"
    for _ in range(2):
        watcher.advance("20 ms")
        assert seen() == counted, where
    assert all(instance.state == "ended" for instance in watcher.instances), where
    session.release_command()
    return True


def test_nothing_begins_in_a_composition_whose_program_was_cut_off(daemon: Daemon, built: dict[str, str]) -> None:
    tried, seed = 0, datetime.date.today().toordinal() * 100_000
    with gpac.connect(daemon.url, name="builder") as cell:
        Rig(cell, built)
    with gpac.connect(daemon.url, name="watcher", command=False) as watcher:
        while tried < TRIED:
            seed += 1
            with gpac.connect(daemon.url, name=f"operator{seed}") as cell:
                rig = FarRig(cell, built)
                safe = seed % 2 == 0
                trial = drawn_trial(rig, of_svvs(rig), seed, if_cut_off="safe" if safe else None)
                tried += trial is not None and cut_off(trial, watcher, safe)
