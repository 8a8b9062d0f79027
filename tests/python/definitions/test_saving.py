# SPDX-License-Identifier: Apache-2.0
"""The text of a saved file, and the preservation of a person's edits."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import opengpac as gpac
from definitions.same import said
from opengpac import activate, execute, on, wait
from opengpac import library as lib


class Collision(gpac.Terminated):
    """Exception that a program defines."""


smooth = gpac.Graph(
    "smooth",
    blocks={"gain": lib.gain(k=2.0), "filter": lib.lowpass},
    inputs={"u": "gain.u"},
    outputs={"y": "filter.y"},
    cells={"scaled": ["gain.y", "filter.u"]},
    doc="Gain, then a filter.",
)

watch = gpac.Verb(
    "watch",
    blocks={"wave": lib.signal_generator(shape=1), "smooth": smooth, "limit": lib.limit},
    cells={"raw": ["wave.y", "smooth.u"], "clean": ["smooth.y", "limit.u"]},
    instantiation_parameters={"out": "limit.y"},
    input_parameters={"level": gpac.input("wave.offset", default=0.5, tunable=True)},
    output_values={"last": "limit.y"},
    command_lists={
        "start": [execute("wave"), activate("wave", every="20 ms"), activate("smooth"), activate("limit"), wait("0.5 s")],
        "rest": [activate("wave", every="1.5 ms", budget="250 us"), activate("smooth"), activate("limit")],
    },
    conditions={"reached": on("limit.limited", returns=["last"]), "halted": on(raises=Collision)},
    transitions={("start", "reached"): "rest"},
    initial="start",
)

EXPECTED = """\
format = "opengpac-definitions"
version = 1

[graphs.smooth]
doc = "Gain, then a filter."

[graphs.smooth.blocks]
gain = { block = "library.gain", constants = { k = 2.0 } }
filter = "library.lowpass"

[graphs.smooth.inputs]
u = "gain.u"

[graphs.smooth.outputs]
y = "filter.y"

[graphs.smooth.cells]
scaled = ["gain.y", "filter.u"]

[verbs.watch]
initial = "start"
transitions = [
  { from = "start", condition = "reached", to = "rest" },
]

[verbs.watch.blocks]
wave = { block = "library.signal_generator", constants = { shape = 1 } }
smooth = "smooth"
limit = "library.limit"

[verbs.watch.instantiation_parameters]
out = "limit.y"

[verbs.watch.cells]
raw = ["wave.y", "smooth.u"]
clean = ["smooth.y", "limit.u"]

[verbs.watch.input_parameters]
level = { targets = "wave.offset", default = 0.5, tunable = true }

[verbs.watch.output_values]
last = "limit.y"

[verbs.watch.command_lists]
start = [
  { execute = "wave" },
  { activate = "wave", every = "20 ms" },
  { activate = "smooth" },
  { activate = "limit" },
  { wait = "500 ms" },
]
rest = [
  { activate = "wave", every = "1.5 ms", budget = "250 us" },
  { activate = "smooth" },
  { activate = "limit" },
]

[verbs.watch.conditions]
reached = { on = "limit.limited", returns = "last" }
halted = { raises = "MODULE:Collision" }
"""


def test_a_file_reads_as_a_person_would_write_it(tmp_path: Path) -> None:
    watch.save(tmp_path / "watch.toml")
    assert (tmp_path / "watch.toml").read_text() == EXPECTED.replace("MODULE", __name__)


def test_what_is_saved_twice_is_the_same_text(tmp_path: Path) -> None:
    for ending in ("toml", "json"):
        path = tmp_path / f"watch.{ending}"
        watch.save(path)
        before = path.read_text()
        gpac.load(path, raises=[Collision]).watch.save(path)
        assert path.read_text() == before


def test_a_loaded_verb_is_called_like_any_other(tmp_path: Path) -> None:
    hum = gpac.Verb(
        "hum",
        blocks={"wave": lib.signal_generator(shape=0)},
        instantiation_parameters={"out": "wave.y"},
        input_parameters={"level": gpac.input("wave.offset", default=0.5)},
        command_lists={"start": [activate("wave", every="1 ms")]},
        conditions={"time_limit": on(raises=Collision)},
    )
    hum.save(tmp_path / "hum.toml")
    loaded = gpac.load(tmp_path / "hum.toml", raises={"Collision": Collision})
    assert [*loaded] == ["hum"] and "hum" in repr(loaded)
    with gpac.System("loaded", clock="virtual") as cell:
        fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        out = cell.svv("out", "double")
        with pytest.raises(Collision):
            loaded.hum.on(fast)(out, level=0.75, time_limit="10 ms")
        assert out.value == 0.75


EDITED = """\
# The filter of the press.
format = "opengpac-definitions"
version = 1
description = "smoothing"   # what it is for

[graphs.smooth]
blocks.filter = "library.lowpass"                          # first order
blocks.gain = { block = "library.gain", constants = { k = 2.0 } }   # found by trying

# Ports
inputs = { u = ["gain.u"] }
outputs.y = "filter.y"
doc = "Gain, then a filter."

[graphs.smooth.cells]
scaled = [
  "gain.y",    # writes
  "filter.u",
]

[verbs.tick]
# begins at once
command_lists.start = [
  { command = "activate", block = "wave", every_ns = 1000000 },  # every ms
]
[verbs.tick.blocks.wave]
block = "library.signal_generator"
constants = { shape = 1 }
"""


def test_comments_and_order_stay_where_nothing_changes(tmp_path: Path) -> None:
    path = tmp_path / "edited.toml"
    path.write_text(EDITED)
    loaded = gpac.load(path)
    loaded.smooth.save(path)
    loaded.tick.save(path)
    assert path.read_text() == EDITED


def test_a_value_changes_in_its_line(tmp_path: Path) -> None:
    path = tmp_path / "edited.toml"
    path.write_text(EDITED)
    graph = gpac.load(path).smooth.replace("gain", lib.gain(k=3.5))
    graph.save(path)
    assert path.read_text() == EDITED.replace("k = 2.0", "k = 3.5")
    assert said(gpac.load(path).smooth) == said(graph)


def test_a_new_wire_and_a_new_definition_leave_the_rest(tmp_path: Path) -> None:
    path = tmp_path / "edited.toml"
    path.write_text(EDITED)
    graph = gpac.load(path).smooth.insert("limit", lib.limit, between=("gain.y", "filter.u"))
    graph.save(path)
    watch.save(path)
    text = path.read_text()
    for comment in ("# The filter of the press.", "# what it is for", "# first order", "# found by trying", "# begins at once"):
        assert comment in text
    loaded = gpac.load(path, raises=[Collision])
    assert said(loaded.watch.blocks["smooth"].block) == said(smooth), "the graph of that name is the verb's now"
    assert said(loaded.watch) == said(watch)
    assert loaded.description == "smoothing" and [*loaded] == ["smooth", "tick", "watch"]


def test_the_layout_of_an_editor_is_kept(tmp_path: Path) -> None:
    for ending in ("toml", "json"):
        path = tmp_path / f"drawn.{ending}"
        graph = smooth.insert("limit", lib.limit, between=("gain.y", "filter.u"))
        graph.layout = {"gain": {"x": 10, "y": 20.5}, "view": [1, 2, 3], "colour": "blue"}
        graph.save(path)
        assert gpac.load(path)["smooth"].layout == graph.layout


def test_json_is_what_the_control_interface_takes(tmp_path: Path) -> None:
    watch.save(tmp_path / "watch.json")
    tree = json.loads((tmp_path / "watch.json").read_text())
    assert tree["verbs"]["watch"]["blocks"]["smooth"]["block"]["graph"]["cells"] == {"scaled": ["gain.y", "filter.u"]}
    assert tree["verbs"]["watch"]["command_lists"]["start"]["commands"][1]["every_ns"] == 20_000_000


def test_composed_verbs_are_saved_as_they_were_composed(tmp_path: Path) -> None:
    first = gpac.Verb(
        "first", blocks={"w": lib.signal_generator(shape=1)}, command_lists={"start": [activate("w", every="1 ms"), wait("5 ms")]}
    )
    second = gpac.Verb("first", blocks={"w": lib.chirp}, command_lists={"start": [activate("w", every="1 ms")]})
    both = gpac.compose("both", {"a": first, "b": second}, transitions={("a", "completed"): "b"}, doc="one, then the other")
    for ending in ("toml", "json"):
        path = tmp_path / f"both.{ending}"
        gpac.together(both, second, name="all").save(path)
        both.save(path)
        loaded = gpac.load(path)
        assert said(loaded.both) == said(both)
        assert set(loaded) == {"first", "first_2", "both", "all"}


def test_a_union_that_awaits_all_is_saved_as_such(tmp_path: Path) -> None:
    parts = {}
    for label in "ab":
        parts[label] = gpac.Verb(
            f"wait_{label}", blocks={"clock": lib.time_limit}, input_parameters={"limit": "clock.limit"},
            command_lists={"start": [activate("clock", every="1 ms")]}, conditions={"over": gpac.on("clock.expired", returns=[])},
        )  # fmt: skip
    both = gpac.together(parts, name="both", until="all")
    for ending in ("toml", "json"):
        both.save(tmp_path / f"both.{ending}")
        assert said(gpac.load(tmp_path / f"both.{ending}").both) == said(both)
    assert 'until = "all"' in (tmp_path / "both.toml").read_text()


def test_device_types_are_saved_with_their_verbs(tmp_path: Path) -> None:
    keep = gpac.Verb(
        "keep_lamp",
        blocks={"w": lib.signal_generator(shape=0)},
        instantiation_parameters={"y": "w.y"},
        input_parameters={"level": gpac.input("w.offset", tunable=True)},
        command_lists={"start": [activate("w", every="1 ms"), gpac.ready()]},
    )

    class Lamp(gpac.LogicalDevice, verb=keep, arbitration="queue"):
        """Lamp with a verb."""

        y = gpac.svv("double", history=3, keep=True)
        was = gpac.svv("double", initial="y")
        level = gpac.parameter(0.5, tunable=True, keep=False)

    shine = gpac.Verb(
        "shine", objects={"lamp": Lamp}, blocks={"w": lib.signal_generator(shape=0)}, instantiation_parameters={"lamp.was": "w.y"},
        command_lists={"start": [activate("w", every="1 ms")]},
    )  # fmt: skip
    for ending in ("toml", "json"):
        path = tmp_path / f"lamp.{ending}"
        gpac.save(path, Lamp, shine, description="lamps")
        loaded = gpac.load(path)
        assert loaded.Lamp.definition_json() | {"place": None} == Lamp.definition_json() | {"place": None}
        assert loaded.Lamp.svv_members()["y"].keep and not loaded.Lamp.parameter_members()["level"].keep
        assert said(loaded.shine) == said(shine)
        with gpac.System("lamps", clock="virtual") as cell:
            fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
            red = loaded.Lamp("red", on=fast)
            red.enable()
            cell.advance("5 ms")
            assert red.y.value == 0.5


def test_what_cannot_be_written_down_is_refused(tmp_path: Path) -> None:
    def local() -> type[gpac.Terminated]:
        class Hidden(gpac.Terminated):
            pass

        return Hidden

    verb = gpac.Verb(
        "v", blocks={"w": lib.chirp}, command_lists={"start": [activate("w", every="1 ms")]}, conditions={"halted": on(raises=local())}
    )
    with pytest.raises(gpac.DefinitionError, match=r"the exception of condition 'halted' of verb 'v' is .*, which has no name by which"):
        verb.save(tmp_path / "v.toml")
    with pytest.raises(gpac.CallError, match="a definition to save must be a graph, a verb or a device type, not 5"):
        gpac.save(tmp_path / "v.toml", 5)  # type: ignore[arg-type]
    with pytest.raises(gpac.FileFailed, match="neither TOML nor JSON"):
        verb.save(tmp_path / "v.yaml")
    assert not [*tmp_path.iterdir()]


def test_another_file_is_not_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "points.toml"
    path.write_text("format = 1\n")
    with pytest.raises(gpac.FileFailed, match="the file is not a file of definitions"):
        smooth.save(path)
    assert path.read_text() == "format = 1\n"
