# SPDX-License-Identifier: Apache-2.0
"""Graphs, verbs and device types created from a file: ordinary values whose source lines are lines of the file."""

from __future__ import annotations

from typing import Any

from ...refusals.source_location import Place
from ..graphs import Graph
from ..verbs import Verb
from .positions import Path, line_at


class Origin:
    """Location of a definition in a file."""

    def __init__(self, file: str, lines: dict[Path, int], path: Path) -> None:
        self.file, self._lines, self.path = file, lines, path

    def place(self, *part: str | int) -> Place:
        """Returns the location of a part of the definition, or of the whole definition."""
        if part[:1] == ("command_lists",) and (*self.path, *part[:2], "commands") in self._lines:
            part = (*part[:2], "commands", *part[2:])
        return Place(self.file, line_at(self._lines, (*self.path, *part)))


class LoadedGraph(Graph):
    """A data flow graph from a file."""

    def __init__(self, origin: Origin, **given: Any) -> None:
        self._origin = origin
        super().__init__(**given)

    def _defined_at(self) -> Place:
        return self._origin.place()


class LoadedVerb(Verb[..., Any]):
    """A verb from a file."""

    def __init__(self, origin: Origin, ending_limit_ns: int | None, **given: Any) -> None:
        self._origin, self._limit_ns = origin, ending_limit_ns
        super().__init__(**given)

    def _defined_at(self) -> Place:
        return self._origin.place()

    def json(self) -> dict[str, Any]:
        """Returns the definition in the model's format, with the lines of its lists and transitions."""
        made: dict[str, Any] = {**super().json(), "ending_limit_ns": self._limit_ns}
        for name, given in made["command_lists"].items():
            given["place"] = self._origin.place("command_lists", name).json()
        for number, given in enumerate(made["transitions"]):
            given["place"] = self._origin.place("transitions", number).json()
        return made


def placed(kind: str, tree: dict[str, Any], origin: Origin) -> dict[str, Any]:
    """Returns the tree of a definition with the source locations that the model shows in refusals."""
    made = {**tree, "place": origin.place().json()}
    for section in ("blocks", "input_parameters", "requires", "command_lists", "conditions"):
        if section in tree:
            made[section] = {name: {**inner, "place": origin.place(section, name).json()} for name, inner in tree[section].items()}
    if kind == "verbs":
        made["transitions"] = [{**inner, "place": origin.place("transitions", n).json()} for n, inner in enumerate(tree["transitions"])]
    return made


def part_of(tree: dict[str, Any], where: list[dict[str, Any]]) -> Path:
    """Returns the part of a definition's tree that a refusal concerns, from its `where`; a named port takes precedence over its block."""
    parts = sorted(where, key=lambda part: "block" in part)
    for part in parts:
        match part:
            case {"list": name, "command": number}:
                return ("command_lists", name, number)
            case {"list": name}:
                return ("command_lists", name)
            case {"condition": name}:
                return ("conditions", name)
            case {"transition": [source, condition]}:
                pairs = [(step["from"], step["condition"]) for step in tree["transitions"]]
                return ("transitions", pairs.index((source, condition))) if (source, condition) in pairs else ("transitions",)
            case {"parameter": name}:
                return ("input_parameters", name)
            case {"output": name}:
                return ("output_values", name)
            case {"object": name}:
                return ("objects", name)
            case {"cell": name}:
                return _set_of(tree, lambda key, _, name=name: key == name)
            case {"block": "", "port": port}:
                return _set_of(tree, lambda key, _, port=port: key == port)
            case {"block": block, "port": port}:
                label = block.split(".", 1)[0]
                found = _set_of(tree, lambda _, ports, name=f"{block}.{port}": name in ports)
                return found or (
                    "blocks",
                    label,
                    *(("constants", port) if port in tree["blocks"].get(label, {}).get("constants", {}) else ()),
                )
            case {"block": block}:
                return ("blocks", block.split(".", 1)[0])
            case _:
                continue
    return ()


def _set_of(tree: dict[str, Any], fits: Any) -> Path:
    for section in ("cells", "instantiation_parameters", "outputs", "inputs"):
        for name, ports in tree.get(section, {}).items():
            if fits(name, ports):
                return (section, name)
    return ()
