# SPDX-License-Identifier: Apache-2.0
"""Two arms at once: `together` ends with the first arrival or with the last; a halt brings all arms to rest."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from opengpac import motion

NAMES = ("arm", "goal", "speed", "acceleration", "tolerance", "position", "error", "duration")
APART = {f"right.{name}": f"right_{name}" for name in NAMES}
NEAR, FAR = [0.2, -0.2], [1.2, -1.2]


class Arms:
    """Two arms in one system, each on its own processor or both on one."""

    def __init__(self, processors: int) -> None:
        self.cell = gpac.System("two_arms", clock="virtual")
        rtps = [self.cell.processor(f"rtp{n}") for n in range(processors)]
        timers = [rtp.timer("fast", period="1 ms", priority=80) for rtp in rtps]
        self.slow = [rtp.timer("slow", period="20 ms", priority=60) for rtp in rtps]
        self.left = gpac.robots.load("two_joint", on=timers[0], name="left").enable()
        self.right = gpac.robots.load("two_joint", on=timers[-1], name="right").enable()

    def verb(self, **options: Any) -> gpac.ComposedVerb:
        """Returns a motion of both arms."""
        parts = {"left": motion.move_absolute.on(self.slow[0]), "right": motion.move_absolute.on(self.slow[-1])}
        return gpac.together(parts, name="move_both", rename=APART, **options)

    def speeds(self) -> np.ndarray:
        """Returns the commanded speeds of the joints."""
        return np.array([*self.left.values("commanded_velocity"), *self.right.values("commanded_velocity")])


def keeps_to_its_limits(arm: gpac.robots.Arm) -> bool:
    """Returns whether the references of all joints kept to their accelerations at 1 ms."""
    changes = [np.abs(np.diff(joint.reference.history[:]["value"], 2)).max() / 1e-6 for joint in arm]
    return all(change <= joint.max_acceleration * (1 + 1e-6) for joint, change in zip(arm, changes, strict=True))


@pytest.fixture(params=[1, 2])
def arms(request: pytest.FixtureRequest) -> Iterator[Arms]:
    """Yields arms on one processor, and on two."""
    made = Arms(request.param)
    with made.cell:
        yield made


def test_it_goes_on_when_all_have_arrived(arms: Arms) -> None:
    report: Any = arms.verb(until="all")(arms.left, right_arm=arms.right, goal=NEAR, right_goal=FAR)
    assert report.condition == "completed" and report.command_list == "start"
    assert np.allclose(report.position, NEAR, atol=0.01) and np.allclose(report.right_position, FAR, atol=0.01)
    assert report.time > report.duration and report.time > report.right_duration > report.duration
    assert np.abs(arms.speeds()).max() < 1e-3


def test_which_part_arrives_first_does_not_matter(arms: Arms) -> None:
    report: Any = arms.verb(until="all")(arms.left, right_arm=arms.right, goal=FAR, right_goal=NEAR)
    assert np.allclose(report.position, FAR, atol=0.01) and np.allclose(report.right_position, NEAR, atol=0.01)
    at_once: Any = arms.verb(until="all")(arms.left, right_arm=arms.right, goal=FAR, right_goal=NEAR)
    assert at_once.condition == "completed" and at_once.time < 0.2


def test_without_it_the_first_ends_both(arms: Arms) -> None:
    report: Any = arms.verb()(arms.left, right_arm=arms.right, goal=NEAR, right_goal=FAR)
    assert report.condition == "arrived"
    assert np.allclose(report.position, NEAR, atol=0.01) and not np.allclose(report.right_position, FAR, atol=0.1)
    arms.cell.advance("1 s")
    assert np.abs(arms.speeds()).max() == 0.0 and keeps_to_its_limits(arms.right), "its servos brake the arm that still moves"
    motion.move_absolute(arms.right, NEAR)
    assert keeps_to_its_limits(arms.right)


@pytest.mark.parametrize("until", ["any", "all"])
def test_a_halt_brings_both_to_rest(arms: Arms, until: str) -> None:
    vi = arms.verb(until=until).asynch(arms.left, right_arm=arms.right, goal=[0.5, -0.5], right_goal=FAR, right_speed="100 %")
    arms.cell.advance("0.3 s")
    assert np.abs(arms.speeds()).min() > 0.05, "both move"
    vi.halt()
    report: Any = vi.wait()
    assert (report.condition, report.command_list) == ("halted", "stop")
    assert np.abs(arms.speeds()).max() < 1e-6 and not np.allclose(arms.right.values("sensed"), FAR, atol=0.1)


def test_it_is_suspended_when_both_are_at_rest(arms: Arms) -> None:
    vi = arms.verb(until="all").asynch(arms.left, right_arm=arms.right, goal=FAR, speed="5 %", right_goal=FAR, right_speed="100 %")
    arms.cell.advance("0.5 s")
    slow, fast = arms.speeds()[0], arms.speeds()[2]
    assert 0.01 < slow < fast / 5
    vi.suspend()
    assert vi.state == "suspended" and np.abs(arms.speeds()).max() < fast / 20, "the servos smooth the last set-points"
    arms.cell.advance("0.1 s")
    assert np.abs(arms.speeds()).max() == 0.0
    vi.resume()
    arms.cell.advance("0.1 s")
    assert arms.speeds()[0] > 0.01, "it goes on"
    vi.halt()
    assert np.abs(arms.speeds()).max() < 1e-6


def test_a_time_limit_raises_the_class_of_the_parts_when_both_are_at_rest(arms: Arms) -> None:
    with pytest.raises(motion.MoveTimeout) as caught:
        arms.verb(until="all")(arms.left, right_arm=arms.right, goal=NEAR, right_goal=FAR, time_limit="0.5 s")
    assert caught.value.command_list == "give_up"
    assert np.abs(arms.speeds()).max() < 1e-6


def test_a_part_that_fails_ends_all(arms: Arms) -> None:
    vi = arms.verb(until="all").asynch(arms.left, right_arm=arms.right, goal=NEAR, right_goal=FAR)
    arms.cell.advance("0.2 s")
    arms.right[0].disable()
    with pytest.raises(gpac.Terminated) as caught:
        vi.wait()
    assert caught.value.condition == "device_disabled"
    arms.cell.advance("1 s")
    assert np.abs(arms.left.values("commanded_velocity")).max() == 0.0 and keeps_to_its_limits(arms.left), "its servos brake the other arm"


def test_it_leads_on(arms: Arms) -> None:
    both = arms.verb(until="all")
    done = both >> motion.move_absolute.on(arms.slow[0])
    report: Any = gpac.compose("there_and_back", done, rename={"move_absolute.goal": "back"})(
        arms.left, right_arm=arms.right, goal=FAR, right_goal=NEAR, back=[0.0, 0.0]
    )
    assert report.condition == "arrived" and np.allclose(report.position, [0.0, 0.0], atol=0.01)
    assert np.allclose(arms.right.values("sensed"), NEAR, atol=0.01)


@pytest.mark.parametrize("until", ["any", "all"])
def test_who_follows_the_remedies_gets_a_verb(until: str) -> None:
    rename: dict[str, str] = {}
    for _ in range(5):
        try:
            made = gpac.together({"left": motion.move_absolute, "right": motion.move_absolute}, name="both", rename=rename, until=until)
            break
        except gpac.Error as error:
            remedies = [one.remedy for one in getattr(error, "errors", [error])]
            found = {name: new for remedy in remedies for name, new in re.findall(r"'([\w.]+)': '(\w+)'", remedy)}
            assert found and not {*found} & {*rename}, f"what was renamed is to be renamed again: {error}"
            rename.update(found)
    else:
        pytest.fail(f"five rounds of remedies were not enough: {rename}")
    assert "right_arm" in made.objects and made.initial == "start"


def test_what_cannot_be_awaited_is_refused() -> None:
    with pytest.raises(gpac.DefinitionError, match="until= must be 'any' or 'all', not 'both'; write until='any' or until='all'"):
        gpac.together(motion.move_absolute, name="one", until="both")
    with pytest.raises(gpac.CompositionConflict, match=r"all parts are awaited in 'start', but part 'home' .* proceeds to its list 'back'"):
        rename = {"home.arm": "other", "home.speed": "other_speed"}
        gpac.together({"move": motion.move_absolute, "home": motion.home}, name="both", rename=rename, until="all")
