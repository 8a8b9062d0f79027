# SPDX-License-Identifier: Apache-2.0
"""Gymnasium environment that is simulated by a system under the virtual clock."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from ..devices.enabling import enable
from ..errors import CallError, DefinitionError, OutOfRange, UnknownName, did_you_mean, refusals, refuse
from ..system.system import System
from ..values.quantities import Quantity, duration_ns
from .spaces import NetworkOutput, Observations, Terms
from .task import Task
from .values import Ports, Values

_number = itertools.count()


class Environment(gymnasium.Env[Any, np.ndarray]):
    """A Gymnasium environment for a system under the virtual clock: each step advances the clock by `every`, and the whole system runs.

    `setup(cell)` sets up a system once, and returns a `Task`. `observations` and `actions` are the `gpac.Term`s of a policy, with the
    names of the task's ports. The spaces are derived from `within`, `clip`, `scale` and `offset`; an observation is the network's
    input and an action is its output, both computed as by `gpac.policy`. Several inputs, `{"obs": …, "goal": …}`, form a space
    `Dict`. `reward` and `terminated` are functions of the ports' `Values` at the end of a step. `seconds` truncates an episode.
    `name` is the name of the system, to which a number is appended.

    `reset` ends the verbs of the task, disables its devices, resets simulated arms, and restarts, so that every verb instance has the
    initial state of its blocks, and every action is 0. Nothing is reinstalled. Its `options` replace the initial values of the task.
    An episode whose verb ends by itself is terminated; `info["ended"]` is the condition of that end.

    Raises `DefinitionError`, `TypeMismatch` and `UnitMismatch`, naming both, if terms and ports do not match.
    """

    metadata = {"render_modes": []}

    def __init__(
        self,
        setup: Callable[[System], Task],
        *,
        observations: Terms | Mapping[str, Terms],
        actions: Terms,
        every: Quantity,
        reward: Callable[[Values], float],
        terminated: Callable[[Values], bool] | None = None,
        seconds: float | None = None,
        name: str = "gym",
    ) -> None:
        self.system = System(f"{name}_{next(_number)}", clock="virtual", progress=False)
        """System of the environment."""
        if self.system.session is not None:
            self.system.close()
            refuse(
                CallError, "an environment needs a system in this process, but OPENGPAC_SYSTEM names a remote one", "unset OPENGPAC_SYSTEM"
            )
        self._every_ns = duration_ns(every, "the step of the environment")
        if self._every_ns <= 0:
            refuse(OutOfRange, f"the step of the environment must be more than 0 s, not {every!r}", "pass every='20 ms', for example")
        self._reward, self._terminated = reward, terminated
        self._steps_max = None if seconds is None else round(seconds * 1e9 / self._every_ns)
        try:
            task = setup(self.system)
            if not isinstance(task, Task):
                refuse(DefinitionError, f"the setup of the environment must return a task, not {task!r}", "return gpac.gym.Task(ports=…)")
            self.task = task
            """Task returned by `setup`."""
            self._devices = [*task.devices]
            self._arms = [one for one in self.system.physical_devices.values() if any(service.name == "place" for service in one.services)]
            self._ports = Ports(self.system, task.ports)
            self._acted = NetworkOutput(actions, self._ports)
            self._observations = Observations(observations, self._ports, len(self._acted.scale))
        except BaseException:
            self.system.close()
            raise
        self.action_space = self._acted.space
        self.observation_space = self._observations.space
        self.values = Values()
        """Values of the ports at the end of the latest step."""
        self._steps = 0

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begins an episode and returns the first observation. `seed` determines the initial values of the task; `options` replaces
        them."""
        super().reset(seed=seed)
        start = dict(self.task.begin(self.np_random) if self.task.begin else {}) | (options or {})
        self._check(start)
        self._end()
        for machine in self._arms:
            machine.services.place(positions=start.get(machine.name))
        enable(self._devices, None)
        nothing = np.zeros(len(self._acted.scale), np.float32)
        self._ports.turn(self._acted.stores(nothing), 0)
        for port in start.keys() & self._ports.variables.keys():
            self._ports.write(port, start[port])
        for instance in self.task.instances:
            instance.start()
        self._to_the_next_step()
        self._steps = 0
        self._observations.begin()
        return self._observations.of(self._take(self._ports.turn([], 0)), nothing), {}

    def step(self, action: np.ndarray) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Performs one step of `every` with this `action`; returns observation, reward, terminated, truncated, info."""
        action = np.asarray(action, dtype=np.float32)
        if action.shape != self._acted.scale.shape:
            refuse(CallError, f"an action must have shape {self._acted.scale.shape}, not {action.shape}")
        numbers = self._ports.turn(self._acted.stores(action), self._every_ns)
        self._steps += 1
        observation = self._observations.of(self._take(numbers), action)
        ended = self._ended()
        terminated = ended is not None or bool(self._terminated and self._terminated(self.values))
        truncated = self._steps_max is not None and self._steps >= self._steps_max
        return observation, float(self._reward(self.values)), terminated, truncated, {} if ended is None else {"ended": ended}

    def close(self) -> None:
        """Closes the system."""
        if not self.system.closed:
            self.system.close()

    def _check(self, start: Mapping[str, Any]) -> None:
        known = [*self._ports.variables, *(machine.name for machine in self._arms)]
        for name in start:
            if name not in known:
                refuse(UnknownName, f"an episode cannot begin with '{name}', which is not a port of the task", did_you_mean(name, known))

    def _end(self) -> None:
        """Ends the running verbs, and advances the clock to a multiple of the step."""
        for device in self._devices:
            if device.state != "disabled":
                device.disable()
        for instance in self.task.instances:
            if instance.state not in ("created", "ended"):
                instance.halt()
        self._to_the_next_step()

    def _to_the_next_step(self) -> None:
        with refusals:
            native = self.system._alive()
            native.advance(self._every_ns - native.now() % self._every_ns)

    def _take(self, numbers: np.ndarray) -> np.ndarray:
        self.values = self._ports.values(numbers)
        self.values.steps, self.values.time = self._steps, self._steps * self._every_ns * 1e-9
        return numbers

    def _ended(self) -> str | None:
        """Returns the condition with which a verb of the task has ended, or None."""
        for instance in self.task.instances:
            if instance.state == "ended":
                return str(getattr(instance.report, "condition", "ended"))
        if not self.task.instances:
            return next((device.state for device in self._devices if device.state in ("disabled", "fault")), None)
        return None


def side_by_side(
    count: int, make: Callable[[], Environment], *, autoreset: AutoresetMode = AutoresetMode.SAME_STEP
) -> SyncVectorEnv[Any, Any]:
    """Creates `count` environments in this process, each with its own system, as one Gymnasium vector environment.

    `make` creates one environment. `autoreset` defines when a finished environment begins its next episode: by default in the same
    step.
    """
    return SyncVectorEnv([make] * count, autoreset_mode=autoreset)
