# SPDX-License-Identifier: Apache-2.0
"""Description of the system set up for an environment."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..application.instances import VerbInstance
from ..devices.logical import LogicalDevice
from .values import Variables

Begin = Callable[[np.random.Generator], Mapping[str, Any]]


@dataclass(frozen=True, kw_only=True)
class Task:
    """Task of an environment. Returned by the function that sets up its system.

    `ports` are the observed, actuated and rewarded values, by the names that the terms use: an SVV, or a list of SVVs of one number
    each, `[joint.sensed for joint in arm]`. `devices` are enabled at each reset, and then `instances`, verb instances created by
    `new_instance`, are started. `begin(rng)` returns the initial values of an episode: values of ports, and the joint positions of
    simulated arms by the name of the physical device, `{"goal": …, "ur5e": …}`; `rng` is the environment's random number generator,
    so that a seed determines them.
    """

    ports: Mapping[str, Variables]
    devices: Iterable[LogicalDevice] = ()
    instances: Sequence[VerbInstance[Any]] = ()
    begin: Begin | None = None
