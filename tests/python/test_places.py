# SPDX-License-Identifier: Apache-2.0
"""Every refusal names a line of the program, whatever is between the program and the refusal: this file, with the refused value."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager
from typing import Any

import pytest

import opengpac as gpac
from opengpac import activate, library, motion
from opengpac.cell import DigitalInput, DigitalOutput


def place_of(call: Callable[[], Any], line: str, kind: type[gpac.Error] = gpac.Error) -> gpac.Error:
    """Returns the error of a call, which names the line with that text."""
    with pytest.raises(kind) as caught:
        call()
    lines = inspect.getsource(inspect.getmodule(place_of)).splitlines()  # type: ignore[arg-type]
    for error in getattr(caught.value, "errors", [caught.value]):
        assert error.file == __file__, error
        assert line in lines[error.line - 1], (error, lines[error.line - 1])
    return caught.value


@contextmanager
def around(cell: gpac.System) -> Generator[None]:
    yield
    cell.svv("level", "flaot")  # left here


def test_contextlib_and_functools_are_no_programs(cell: gpac.System) -> None:
    def leave() -> None:
        with around(cell):
            pass

    def stack() -> None:
        with ExitStack() as ends:
            ends.callback(cell.svv, "level", "flaot")
            ends.pop_all().close()  # the stack itself

    place_of(leave, "# left here")
    place_of(functools.partial(cell.svv, "level", "flaot"), "call()")
    place_of(functools.cache(lambda: cell.svv("level", "flaot")), "functools.cache(")
    place_of(stack, "# the stack itself")


def test_a_verb_of_the_package_is_refused_where_it_is_applied(cell: gpac.System) -> None:
    fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
    drives = fast.processor.physical_device("drives", gpac.drivers.loopback("elbow"), exchange=fast)
    elbow = gpac.robots.Joint("elbow", drive=drives["elbow"], on=fast)

    def disabled() -> None:
        motion.move_velocity(elbow, 0.1)  # not enabled

    place_of(disabled, "# not enabled", gpac.NotEnabled)


def test_a_definition_of_the_package_is_refused_where_it_is_used(cell: gpac.System) -> None:
    fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
    io = fast.processor.physical_device("io", gpac.drivers.loopback("elbow"), exchange=fast)

    def one() -> None:
        DigitalOutput("valve", io["elbow.position"])  # a reading of a position

    def another() -> None:
        DigitalInput("gate", io["elbow.effort"])  # written

    place_of(one, "# a reading of a position")
    place_of(another, "# written")


def test_several_errors_have_a_place_each() -> None:
    with pytest.raises(gpac.InstallationErrors) as caught:
        gpac.Verb(
            "wrong",
            blocks={"pid": library.pid, "gain": library.gain},
            instantiation_parameters={"y": "pid.nothing", "u": "gain.nowhere"},
            command_lists={"start": [activate("pid", every="1 ms"), activate("gain")]},
        )
    assert len(caught.value.errors) > 1 and {error.file for error in caught.value.errors} == {__file__}


@pytest.mark.parametrize(
    ("refused", "said"),
    [
        (lambda cell: cell.svv("level", initial=float("nan")), "the initial value of SVV 'level' must be finite, not nan"),
        (lambda cell: setattr(cell.svv("level"), "value", float("inf")), "the value for SVV 'level' must be finite, not inf"),
        (lambda cell: setattr(cell.svv("level"), "value", None), "the value for SVV 'level' cannot be None"),
        (lambda cell: library.gain.run(u=[1.0], k=float("nan")), "'k' must be finite, not nan"),
        (lambda cell: library.gain.run(u=None), "input 'u' cannot be None"),
        (lambda cell: cell.processor("p").timer("t", period="-1 ms"), "the period of timer 't' cannot be -1 ms: its range is at least 0 s"),
        (
            lambda cell: cell.processor("p").timer("t", period="1 us"),
            "the period of source 'p.t' cannot be 0.001 ms, which is shorter than 10 us",
        ),
    ],
)
def test_a_refusal_names_the_value_and_whose_it_is(cell: gpac.System, refused: Callable[[gpac.System], Any], said: str) -> None:
    with pytest.raises(gpac.Error) as caught:
        refused(cell)
    assert caught.value.message == said and caught.value.file == __file__


def test_a_remedy_holds_that_is_followed() -> None:
    """The text that a message recommends works as it is written."""

    def cycle(**more: Any) -> gpac.Graph:
        cells = {"x": ["a.y", "b.u"], "z": ["b.y", "a.u"]}
        return gpac.Graph("cycle", blocks={"a": library.gain, "b": library.gain}, cells=cells, **more)

    def interval(**more: Any) -> gpac.Verb[..., Any]:
        cells = {"u": ["wave.y", "gain.u"]}
        lists = {"start": [activate("wave", every="1 ms"), activate("gain", every="2 ms")]}
        return gpac.Verb("interval", blocks={"wave": library.noise, "gain": library.gain}, cells=cells, command_lists=lists, **more)

    for definition in (cycle, interval):
        with pytest.raises(gpac.Error) as caught:
            definition()
        assert "{…" not in str(caught.value)
        definition(modes=eval(caught.value.remedy.split("modes=")[1]))
