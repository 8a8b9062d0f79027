# SPDX-License-Identifier: Apache-2.0
"""Pictures of graphs and verbs: their contents, no overlaps, and the same result each time."""

from __future__ import annotations

import itertools
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

import opengpac as gpac
from opengpac import activate, execute, motion, on, wait
from opengpac import library as lib

Element = ElementTree.Element


def parsed(picture: str) -> Element:
    return ElementTree.fromstring(picture)


def of(picture: Element, what: str) -> dict[str, Element]:
    """Returns the elements of one kind, by the object that each represents."""
    return {e.attrib[f"data-{what}"]: e for e in picture.iter() if f"data-{what}" in e.attrib}


def words(element: Element) -> list[str]:
    return [e.text or "" for e in element.iter() if e.tag.endswith("}text")]


def extent(element: Element) -> tuple[float, float, float, float]:
    """Returns left, top, right and bottom of the last box in an element, which is drawn over the others."""
    box = max((e for e in element.iter() if e.tag.endswith("}rect")), key=lambda e: float(e.attrib["height"]))
    x, y, width, height = (float(box.attrib[name]) for name in ("x", "y", "width", "height"))
    return x, y, x + width, y + height


def apart(elements: list[Element]) -> bool:
    pairs = itertools.combinations(map(extent, elements), 2)
    return all(a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1] for a, b in pairs)


def smooth() -> gpac.Graph:
    return gpac.Graph(
        "smooth",
        blocks={"gain": lib.gain(k=2.0), "filter": lib.lowpass},
        inputs={"u": "gain.u"},
        outputs={"y": "filter.y"},
        cells={"scaled": ["gain.y", "filter.u"]},
    )


def loop() -> gpac.Graph:
    return gpac.Graph(
        "loop",
        blocks={"law": lib.pid(kp=2.0), "plant": lib.lowpass, "sensor": smooth()},
        inputs={"goal": "law.setpoint"},
        outputs={"y": ["plant.y", "sensor.u"]},
        cells={"effort": ["law.effort", "plant.u"], "measured": ["sensor.y", "law.measured"]},
        modes={"law.measured": "asynchronous"},
    )


def test_a_graph_shows_its_blocks_ports_and_wires() -> None:
    picture = parsed(smooth()._repr_svg_())
    assert [*of(picture, "block")] == ["gain", "filter"]
    assert {*of(picture, "pin")} == {"in u", "out y"}
    assert {*of(picture, "wire")} == {"u gain.u", "gain.y filter.u", "filter.y y"}
    gain = words(of(picture, "block")["gain"])
    assert gain[:2] == ["gain", "library.gain"] and "k = 2.0" in gain
    assert words(of(picture, "pin")["in u"]) == ["u", "double"]
    assert "scaled" in words(picture)


def test_blocks_stand_in_the_order_of_the_flow_and_apart() -> None:
    blocks = of(parsed(loop().svg()), "block")
    lefts = [extent(blocks[label])[0] for label in ("law", "plant", "sensor")]
    assert lefts == sorted(lefts)
    assert apart([*blocks.values()])


def test_what_leads_back_and_what_is_asynchronous_is_seen() -> None:
    wires = of(parsed(loop().svg()), "wire")
    back = wires["sensor.y law.measured"]
    assert back.attrib["data-mode"] == "asynchronous"
    path = next(e for e in back.iter() if e.tag.endswith("}path"))
    assert "asynchronous" in path.attrib["class"].split()
    numbers = [float(n) for n in re.findall(r"-?\d+\.\d+", path.attrib["d"])]
    assert numbers[-2] < numbers[0], "it ends to the left of where it begins"
    assert wires["law.effort plant.u"].attrib["data-mode"] == "synchronous"


def test_a_nested_graph_is_one_box_that_names_what_is_in_it() -> None:
    shown = words(of(parsed(loop().svg()), "block")["sensor"])
    assert "graph smooth" in shown and "of gain, filter" in shown


def test_units_and_modes_of_ports_are_readable() -> None:
    graph = gpac.Graph(
        "near",
        blocks={"near": lib.in_position},
        inputs={"goal": "near.goal", "sensed": "near.sensed"},
        modes={"near.goal": "asynchronous"},
    )
    item = lib.in_position.inputs["goal"]
    shown = words(of(parsed(graph.svg()), "block")["near"])
    assert f"{item.type}{' ' + item.unit if item.unit else ''} asynchronous" in shown


def test_a_graph_of_many_blocks_has_every_wire_and_no_box_over_another() -> None:
    labels = [f"b{n}" for n in range(30)]
    cells = {f"c{n}": [f"b{n}.y", *(f"b{m}.u" for m in (2 * n + 1, 2 * n + 2) if m < 30)] for n in range(15)}
    outputs = {f"y{n}": f"b{n}.y" for n in range(15, 30)}
    graph = gpac.Graph("tree", blocks=dict.fromkeys(labels, lib.gain), inputs={"u": "b0.u"}, outputs=outputs, cells=cells)
    picture = parsed(graph.svg())
    assert len(of(picture, "wire")) == 1 + 29 + 15
    assert apart([*of(picture, "block").values(), *of(picture, "pin").values()])


def test_a_verb_shows_lists_transitions_and_ends() -> None:
    verb = motion.home
    picture = parsed(verb._repr_svg_())
    assert [*of(picture, "list")] == [*verb.command_lists]
    changes = {*of(picture, "change")}
    assert {f"list {name} list {to}" for (name, _), to in verb.transitions.items()} <= changes
    assert "raises HomingFailed" in of(picture, "end")
    boxes = [*of(picture, "list").values(), *of(picture, "end").values()]
    assert apart(boxes)
    for condition in {c for _, c, _ in verb.table()}:
        assert condition in words(picture)


def test_commands_are_shown_as_they_were_written() -> None:
    verb = gpac.Verb(
        "rise",
        blocks={"wave": lib.signal_generator, "high": lib.comparator},
        instantiation_parameters={"y": ["wave.y", "high.u"]},
        command_lists={"start": [execute("wave"), activate("wave", every="20 ms"), activate("high"), wait("high.rose"), wait("0.5 s")]},
    )
    lines = words(of(parsed(verb.svg()), "list")["start"])
    assert lines == ["start", "execute wave", "activate wave every 20 ms", "activate high", "wait high.rose", "wait 500 ms"]
    assert [*of(parsed(verb.svg()), "end")] == ["ends"], "with no table of conditions it ends when it is through"


def test_a_cycle_of_lists_is_drawn_both_ways() -> None:
    verb = gpac.Verb(
        "swing",
        blocks={"wave": lib.signal_generator, "high": lib.comparator},
        instantiation_parameters={"y": ["wave.y", "high.u"]},
        command_lists={name: [activate("wave", every="1 ms"), activate("high")] for name in ("up", "down")},
        conditions={"top": on("high.rose"), "bottom": on("high.fell")},
        transitions={("up", "top"): "down", ("down", "bottom"): "up"},
        initial="up",
    )
    changes = of(parsed(verb.svg()), "change")
    assert {"list up list down", "list down list up"} <= {*changes}


def test_texts_are_escaped() -> None:
    graph = gpac.Graph("a < b & c", blocks={"gain": lib.gain}, inputs={"u": "gain.u"}, outputs={"y": "gain.y"}, doc='"<script>"')
    picture = graph.svg()
    assert "<script>" not in picture
    assert parsed(picture).attrib["aria-label"] == "data flow graph a < b & c"


def test_the_same_definition_gives_the_same_picture_and_looks_of_a_page_are_left_alone() -> None:
    assert loop().svg() == loop().svg()
    assert motion.home.svg() == motion.home.svg()
    style = next(e.text or "" for e in parsed(loop().svg()).iter() if e.tag.endswith("}style"))
    assert "prefers-color-scheme:dark" in style
    rules = re.findall(r"([^{}]+)\{[^{}]*\}", style.replace("@media (prefers-color-scheme:dark){", ""))
    assert rules and all(rule.strip("} ").startswith(".opengpac-picture ") for rule in rules)


def test_a_picture_is_saved_whole(tmp_path: Path) -> None:
    file = smooth().save_svg(tmp_path / "smooth.svg")
    assert file.read_text() == smooth().svg()
    with pytest.raises(gpac.FileFailed, match=r"cannot write the picture"):
        smooth().save_svg(tmp_path / "nowhere" / "smooth.svg")
