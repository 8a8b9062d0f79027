# SPDX-License-Identifier: Apache-2.0
"""Definitions as trees in the long form: the model's format without source locations, and with the data that only files contain."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, TypeAlias

from ...errors import CallError, refuse
from ...values.encoding import plain
from .naming import name_of

if TYPE_CHECKING:
    from ...devices.logical import LogicalDevice
    from ..composition import ComposedVerb
    from ..graphs import Graph
    from ..verbs import Verb

Tree: TypeAlias = dict[str, Any]
Definition: TypeAlias = "Graph | Verb[..., Any] | type[LogicalDevice]"

_WHOLE: dict[str, Tree] = {
    "activate": {"command": "", "block": "", "every_ns": None, "tunable": False, "budget_ns": None},
    "wait": {"command": "", "conditions": [], "time_ns": None},
}
"""Commands with all optional members."""

KINDS = ("graphs", "verbs", "device_types", "compositions")


def kind_of(definition: object) -> str | None:
    """Returns the kind of a definition in a file, one of `KINDS`, or None for other values. A device type is a class; other definitions
    are instances."""
    kind = getattr(definition, "_definition_kind", None)
    return kind if isinstance(definition, type) == (kind == "device_types") else None


class DefinitionTrees:
    """Definitions to be written to a file: kind → key → tree. A composition includes its parts, a device type its verb.

    `present` contains the keys of an existing file, with their kinds: each key identifies one definition.
    """

    def __init__(self, present: Mapping[str, str] | None = None) -> None:
        self.trees: dict[str, dict[str, Tree]] = {kind: {} for kind in KINDS}
        self._kinds = dict(present or {})

    def add(self, definition: Any) -> str:
        """Adds a definition and its dependencies in the same file; returns its key."""
        match kind_of(definition):
            case "compositions":
                return self._put("compositions", definition.name, self._composition(definition))
            case "verbs":
                return self._put("verbs", definition.name, verb_tree(definition))
            case "graphs":
                return self._put("graphs", definition.name, graph_tree(definition))
            case "device_types":
                verb = definition.definition_verb()
                tree = device_type_tree(definition) | {"verb": self.add(verb) if verb is not None else None}
                return self._put("device_types", definition.definition_name(), tree)
        refuse(CallError, f"a definition to save must be a graph, a verb or a device type, not {definition!r}", "pass one of those")

    def _composition(self, verb: ComposedVerb) -> Tree:
        composition = verb.composition
        tree = {key: value for key, value in composition.json().items() if key != "place"}
        tree["parts"] = {label: self.add(part) for label, part in composition.parts.items()}
        tree["transitions"] = [{key: value for key, value in step.items() if key != "place"} for step in tree["transitions"]]
        return _copied(tree) | _layout(verb)

    def _put(self, kind: str, name: str, tree: Tree) -> str:
        """Adds the tree under its name, or under `name_2` if that name is taken."""
        known = self.trees[kind]
        key = next((key for key, other in known.items() if other == tree), None)
        if key is None:
            key = next(key for key in _keys(name) if key not in known and self._kinds.get(key, kind) == kind)
            known[key] = tree
            self._kinds[key] = kind
        return key

    def share_graphs(self) -> None:
        """Moves graphs within definitions to separate definitions, named after their location."""
        for kind in ("verbs", "graphs"):
            for tree in [*self.trees[kind].values()]:
                self._share(tree)

    def _share(self, tree: Tree) -> None:
        for use in tree["blocks"].values():
            inner = use["block"].get("graph")
            if inner is not None:
                self._share(inner)
                use["block"] = {"subroutine": self._put("graphs", inner["name"], inner)}


def _keys(name: str) -> Iterator[str]:
    # A block whose name has no dot is a graph of the file.
    name = name.replace(".", "_") or "unnamed"
    yield name
    number = 1
    while True:
        number += 1
        yield f"{name}_{number}"


def graph_tree(graph: Graph) -> Tree:
    """Returns a graph as a tree, including the graphs within it."""
    return _bare_graph(_copied(graph.json()), graph)


def verb_tree(verb: Verb[..., Any]) -> Tree:
    """Returns a verb as a tree, complete with the names of its exception classes and functions."""
    tree = _copied(verb.json())
    for part in (tree, *tree["command_lists"].values(), *tree["conditions"].values(), *tree["transitions"]):
        part.pop("place", None)
    for part in (*tree["input_parameters"].values(), *tree["requires"].values()):
        part.pop("place", None)
    for given in tree["command_lists"].values():
        given["commands"] = [_WHOLE.get(command["command"], {}) | command for command in given["commands"]]
    for label, use in verb.blocks.items():
        _bare_use(tree["blocks"][label], use.block)
    for name, condition in verb.conditions.items():
        if condition.raises is not None:
            tree["conditions"][name]["raises"] = name_of(condition.raises, f"the exception of condition '{name}' of verb '{verb.name}'")
    for name, parameter in verb.input_parameters.items():
        if parameter.member:
            tree["input_parameters"][name]["member"] = parameter.member
        if parameter.form is not None:
            # Keep the written default, not the converted one.
            tree["input_parameters"][name]["default"] = _copied(parameter.default) if parameter.has_default else None
            tree["input_parameters"][name]["form"] = name_of(parameter.form, f"the form of '{name}' of verb '{verb.name}'")
    return tree | _layout(verb)


def device_type_tree(device_type: type[LogicalDevice]) -> Tree:
    """Returns a logical device type as a tree, including the members that are kept across a warm restart."""
    tree = _copied(device_type.definition_json())
    del tree["place"]
    for name, member in device_type.svv_members().items():
        if member.keep:
            tree["svvs"][name]["keep"] = True
    for name, member in device_type.parameter_members().items():
        if member.keep != member.tunable:
            tree["parameters"][name]["keep"] = member.keep
    return tree


def _bare_graph(tree: Tree, graph: Graph) -> Tree:
    tree.pop("place", None)
    for label, use in graph.blocks.items():
        _bare_use(tree["blocks"][label], use.block)
    return tree | _layout(graph)


def _bare_use(use: Tree, block: Any) -> None:
    use.pop("place", None)
    inner = use["block"].get("graph")
    if inner is not None:
        use["block"] = {"graph": _bare_graph(inner, block)}


def _layout(definition: Any) -> Tree:
    return {"layout": _copied(definition.layout)} if definition.layout else {}


def _copied(tree: Any) -> Any:
    return json.loads(json.dumps(tree, default=plain))
