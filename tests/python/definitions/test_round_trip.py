# SPDX-License-Identifier: Apache-2.0
"""Definitions are unchanged after saving and loading: those of the library, the examples, the graphs of the mappings, and random ones."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import opengpac as gpac
from definitions.library import EXAMPLES, examples, packaged
from definitions.same import reloaded, said
from mappings.graph import Stage, verb_of
from mappings.graphs import GRAPHS
from opengpac import library as lib

ENDINGS = ("toml", "json")


@pytest.mark.parametrize("ending", ENDINGS)
def test_every_definition_of_the_package(tmp_path: Path, ending: str) -> None:
    known = {id(definition): definition for definition in packaged()}
    assert len(known) >= 15
    for number, definition in enumerate(known.values()):
        assert said(reloaded(definition, tmp_path / f"{number}.{ending}")) == said(definition), definition.name


def test_no_example_is_refused_and_every_definition_of_theirs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The programs are followed once for both file formats, because that takes most of the time."""
    monkeypatch.syspath_prepend(str(EXAMPLES))
    known = {id(definition): definition for definition in examples()}
    for ending in ENDINGS:
        for number, definition in enumerate(known.values()):
            assert said(reloaded(definition, tmp_path / f"{number}.{ending}")) == said(definition), (definition.name, ending)
    assert len(known) >= 20


@pytest.mark.parametrize("ending", ENDINGS)
def test_every_graph_of_the_mappings(tmp_path: Path, ending: str, built: dict[str, str]) -> None:
    for name, entry in GRAPHS.items():
        with gpac.System(f"saved {name}", clock="virtual") as cell:
            stage = Stage(cell, built)
            verb, _ = verb_of(stage, name, entry.make(stage))
            assert said(reloaded(verb, tmp_path / f"{name}.{ending}")) == said(verb), name


# ---- random definitions ----

NAMES = st.text(st.characters(blacklist_characters=".", blacklist_categories=("Cs", "Cc")), min_size=1, max_size=8).filter(
    lambda name: name.isprintable() and bool(name.strip())
)
TEXTS = st.text(st.characters(blacklist_characters="\0", blacklist_categories=("Cs",)), max_size=30)
NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
TIMES = st.integers(1, 10**12)
VALUES = st.recursive(
    st.booleans() | st.integers(-(2**63), 2**63 - 1) | NUMBERS | TEXTS, lambda inner: st.lists(inner, max_size=3), max_leaves=4
)
LAYOUTS = st.dictionaries(TEXTS, st.dictionaries(st.sampled_from(["x", "y"]), st.integers(-(10**6), 10**6)), max_size=3)


@st.composite
def chains(draw: st.DrawFn, depth: int = 1) -> gpac.Graph:
    """Draws a chain of gains, filters and nested graphs, with random names, texts and constants."""
    labels = draw(st.lists(NAMES, min_size=1, max_size=4, unique=True))
    blocks: dict[str, Any] = {}
    for label in labels:
        if depth and draw(st.booleans()):
            blocks[label] = draw(chains(depth - 1))
        elif draw(st.booleans()):
            blocks[label] = lib.block("gain")(k=draw(NUMBERS | st.just("30 %")))
        else:
            blocks[label] = lib.block("lowpass")
    inner = [(a, b) for a, b in pairwise(labels)]
    graph = gpac.Graph(
        draw(NAMES),
        blocks=blocks,
        inputs={"u": f"{labels[0]}.u"},
        outputs={"y": f"{labels[-1]}.y"},
        cells={f"c{n}": [f"{a}.y", f"{b}.u"] for n, (a, b) in enumerate(inner)},
        modes={f"{b}.u": draw(st.sampled_from(["asynchronous", gpac.ratio(3)])) for _, b in inner[:1]},
        divide={label: draw(st.integers(1, 9)) for label in labels[:1]} if draw(st.booleans()) else {},
        doc=draw(TEXTS),
    )
    graph.layout = draw(LAYOUTS)
    return graph


@st.composite
def commands(draw: st.DrawFn, label: str) -> gpac.Command:
    """Draws any command on a block that its inputs drive."""
    plain = [gpac.install(label), gpac.install(label, "wave"), gpac.execute("wave"), gpac.deactivate(label), gpac.wait(), gpac.ready()]
    activated = st.none() | TIMES
    return draw(
        st.sampled_from([*plain, gpac.wait("watch.limited"), gpac.wait(["watch.limited", "watch.limited"])])
        | TIMES.map(lambda ns: {"command": "wait", "time_ns": ns})
        | activated.map(lambda ns: {"command": "activate", "block": label, "every_ns": None, "tunable": False, "budget_ns": ns})
    )


class Alarmed(gpac.Terminated):
    """Exception class of a program."""


@st.composite
def verbs(draw: st.DrawFn) -> gpac.Verb[..., Any]:
    """Draws a verb around a signal and a chain, with random lists, conditions and inputs."""
    label = draw(NAMES.filter(lambda name: name not in ("wave", "watch")))
    lists = draw(st.lists(NAMES, min_size=2, max_size=3, unique=True))
    begun = [
        {
            "command": "activate",
            "block": "wave",
            "every_ns": draw(TIMES),
            "tunable": draw(st.booleans()),
            "budget_ns": draw(st.none() | TIMES),
        },
        gpac.activate("watch"),
    ]
    raises = st.sampled_from([None, Alarmed, gpac.Terminated])
    driven = {"u": ["wave.y", f"{label}.u", "watch.u"]}
    private = draw(st.booleans())
    verb = gpac.Verb(
        draw(NAMES),
        doc=draw(TEXTS),
        blocks={"wave": lib.block("signal_generator")(shape=1), label: draw(chains()), "watch": lib.block("limit")},
        command_lists={name: [*begun, *draw(st.lists(commands(label), max_size=4))] for name in lists},
        cells=driven if private else {},
        instantiation_parameters={} if private else driven,
        input_parameters={
            "level": gpac.input("wave.offset", default=draw(NUMBERS), tunable=draw(st.booleans()), within=(-1.0, draw(NUMBERS))),
            "size": draw(st.sampled_from(["wave.amplitude", ["wave.amplitude", "wave.phase"]])),
            "phase": gpac.input("wave.duty", unit="", default=draw(st.none().map(lambda _: "50 %") | NUMBERS)),
        },
        output_values={"last": "watch.u"},
        conditions={
            "above": gpac.on(
                "watch.limited", returns=["last"], raises=draw(raises), priority=draw(st.integers(-9, 9)),
                alarm=draw(st.sampled_from([None, "E1"])),
            ),
            "time_limit": gpac.on(raises=draw(raises), during=draw(st.sampled_from([None, lists[0], lists]))),
        },
        transitions={(a, "halted"): b for a, b in pairwise(lists)},
        initial=lists[0],
        ending_limit=draw(st.sampled_from([None, "2 s", "1500 ms", 0.25])),
        suspend=draw(st.sampled_from(["idle", "hold", "hold_last", "safe"])),
        if_cut_off=draw(st.sampled_from([None, "continue", "safe"])),
        manual=draw(st.booleans()),
    )  # fmt: skip
    verb.layout = draw(LAYOUTS)
    return verb


@settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(graph=chains(2), ending=st.sampled_from(ENDINGS))
def test_random_graphs(tmp_path: Path, graph: gpac.Graph, ending: str) -> None:
    path = tmp_path / f"graph.{ending}"
    path.unlink(missing_ok=True)
    assert said(reloaded(graph, path)) == said(graph)


@settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(verb=verbs(), ending=st.sampled_from(ENDINGS))
def test_random_verbs(tmp_path: Path, verb: gpac.Verb[..., Any], ending: str) -> None:
    path = tmp_path / f"verb.{ending}"
    path.unlink(missing_ok=True)
    assert said(reloaded(verb, path)) == said(verb)
