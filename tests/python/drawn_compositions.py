# SPDX-License-Identifier: Apache-2.0
"""Random compositions of verbs that count, and commands that end one: observed from outside, nothing may begin afterwards that must not."""

from __future__ import annotations

import random
import signal
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import pytest

import opengpac as gpac
from opengpac import activate, deactivate, on, wait
from opengpac.application import progress, waiting
from rig import Rig

LEAVES = 6
Leaf = gpac.Verb[..., Any]


def leaf(
    rig: Rig, number: int, *, brakes: bool = True, loops: bool = False, uses: bool = False, enough: int = 4, if_cut_off: str | None = None
) -> Leaf:
    """Returns a leaf that counts into `y…` until `enough`. One that brakes counts into `b…` for 3 ms when it is ended; one that `uses`
    the joint `slide` ends if the joint is disabled or lost."""
    lists = {"start": [activate("count", every="1 ms")], "again": [activate("count", every="1 ms"), wait("2 ms")]}
    blocks = {"count": rig.block("count.count")}
    conditions = {"enough": on("count.enough", returns=[])}
    transitions: dict[tuple[str, str], str] = {}
    arguments, inputs = {f"y{number}": ["count.y"]}, {f"limit{number}": gpac.input("count.enough", default=enough)}
    if brakes:
        blocks["brake"] = rig.block("count.count")
        arguments[f"b{number}"] = ["brake.y"]
        inputs[f"way{number}"] = gpac.input("brake.enough", default=3)
        lists["stop"] = [activate("brake", every="1 ms")]
        conditions["stopped"] = on("brake.enough", returns=[], during="stop")
        for told in ("halted", "time_limit", *(["device_disabled", "device_lost"] if uses else [])):
            transitions |= {(begins, told): "stop" for begins in ("start", "again", "stop")}
    if loops:
        lists["start"] += [wait("2 ms"), deactivate("count")]
        lists["again"] += [deactivate("count")]
        transitions |= {("start", "completed"): "again", ("again", "completed"): "start"}
    else:
        del lists["again"]
        transitions = {key: to for key, to in transitions.items() if key[0] != "again"}
    return gpac.Verb(
        f"leaf{number}", blocks=blocks, objects={"slide": gpac.robots.Joint} if uses else {}, instantiation_parameters=arguments,
        input_parameters=inputs, command_lists=lists, conditions=conditions, transitions=transitions, initial="start",
        if_cut_off=if_cut_off,
    )  # fmt: skip


def of_svvs(rig: Rig, count: int = LEAVES) -> dict[str, gpac.SVV[Any]]:
    return {name: rig.cell.svv(name) for number in range(count) for name in (f"y{number}", f"b{number}")}


def arguments_of(verb: Leaf, svvs: dict[str, gpac.SVV[Any]]) -> list[gpac.SVV[Any]]:
    return [svvs[name] for name in verb.instantiation_parameters]


def work(svvs: dict[str, gpac.SVV[Any]], allowed: frozenset[int] = frozenset()) -> dict[str, float]:
    """Returns the counts of the parts that are not a declared recovery."""
    return {name: svv.value for name, svv in svvs.items() if name[0] == "y" and int(name[1:]) not in allowed}


class Drawn:
    """Random composition, and the leaves declared as the recovery after a halt. Leaves count `longer` times as far; the first leaf
    has the policy `if_cut_off`, which is then that of the composition."""

    def __init__(self, rig: Rig, rng: random.Random, devices: random.Random | None, longer: int = 1, if_cut_off: str | None = None) -> None:
        self.rig, self.rng, self.devices, self.longer, self.if_cut_off = rig, rng, devices, longer, if_cut_off
        self.free = list(range(LEAVES))
        rng.shuffle(self.free)
        self.recovery: set[int] = set()
        self.count = 0
        self.verb = self.draw(3).on(rig.fast)

    @property
    def uses_a_device(self) -> bool:
        """True if a leaf uses a device."""
        return bool(self.verb.objects)

    def leaf(self) -> Leaf:
        rng, uses = self.rng, self.devices is not None and self.devices.random() < 0.4
        brakes, loops, enough = rng.random() < 0.7, rng.random() < 0.2, rng.randint(2, 12) * self.longer
        policy, self.if_cut_off = self.if_cut_off, None
        return leaf(self.rig, self.free.pop(), brakes=brakes, loops=loops, uses=uses, enough=enough, if_cut_off=policy)

    def name(self) -> str:
        self.count += 1
        return f"drawn{self.count}"

    def draw(self, depth: int) -> Leaf:
        rng = self.rng
        kind = rng.choice(["leaf", "chain", "chain", "loop", "together", "recovery"]) if depth and len(self.free) > 2 else "leaf"
        if kind == "leaf":
            return self.leaf()
        first = self.draw(depth - 1)
        if not self.free:
            return first
        if kind == "recovery":
            number = self.free[-1]
            after = leaf(self.rig, self.free.pop(), brakes=rng.random() < 0.5, enough=rng.randint(2, 6))
            if first.conditions.keys() and not any(condition == "halted" for _, condition in first.transitions):
                self.recovery.add(number)
                return gpac.compose(self.name(), {"a": first, "r": after}, transitions={("a", None): "r", ("a", "halted"): "r"})
            return gpac.compose(self.name(), {"a": first, "r": after}, transitions={("a", None): "r"})
        second = self.draw(depth - 1)
        parts = {"a": first, "b": second}
        if kind == "together":
            return gpac.together(parts, name=self.name(), until=rng.choice(["any", "all"]))
        back = {("b", None): "a"} if kind == "loop" else {}
        return gpac.compose(self.name(), parts, transitions={("a", None): "b", **back})

    def labels(self) -> dict[str, str]:
        """Returns the leaf behind each label of a list, `a.b.r`."""
        found: dict[str, str] = {}

        def walk(verb: Leaf, label: str) -> None:
            if not verb.parts:
                found[label] = verb.name
            for name, part in verb.parts.items():
                walk(part, f"{label}.{name}" if label else name)

        walk(self.verb, "")
        return found


# ---- ways to end ----

ENDS = ("halt", "time_limit", "suspended", "paused", "emergency_stop", "stop_while_it_halts", "halted twice", "ctrl_c")
"""Ways to end any instance."""
ENDS_OF_MACHINES = ("stop_input", "aborted")
"""Ways to end any instance in a system that has `Slides`.

By the stop categories of IEC 60204-1, an emergency stop by a call, by an input, or over a halt that still brakes is category 0;
`disabled` is category 1, because the verbs brake before the device is off; a halt and a suspension are category 2."""
ENDS_OF_DEVICES = ("disabled", "disabled_while_it_halts", "device_lost")
"""Ways to end an instance that uses a device."""
STOPS = ("emergency_stop", "stop_input", "stop_while_it_halts")
"""Ways that latch the emergency stop."""
ALLOWED = {
    "emergency_stop": {"emergency_stop"}, "stop_input": {"emergency_stop"}, "disabled": {"device_disabled"}, "aborted": {"aborted"},
    "stop_while_it_halts": {"emergency_stop", "halted", "stopped", "completed"},
    "disabled_while_it_halts": {"device_disabled", "halted", "stopped", "completed"},
    "device_lost": {"device_lost", "stopped", "completed"}, "time_limit": {"time_limit", "stopped", "halted", "completed"},
}  # fmt: skip
"""End conditions allowed for each way; `halted` for all others."""
SEEN_LATE = ("device_lost", "stop_input")
"""Ways in which the machine ends an instance, which may have ended normally before that."""
HALTING = {"stop_while_it_halts", "disabled_while_it_halts", "aborted"}
"""Ways in `ALLOWED` that begin like a halt, so that the recovery after a halt may begin."""
LOST_MS = 150
"""Time from the opening of the failing device to its loss."""


class Counts(gpac.LogicalDevice, name="Counts that give way", arbitration="abort"):
    """SVVs of all leaves whose verb ends with `aborted` when another one needs them."""

    y0, y1, y2, y3, y4, y5 = (gpac.svv() for _ in range(LEAVES))
    b0, b1, b2, b3, b4, b5 = (gpac.svv() for _ in range(LEAVES))


class Slides:
    """Machines of the random compositions: two joints, one whose device stays and one whose device is lost `LOST_MS` after it was
    opened; an input of the emergency stop that a verb presses; and SVVs that give way."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self.counts = Counts("counts", system=rig.cell)
        channels = [
            {"name": "press", "direction": "write", "type": "bool"},
            {"name": "pressed", "direction": "read", "type": "bool", "loop_of": "press"},
        ]
        self._button = rig.rtp.physical_device("button", gpac.drivers.scripted(channels), exchange=rig.fast)
        rig.cell.emergency_stop_input(self._button["pressed"])
        self._press = gpac.Verb(
            "pressing",
            blocks={"set": gpac.library.set_digital(value=True), "write": gpac.library.write_digital},
            instantiation_parameters={"press": "write.channel"},
            cells={"level": ["set.y", "write.u"]},
            command_lists={"start": [activate("set", every="1 ms"), activate("write", every="1 ms")]},
        ).on(rig.fast)
        self.holds = self._joint("holds", None)
        self.fails = self._joint("fails", f"{LOST_MS} ms")
        self._opened = rig.cell.now

    def _joint(self, name: str, fail_at: str | None) -> gpac.robots.Joint:
        device = self.rig.rtp.physical_device(f"{name}-drive", gpac.drivers.loopback("x", fail_at=fail_at), exchange=self.rig.fast)
        return gpac.robots.Joint(name, drive=device["x"], on=self.rig.fast, kp=50.0, kd=0.0)

    def press(self) -> None:
        """Presses the emergency stop until it is latched; then the output is safe, so that the input is released."""
        pressing = self._press.asynch(self._button["press"])
        self.rig.cell.advance(until=lambda: self.rig.cell.statistics["emergency"], within="20 ms")
        pressing.delete()

    def yielding(self) -> dict[str, gpac.SVV[Any]]:
        """Returns the SVVs of all leaves that give way."""
        self.counts.enable()
        return {f"{kind}{number}": getattr(self.counts, f"{kind}{number}") for number in range(LEAVES) for kind in "yb"}

    def ready(self, how: str, at_ms: float) -> gpac.robots.Joint:
        """Returns an enabled joint; if its device is to be lost, it will be lost about `at_ms` later."""
        if how != "device_lost":
            return self.holds.enable()
        self.rig.cell.advance(f"{LOST_MS} ms")
        opened = self.rig.cell.now
        self.rig.cell.reset()
        self.fails.enable()
        self.rig.cell.advance(opened + (LOST_MS - at_ms) * 1e-3 - self.rig.cell.now)
        return self.fails


@contextmanager
def ctrl_c_after(cell: gpac.System, wait_for: str, told: Callable[[], None]) -> Iterator[None]:
    """Presses Ctrl-C in the first wait inside, after a time of the virtual clock; `told` runs right before it."""

    def pressed(*arguments: Any) -> Any:
        patched.undo()
        cell.advance(wait_for)
        told()
        signal.raise_signal(signal.SIGINT)

    with pytest.MonkeyPatch.context() as patched:
        # The call returns to Python after its first step.
        patched.setattr(progress, "SLICE_NS", 1)
        patched.setattr(waiting, "_wait", pressed)
        yield


def tell(rig: Rig, vi: gpac.VerbInstance[Any], how: str, slide: gpac.robots.Joint | None) -> None:
    """Ends an instance in the given way; a time limit was set at its start, and a device is lost by itself."""
    if how == "suspended":
        vi.suspend()
    elif how == "paused":
        rig.cell.pause()
    if how == "emergency_stop":
        rig.cell.emergency_stop("a test")
    elif how == "disabled":
        assert slide is not None
        slide.disable()
    elif how not in ("time_limit", "aborted", *SEEN_LATE):
        vi.halt()
    if how == "halted twice" and not vi.done:
        vi.halt()
    if how == "stop_while_it_halts":
        rig.cell.advance("1 ms")
        rig.cell.emergency_stop("a test")
    if how == "disabled_while_it_halts":
        assert slide is not None
        rig.cell.advance("1 ms")
        slide.disable()
    if how == "paused":
        rig.cell.resume()


class Trial:
    """Random composition that is ended at random instants. `told` counts the ways in which it was ended while it ran."""

    def __init__(
        self, rig: Rig, svvs: dict[str, gpac.SVV[Any]], seed: int, slides: Slides | None = None, if_cut_off: str | None = None
    ) -> None:
        self.rig, self.slides, self.svvs, self.seed = rig, slides, svvs, seed
        self.rng, self.told = random.Random(seed), Counter[str]()
        self.drawn = Drawn(rig, self.rng, random.Random(seed + 1) if slides else None, if_cut_off=if_cut_off)

    def try_ends(self, ends: Sequence[str] = ()) -> None:
        """Ends the composition in four ways, or in the given ones."""
        machines = ENDS_OF_MACHINES if self.slides else ()
        kinds = [*ENDS, *machines, *(ENDS_OF_DEVICES if self.drawn.uses_a_device else ())]
        for how in ends or self.rng.sample(kinds, 4):
            self.try_end(how, self.rng.randint(0, 25) + 0.5)

    def try_end(self, how: str, at_ms: float) -> None:
        """Starts the composition, ends it after `at_ms`, and checks whether anything begins."""
        cell = self.rig.cell
        slide = self.slides.ready(how, at_ms) if self.slides and self.drawn.uses_a_device else None
        svvs = self.slides.yielding() if self.slides and how == "aborted" else self.svvs
        given = [*([slide] if slide else []), *arguments_of(self.drawn.verb, svvs)]
        where = f"seed {self.seed}, {how} at {at_ms} ms: {self.drawn.verb!r}"
        # Only a halt leads to the recovery declared for one.
        endings = frozenset(self.drawn.recovery) if how in HALTING or how not in ALLOWED else frozenset[int]()
        taken = [*self.drawn.verb.instantiation_parameters][-1]
        if how == "aborted" and taken[0] == "y":
            endings |= {int(taken[1:])}
        counted: list[dict[str, float]] = []
        count = lambda: counted.append(work(svvs, endings))  # noqa: E731
        if how == "ctrl_c":
            self._press(given, at_ms, count)
        else:
            vi = self.drawn.verb.new_instance(*given)
            vi.start(**({"time_limit": f"{at_ms} ms"} if how == "time_limit" else {}))
            cell.advance(f"{at_ms} ms")
            if how == "device_lost" and slide is not None:
                cell.advance(until=lambda: slide.state == "fault", within="20 ms")
            if how == "stop_input" and self.slides:
                self.slides.press()
            if how in SEEN_LATE or not vi.done:
                count()
                if how == "aborted":
                    self._take_over(svvs[taken])
                tell(self.rig, vi, how, slide)
            cell.advance("40 ms")
            assert vi.report is not None, where
            expected = ALLOWED.get(how, {"halted", "stopped", "completed"})
            if how in SEEN_LATE and vi.report.normal and vi.report.time < (at_ms + (1.0 if how == "device_lost" else 20.0)) * 1e-3:
                # The composition had ended before, or in the same firing.
                counted.clear()
            assert not counted or vi.report.condition in expected, (where, vi.report, vi.report.way)
            self._shown(vi.report, where)
            vi.delete()
        for _ in range(2):
            cell.advance("20 ms")
            assert not counted or work(svvs, endings) == counted[0], where
            if cell.statistics["emergency"]:
                cell.reset()
        self.told[how] += len(counted)

    def _take_over(self, svv: gpac.SVV[Any]) -> None:
        """Starts another verb that needs an SVV of the composition: it begins when the composition has come to rest."""
        late = self.rig.counting("late").on(self.rig.fast).asynch(svv, limit=2)
        self.rig.cell.advance("40 ms")
        assert late.wait().last == 2, f"seed {self.seed}: the verb that takes over begins"

    def _shown(self, report: gpac.Report, where: str) -> None:
        """Checks that the verb's table contains the path taken."""
        rows = {(name, condition): outcome for name, condition, outcome in self.drawn.verb.table()}
        lists = [*(passed.command_list for passed in report.way), report.command_list]
        for passed, to in zip(report.way, lists[1:], strict=True):
            # An abort has the transitions of a halt.
            condition = "halted" if passed.condition == "aborted" else passed.condition
            assert rows[passed.command_list, condition] == f"→ {to}", (where, passed, to)

    def try_close(self) -> bool:
        """Starts the composition and closes the system while it runs; returns false if it had ended before. The report describes the
        path to its end."""
        at_ms = self.rng.randint(0, 25) + 0.5
        slide = [self.slides.ready("close", at_ms)] if self.slides and self.drawn.uses_a_device else []
        vi = self.drawn.verb.new_instance(*slide, *arguments_of(self.drawn.verb, self.svvs)).start()
        self.rig.cell.advance(f"{at_ms} ms")
        if vi.done:
            return False
        self.rig.cell.close()
        where = f"seed {self.seed}, closed at {at_ms} ms: {vi.report}, {vi.report and vi.report.way}: {self.drawn.verb!r}"
        assert vi.report is not None and vi.report.condition in {"halted", "stopped", "completed"}, where
        conditions = [passed.condition for passed in vi.report.way]
        begun = conditions.index("halted") + 1 if "halted" in conditions else len(conditions)
        lists = [passed.command_list for passed in vi.report.way[begun:]] + ([vi.report.command_list] if "halted" in conditions else [])
        # The lists of several parts may be merged, so that only the blocks tell whose work a list begins.
        begins = {command["block"] for name in lists for command in self.drawn.verb.command_lists[name] if command["command"] == "activate"}
        labels = self.drawn.labels()
        counting = {labels[block.removesuffix(".count")] for block in begins if block.endswith(".count")}
        assert counting <= {f"leaf{number}" for number in self.drawn.recovery}, where
        return True

    def _press(self, given: Sequence[Any], at_ms: float, told: Callable[[], None]) -> None:
        with ctrl_c_after(self.rig.cell, f"{at_ms} ms", told):
            try:
                self.drawn.verb(*given)
            except KeyboardInterrupt:
                return


def drawn_trial(
    rig: Rig, svvs: dict[str, gpac.SVV[Any]], seed: int, slides: Slides | None = None, if_cut_off: str | None = None
) -> Trial | None:
    """Returns a trial of a random composition, with devices if there are slides; `None` if the model refuses it."""
    try:
        trial = Trial(rig, svvs, seed, slides, if_cut_off)
        slide = [slides.holds] if slides and trial.drawn.uses_a_device else []
        trial.drawn.verb.new_instance(*slide, *arguments_of(trial.drawn.verb, svvs)).delete()
    except gpac.Error:
        return None
    return trial
