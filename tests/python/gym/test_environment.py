# SPDX-License-Identifier: Apache-2.0
"""`gpac.gym`: environments over the virtual clock obey Gymnasium's rules, reset to the same start, and treat terms as a policy does."""

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import opengpac as gpac
from opengpac import activate, library, on
from opengpac.gym import Environment, Task, Values, side_by_side
from opengpac.system.realtime import EmbeddedSystem
from policy_networks import identity

SEEN = [gpac.Term("y", unit="m", offset=0.5, within=(-1.0, 2.0), scale=2.0), gpac.Term("goal", unit="m", clip=(-3.0, 3.0))]
PUSH = gpac.Term("u", unit="m", scale=0.5, offset=0.1, clip=(-0.4, 0.6))


def tank(cell: gpac.System) -> Task:
    """Returns a task: a first-order lag that follows `u` and ends by itself after 0.5 s."""
    slow = cell.processor("rtp0").timer("slow", period="10 ms")
    u, y, goal = (cell.svv(name, unit="m") for name in ("u", "y", "goal"))
    verb = gpac.Verb(
        "tank",
        blocks={"lag": library.lowpass(alpha=0.2), "clock": library.time_limit(limit=0.5)},
        instantiation_parameters={"u": "lag.u", "y": "lag.y"},
        modes={"lag.u": "asynchronous"},
        command_lists={"start": [activate("lag", every="10 ms"), activate("clock", every="10 ms")]},
        conditions={"over": on("clock.expired", returns=[])},
    )
    return Task(
        ports={"u": u, "y": y, "goal": goal}, instances=[verb.on(slow).new_instance(u, y)], begin=lambda rng: {"goal": rng.uniform(-1, 1)}
    )


def near(values: Values) -> float:
    return -abs(values["y"] - values["goal"])


def tanks(**changes: Any) -> Environment:
    given: dict[str, Any] = {"observations": SEEN, "actions": PUSH, "every": "20 ms", "reward": near, "seconds": 0.2} | changes
    return Environment(given.pop("setup", tank), **given)


@pytest.fixture
def env() -> Iterator[Environment]:
    made = tanks()
    yield made
    made.close()


def test_it_keeps_to_the_rules_of_gymnasium(env: Environment) -> None:
    check_env(env, skip_render_check=True)


def test_spaces_follow_from_the_terms(env: Environment) -> None:
    space: Any = env.observation_space
    np.testing.assert_allclose(space.low, [-3.0, -3.0])
    np.testing.assert_allclose(space.high, [3.0, 3.0])
    actions: Any = env.action_space
    np.testing.assert_allclose(actions.low, [-1.0])
    np.testing.assert_allclose(actions.high, [1.0])


def test_an_episode_steps_rewards_and_is_truncated(env: Environment) -> None:
    seen, _ = env.reset(seed=3, options={"goal": 0.25})
    # The action 0 is 0.1 m, and 20 ms are two invocations of the lag; the reset made two more.
    assert seen == pytest.approx([(0.1 * (1 - 0.8**2) - 0.5) * 2.0, 0.25])
    for step in range(1, 11):
        seen, reward, ended, truncated, info = env.step(np.array([1.0], np.float32))
        assert (ended, truncated, info) == (False, step == 10, {})
    y = 0.6 + (0.1 * (1 - 0.8**2) - 0.6) * 0.8**20
    assert env.values["y"] == pytest.approx(y) and reward == pytest.approx(-abs(y - 0.25))
    assert env.values.time == pytest.approx(0.2) and seen[0] == pytest.approx((y - 0.5) * 2.0)


def test_a_verb_that_ends_by_itself_terminates_its_episode() -> None:
    env = tanks(seconds=None)
    env.reset(seed=1)
    for _ in range(100):
        _, _, ended, _, info = env.step(np.zeros(1, np.float32))
        if ended:
            break
    assert info == {"ended": "over"} and 0.4 < env.values.time < 0.6
    assert env.reset(seed=1)[0].shape == (2,) and not env.step(np.zeros(1, np.float32))[2]
    env.close()


def test_a_termination_of_the_users_own() -> None:
    env = tanks(terminated=lambda values: values["y"] > 0.3)
    env.reset(seed=1)
    steps = [env.step(np.ones(1, np.float32))[2] for _ in range(5)]
    assert steps == sorted(steps) and steps[-1] and not steps[0]
    env.close()


def test_a_reset_installs_nothing(env: Environment, monkeypatch: pytest.MonkeyPatch) -> None:
    env.reset(seed=1)
    calls: set[str] = set()
    asked: Callable[..., Any] = EmbeddedSystem._ask

    def told(self: EmbeddedSystem, name: str, *rest: Any, **more: Any) -> Any:
        calls.add(name)
        return asked(self, name, *rest, **more)

    monkeypatch.setattr(EmbeddedSystem, "_ask", told)
    env.reset(seed=2)
    assert calls and calls <= {"state", "halt", "start", "now", "advance", "write", "report"}, calls


def test_history_and_the_action_before_are_as_the_policy_has_them(tmp_path: Path) -> None:
    """Compares with the same terms around a network that returns its input."""
    seen = [gpac.Term("y", unit="m", size=1, history=3, scale=2.0, offset=0.2), gpac.Term(previous="actions", size=1)]
    env = tanks(observations=seen, actions=gpac.Term("u", unit="m"), seconds=None)
    first, _ = env.reset(seed=1)
    assert first == pytest.approx([(0.0 - 0.2) * 2.0] * 3 + [0.0])
    rng, ys, actions, observed = np.random.default_rng(1), [env.values["y"]], [0.0], [first]
    for _ in range(6):
        action = rng.uniform(-1, 1, 1).astype(np.float32)
        observed.append(env.step(action)[0])
        ys.append(env.values["y"])
        actions.append(float(action[0]))
    policy = gpac.policy(
        identity(tmp_path / "same.onnx", 4), inputs={"obs": [seen[0], gpac.Term("before", size=1)]},
        outputs={"actions": gpac.Term("out", size=4)}, every="20 ms",
    )  # fmt: skip
    told = policy.run(y=[[y] for y in ys], before=[[a] for a in actions], every="20 ms")
    np.testing.assert_array_equal(np.array(observed), told.out.astype(np.float32))
    env.close()


def test_several_inputs_are_a_space_of_their_names() -> None:
    env = tanks(observations={"obs": SEEN[:1], "goal": SEEN[1]})
    seen, _ = env.reset(seed=1)
    assert set(seen) == {"obs", "goal"} and seen in env.observation_space
    env.close()


def test_many_of_them_side_by_side_are_each_as_one_alone(env: Environment) -> None:
    several = side_by_side(3, tanks)
    rng, seen = np.random.default_rng(5), several.reset(seed=7)[0]
    alone = [env.reset(seed=8)[0]]
    np.testing.assert_array_equal(seen[1], alone[0])
    for step in range(12):
        actions = rng.uniform(-1, 1, (3, 1)).astype(np.float32)
        seen, _, _, truncated, _ = several.step(actions)
        assert truncated.all() == (step == 9), "and they begin again by themselves"
        if step < 9:
            np.testing.assert_array_equal(seen[1], env.step(actions[1])[0])
    several.close()


REFUSED: dict[str, tuple[dict[str, Any], type[gpac.Error], str]] = {
    "unit": (
        {"observations": gpac.Term("y", unit="rad")},
        gpac.UnitMismatch,
        "observation 'y' is in rad, but port 'y' of the task is in m",
    ),
    "size": ({"observations": gpac.Term("y", size=2)}, gpac.TypeMismatch, "observation 'y' has 2 numbers, but port 'y' of the task has 1"),
    "port": ({"actions": gpac.Term("v")}, gpac.DefinitionError, "action 'v' is not a port of the task"),
    "action's history": ({"actions": gpac.Term("u", history=2)}, gpac.DefinitionError, "cannot have a history"),
    "no task": ({"setup": lambda cell: None}, gpac.DefinitionError, "the setup of the environment must return a task, not None"),
    "no step": ({"every": "0 ms"}, gpac.OutOfRange, "the step of the environment must be more than 0 s, not '0 ms'"),
    "no term": ({"observations": "y"}, gpac.DefinitionError, "observation of the environment must consist of terms, not 'y'"),
}


@pytest.mark.parametrize("wrong", REFUSED)
def test_what_does_not_fit_is_refused_with_both_ends(wrong: str) -> None:
    changes, error, text = REFUSED[wrong]
    with pytest.raises(error, match=text):
        tanks(**changes)


def test_joints_in_another_order_are_refused() -> None:
    def setup(cell: gpac.System) -> Task:
        task = tank(cell)
        return Task(ports=dict(task.ports) | {"q": [cell.svv(f"leg.{name}.sensed", unit="rad") for name in ("knee", "hip")]})

    with pytest.raises(gpac.DefinitionError, match=r"expects the order hip, knee, but port 'q' has leg\.knee\.sensed, leg\.hip\.sensed"):
        tanks(setup=setup, observations=gpac.Term("q", names=["hip", "knee"]))


def test_wrong_actions_and_beginnings_are_refused(env: Environment) -> None:
    env.reset(seed=1)
    with pytest.raises(gpac.CallError, match=r"an action must have shape \(1,\), not \(2,\)"):
        env.step(np.zeros(2, np.float32))
    with pytest.raises(gpac.UnknownName, match="an episode cannot begin with 'gaol'") as refused:
        env.reset(options={"gaol": 1.0})
    assert "goal" in str(refused.value)


def test_without_gymnasium_one_line_says_what_to_install() -> None:
    program = (
        "import sys; sys.modules['gymnasium'] = None; import opengpac as gpac\ntry:\n    gpac.gym\nexcept gpac.Error as why: print(why)"
    )
    said = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    assert "gpac.gym needs the package gymnasium" in said and "pip install 'opengpac[gym]'" in said
