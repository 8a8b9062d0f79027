# SPDX-License-Identifier: Apache-2.0
"""Weight of an arm's payload, held by the joints in addition to the weight of the arm."""

from __future__ import annotations

from collections.abc import Sequence

from .. import library as lib
from ..application.reports import Report
from ..definition.commands import activate
from ..definition.parameters import each, input
from ..definition.verb_decorator import verb
from ..devices.groups import Group
from ..robots.joints import Joint


@verb(
    name="carry",
    blocks={"payload": lib.block("payload_effort")},
    objects={"arm": each(Joint)},
    instantiation_parameters={"arm.sensed": "payload.q", "arm.load_effort": "payload.effort"},
    input_parameters={
        "mass": input("payload.mass", tunable=True),
        "centre": input("payload.centre", tunable=True),
        "chain": input("payload.chain", member="arm.standing"),
    },
    output_values={"held": "payload.held"},
    command_lists={"start": [activate("payload", every="20 ms")]},
    # While other verbs are suspended, the joints must keep carrying their load.
    suspend="hold_last",
)
def carry(arm: Group[Joint], /, mass: float, centre: Sequence[float] = (0.0, 0.0, 0.0)) -> Report:
    """Holds the weight of a payload until it is halted; `arm.payload = gpac.robots.Payload(mass, centre)` starts and changes it.

    mass: kg, from 0; centre: centre of mass in the flange's frame, m. Only the weight is compensated, along -z of the model's world.
    """
    ...
