# SPDX-License-Identifier: Apache-2.0
"""The application in which a campaign injects faults: a doomed processor with a drive, a healthy one beside it, four verbs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib
from plant import Plant

PUSH = 1.0
"""Value that the doomed processor writes to the drive; its safe value is 0."""

NONE: Mapping[str, str] = {}


@dataclass
class Application:
    """Application of one round."""

    cell: gpac.System
    doomed: dict[str, gpac.VerbInstance[Any]]
    """Verbs on the doomed processor: each must have its own end report."""
    healthy: gpac.VerbInstance[Any]
    """Verb on the other processor: it must continue."""
    count: gpac.SVV[int]
    """Count of the healthy verb."""


def run(
    cell: gpac.System, blocks: str, failing: str, at: int, doomed: Mapping[str, Any], plant: Plant, policies: Mapping[str, str] = NONE
) -> Application:
    """Starts the application; the block `failing` of the doomed processor fails in invocation `at`. `doomed` contains that processor's
    options.

    The plant is pushed before anything fails. `policies` contains the verbs' policies for a lost program, by name.
    """
    safe = cell.processor("rtp0")
    lost = cell.processor("rtp1", **doomed)
    beside = safe.timer("beside", period="2 ms", priority=60)
    fast, slow = lost.timer("fast", period="2 ms", priority=50), lost.timer("slow", period="10 ms", priority=40)
    drive = lost.physical_device("drive", plant.driver(), exchange=fast)
    code = cell.download(blocks, "faulty")
    pushing = gpac.Verb(
        "pushing",
        blocks={"push": lib.block("write_channel")},
        instantiation_parameters={"effort": "push.channel"},
        input_parameters={"u": "push.u"},
        modes={"push.u": "asynchronous"},
        command_lists={"start": [activate("push", every="2 ms")]},
        if_cut_off=policies.get("pushing"),
    )
    counting = {
        name: _stepping(name, code[block], policies.get(name))
        for name, block in (("healthy", "counts"), ("bystander", "counts"), ("failing", failing))
    }
    count = cell.svv("healthy_count", "int64_t")
    pushed = pushing.on(fast).asynch(drive["x"].effort, u=PUSH)
    plant.until_pushed()
    return Application(
        cell,
        healthy=counting["healthy"].on(beside).asynch(count),
        doomed={
            "pushing": pushed,
            "bystander": counting["bystander"].on(slow, every={"it": "10 ms"}).asynch(cell.svv("bystander_count", "int64_t")),
            "failing": counting["failing"]
            .on(fast)
            .asynch(cell.svv("failing_count", "int64_t"), **({} if failing == "counts" else {"at": at})),
        },
        count=count,
    )


def _stepping(name: str, block: gpac.Block, if_cut_off: str | None) -> gpac.Verb[..., Any]:
    return gpac.Verb(
        name,
        blocks={"it": block},
        instantiation_parameters={"k": "it.k"},
        input_parameters={"at": "it.at"} if "at" in block.parameters else {},
        command_lists={"start": [activate("it", every="2 ms", budget="20 ms")]},
        if_cut_off=if_cut_off,
    )
