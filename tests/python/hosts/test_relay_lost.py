# SPDX-License-Identifier: Apache-2.0
"""A process is lost while values go from it to another host, or from there to it, through the supervisor's process."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from typing import Any

import pytest

import opengpac as gpac
from afar import children, until
from joining import Joining
from opengpac import activate, library

LIMIT = "30 s"


def chain(code: gpac.Module) -> gpac.Verb[..., Any]:
    """Returns a verb that counts on one processor and doubles each number on another."""
    return gpac.Verb(
        "chain",
        blocks={"count": code["count"], "twice": library.gain(k=2.0)},
        instantiation_parameters={"numbers": ["count.y", "twice.u"], "doubled": "twice.y"},
        command_lists={"start": [activate("twice"), activate("count", every="5 ms")]},
    )


@pytest.mark.parametrize("process", [True, "cell-p"])
@pytest.mark.parametrize("from_process", [True, False])
def test_a_process_is_lost_and_comes_back_while_its_connection_to_another_host_stands(
    listening: gpac.System, joins: Callable[..., Joining], built: dict[str, str], from_process: bool, process: bool | str
) -> None:
    joins()
    listening.processor("rtp0").timer("fast", period="5 ms", priority=80)
    near = listening.processor("rtp1", process=process)
    far = listening.processor("rtp2", host="cell-b")
    writer, reader = (near, far) if from_process else (far, near)
    fast, soft = writer.timer("fast", period="5 ms", priority=80), reader.software("soft", priority=70)
    verb = chain(listening.download(built["count"], "count"))
    known = listening.svv("doubled", history=100)
    idle = verb.on({"count": fast, "twice": soft}).new_instance(listening.svv("numbers"), known)
    doubled = listening.svv("beside", history=100)
    goes = verb.on({"count": fast, "twice": soft}).asynch(listening.svv("other"), doubled)
    until(lambda: doubled.value >= 100, "values come over both ways")
    [pid] = children("run_processor")
    os.kill(pid, signal.SIGKILL)
    with pytest.raises(gpac.Terminated, match="processor 'rtp1' was lost") as caught:
        goes.wait(timeout=LIMIT)
    assert caught.value.condition == "processor_lost"
    stays = listening.svv("stays", history=100)
    both = verb.on({"count": listening.sources["rtp0.fast"], "twice": far.software("other", priority=60)}).asynch(
        listening.svv("here"), stays
    )
    until(lambda: stays.value >= 100, "who was not lost is connected all the same")
    listening.reset()
    idle.start()
    until(lambda: known.value >= 300, "they come over the new process")
    again = [int(row["value"]) for row in known.history[:]]
    assert again == list(range(again[0], again[0] + 2 * len(again), 2)), "each number once and in order"
    assert both.state == idle.state == "running"
    assert not [entry for entry in listening.log() if entry["kind"] == "unconnected"]
