# SPDX-License-Identifier: Apache-2.0
"""A graph under test: blocks, cells, placement and recorded values; created on any mapping, run until its last recorder is full."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import opengpac as gpac
from opengpac import activate, deactivate, on, wait

LENGTH = 200
"""Number of values that each recorder takes."""

PERIODS = {"fast": ("2 ms", 80), "slow": ("10 ms", 60), "other": ("2 ms", 75)}
PRIORITIES = {"soft": 70, "low": 40, "trigger": 85}

Model = Mapping[str, Sequence[Any]]

Found = Mapping[str, Any]
"""Contents of the recorders: name → values."""


class Stage:
    """Processors 0, 1, … with their interrupt sources, created when a graph requests them, and the blocks of `tests/blocks`."""

    def __init__(self, cell: gpac.System, built: Mapping[str, str]) -> None:
        self.cell = cell
        self.code = cell.download(built["mapping"], "mapping")
        self._processors: dict[int, gpac.Processor] = {}
        self._sources: dict[str, gpac.Source] = {}
        self._names = 0

    def processor(self, number: int) -> gpac.Processor:
        """Returns processor `number`; those before it are created first, so that the first one is the supervisor's."""
        for missing in range(len(self._processors), number + 1):
            self._processors[missing] = self.cell.processor(f"rtp{missing}")
        return self._processors[number]

    def source(self, place: str) -> gpac.Source:
        """Returns a source. `"1.soft"` is a software source of processor 1; `fast`, `other` and `slow` are timers of 2, 2 and 10 ms,
        `trigger` a trigger."""
        if place not in self._sources:
            number, name = place.split(".")
            processor = self.processor(int(number))
            if name in PERIODS:
                period, priority = PERIODS[name]
                made = processor.timer(name, period=period, priority=priority)
            elif name == "trigger":
                made = processor.trigger(name, priority=PRIORITIES[name])
            else:
                made = processor.software(name, priority=PRIORITIES[name])
            self._sources[place] = made
        return self._sources[place]

    def svv(self, name: str, type: str = "double") -> gpac.SVV:
        """Returns an SVV that no other graph of this system has."""
        return self.cell.svv(self.name(name), type)

    def name(self, word: str) -> str:
        """Returns a name that is unique in this system, in which a graph may be created again."""
        self._names += 1
        return f"{word}_{self._names}"

    @property
    def processors(self) -> int:
        """Number of processors that the graph has requested."""
        return len(self._processors)

    def run_for(self, instance: gpac.VerbInstance[Any], time: str) -> None:
        """Lets the graph run for that time of the system's clock, real or virtual."""
        with contextlib.suppress(TimeoutError):
            instance.wait(timeout=time)


@dataclass
class Graph:
    """Result of a function of `mappings.graphs`: a verb without its recorders, and the placement of each block."""

    blocks: dict[str, Any]
    cells: dict[str, list[str]]
    place: dict[str, str]
    """Label (or `graph.label`) → `"processor.source"`."""
    record: dict[str, str]
    """Name → output port whose values are recorded."""
    start: list[gpac.Command] = field(default_factory=list)
    """Commands of the list; the recorders are activated before them, and waited for after them."""
    lists: dict[str, list[gpac.Command]] | None = None
    """Lists in place of `start`, the first one initial; in the last one its recorders are waited for."""
    recorder: dict[str, str] = field(default_factory=dict)
    """Name → block that records it, if not `record`."""
    objects: dict[str, Any] = field(default_factory=dict)
    """Instantiation parameters: name → ports; their SVVs are in `svvs`."""
    svvs: dict[str, Any] = field(default_factory=dict)
    """Instantiation parameter → its type, or a list of types for a port that is bound to a list of SVVs."""
    conditions: dict[str, Any] = field(default_factory=dict)
    transitions: dict[tuple[str, str], str] = field(default_factory=dict)
    modes: dict[str, Any] = field(default_factory=dict)
    inputs: dict[str, Any] = field(default_factory=dict)
    """Input parameters: name → port, condition or parameter."""
    values: dict[str, Any] = field(default_factory=dict)
    """Values of the input parameters at the start."""
    arguments: dict[str, Any] = field(default_factory=dict)
    """Instantiation parameters that the graph itself has created: channels, SVVs."""
    before: Callable[[], None] | None = None
    """Function called before the verb is started: starts other verbs beside it."""
    beside: list[gpac.VerbInstance[Any]] = field(default_factory=list)
    """Instances of other verbs, deleted after the graph's own."""
    during: Callable[[gpac.VerbInstance[Any]], object] | None = None
    """Actions of the programming system while the graph runs."""
    ending: str | None = None
    """Name of the ending list."""


@dataclass(frozen=True)
class Entry:
    """Entry of the table of graphs: its constructor, and the expected contents of its recorders, computed without OpenGPAC."""

    name: str
    make: Callable[[Stage], Graph]
    model: Callable[[], Model] | None
    skipping: Callable[[Found], bool] | None
    """Check for a graph whose values depend on invocation numbers, valid even if releases were skipped."""
    begins_later: bool = False
    """True if the values depend on the number at which the reader began: if the network delayed its start, the run is another program's."""
    left_by_count: bool = False
    """True if a list with a reader is left when its writer has counted: if values are in transit for longer than the rest of the count,
    the reader has fewer of them, and the run is another program's."""


def graph(
    model: Callable[[], Model] | None = None,
    skipping: Callable[[Found], bool] | None = None,
    begins_later: bool = False,
    left_by_count: bool = False,
) -> Callable[[Callable[[Stage], Graph]], Entry]:
    """Makes an entry of a function, with the function's name."""
    return lambda make: Entry(make.__name__, make, model, skipping, begins_later, left_by_count)


def verb_of(stage: Stage, name: str, made: Graph) -> tuple[gpac.Verb[..., Any], dict[str, gpac.Source]]:
    """Returns the graph with its recorders, as a verb, and its placement."""
    blocks, cells = dict(made.blocks), {cell: list(ports) for cell, ports in made.cells.items()}
    objects = {parameter: _ports(ports) for parameter, ports in made.objects.items()}
    places = dict(made.place)
    for recorded, port in made.record.items():
        label = f"record_{recorded}"
        blocks[label] = stage.code[made.recorder.get(recorded, "record")]
        if label not in places:
            places[label] = places[max((key for key in places if port.startswith(f"{key}.")), key=len)]
        meeting = next((ports for ports in [*cells.values(), *objects.values()] if port in ports), None)
        if meeting is None:
            cells[f"recorded_{recorded}"] = [port, f"{label}.u"]
        else:
            meeting.append(f"{label}.u")
    ending: dict[str, Any] = {"ending": made.ending, "ending_limit": "5 s"} if made.ending else {}
    verb = gpac.Verb(
        name,
        blocks=blocks,
        cells=cells,
        instantiation_parameters=objects,
        input_parameters=made.inputs,
        output_values={recorded: f"record_{recorded}.values" for recorded in made.record},
        command_lists=_lists(made),
        initial=next(iter(made.lists)) if made.lists else "start",
        conditions={**made.conditions, "completed": on(returns=[*made.record])},
        transitions=made.transitions,
        modes=made.modes,
        **ending,
    )
    return verb, {label: stage.source(place) for label, place in places.items()}


def run(stage: Stage, name: str, made: Graph) -> dict[str, Any]:
    """Runs the graph until the last recorder is full, and deletes it; returns name → recorded values."""
    verb, places = verb_of(stage, name, made)
    arguments = {**made.arguments, **{parameter: _svvs(stage, parameter, types) for parameter, types in made.svvs.items()}}
    if made.before:
        made.before()
    with contextlib.ExitStack() as kept:
        for other in made.beside:
            kept.enter_context(other)
        instance = kept.enter_context(verb.on(places).new_instance(**arguments))
        instance.start(**made.values, time_limit="60 s")
        if made.during:
            made.during(instance)
        report = instance.wait()
        assert report.condition == "completed", report
        return dict(report.outputs)


def _lists(made: Graph) -> dict[str, list[gpac.Command]]:
    recorders = [f"record_{recorded}" for recorded in made.record]
    lists = {name: [*commands] for name, commands in (made.lists or {"start": [*map(activate, recorders), *made.start]}).items()}
    last = lists[[name for name in lists if name != made.ending][-1]]
    active = [command["block"] for command in last if command["command"] == "activate"]
    gone = {command["block"] for command in last if command["command"] == "deactivate"}
    last += [wait(f"{label}.full") for label in recorders if label in active]
    last += [deactivate(label) for label in reversed(active) if label not in gone]
    return lists


def _ports(ports: Any) -> list[str]:
    return [ports] if isinstance(ports, str) else list(ports)


def _svvs(stage: Stage, parameter: str, types: Any) -> Any:
    if isinstance(types, list):
        return [stage.svv(parameter, type) for type in types]
    return stage.svv(parameter, types)


def scattered(seed: int = 40503, length: int = LENGTH) -> list[float]:
    """Returns the values of the stimulus `scatter`, without OpenGPAC."""
    return [((k * 2654435769 + seed * 69069) % 2**32) * 2.0**-32 - 0.5 for k in range(length)]
