# SPDX-License-Identifier: Apache-2.0
"""Short form of definitions, as a person would write them. Each rule here is the inverse of one in `crates/model/src/written.rs`."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from ... import _native
from ...errors import refusals
from ...values.quantities import duration_ns, is_duration
from .trees import Tree

_PLURAL = {"graphs": "graph", "verbs": "verb", "device_types": "device_type"}
_UNITS = (("s", 1_000_000_000), ("ms", 1_000_000), ("us", 1_000), ("ns", 1))


def short(kind: str, key: str, tree: Tree) -> Tree:
    """Returns the short form of the definition under `key` in a file."""
    made = {"graphs": _graph, "verbs": _verb, "device_types": _device_type, "compositions": _composition}[kind](tree)
    named = {} if tree.get("name", key) in (key, "") else {"name": tree["name"]}
    return named | made


def long(kind: str, key: str, tree: Tree) -> Tree:
    """Returns the long form of a file's definition under `key`, including the data that only files contain."""
    tree = {"name": key} | tree
    if kind == "compositions":
        steps = [{"condition": None} | step | {"from": _names(step["from"])} for step in tree.get("transitions", [])]
        empty = {"doc": "", "initial": None, "rename": {}, "preset": {}, "share": [], "together": False, "until": "any"}
        return empty | tree | {"transitions": steps}
    if "ending_limit" in tree:
        tree["ending_limit_ns"] = duration_ns(tree.pop("ending_limit"))
    with refusals:
        made: Tree = json.loads(_native.long_form(_PLURAL[kind], json.dumps(tree)))
    for name, given in tree.get("conditions", {}).items():
        if isinstance(given, dict) and isinstance(given.get("raises"), str):
            made["conditions"][name]["raises"] = given["raises"]
    _drop_places(made)
    _keep_layouts(made, tree)
    return made | ({"layout": tree["layout"]} if tree.get("layout") else {})


def _drop_places(node: Tree) -> None:
    parts = [node, *node.get("transitions", [])]
    for section in ("blocks", "input_parameters", "requires", "command_lists", "conditions"):
        parts += node.get(section, {}).values()
    for part in parts:
        part.pop("place", None)
        inner = part.get("block")
        if isinstance(inner, dict) and "graph" in inner:
            _drop_places(inner["graph"])


def _keep_layouts(made: Tree, tree: Tree) -> None:
    """Copies the layouts of graphs within a definition."""
    for label, use in tree.get("blocks", {}).items():
        block = use.get("block") if isinstance(use, dict) else None
        if isinstance(block, dict) and "graph" in block:
            inner = made["blocks"][label]["block"]["graph"]
            _keep_layouts(inner, block["graph"])
            if block["graph"].get("layout"):
                inner["layout"] = block["graph"]["layout"]


def _filled(**given: Any) -> Tree:
    """Returns a tree without the values that are empty, None or False."""
    return {key: value for key, value in given.items() if value not in (None, "", [], {}) and value is not False}


def _one(names: list[str]) -> Any:
    return names[0] if len(names) == 1 else names


def _names(given: Any) -> list[str]:
    return [given] if isinstance(given, str) else list(given)


def _sets(sets: Mapping[str, list[str]]) -> Tree:
    return {name: _one(names) for name, names in sets.items()}


def _blocks(blocks: Mapping[str, Tree]) -> Tree:
    made: Tree = {}
    for label, use in blocks.items():
        block = use["block"]
        named = block["subroutine"] if "subroutine" in block else {"graph": {"name": block["graph"]["name"]} | _graph(block["graph"])}
        plainly = isinstance(named, str) and not use["constants"]
        made[label] = named if plainly else {"block": named} | _filled(constants=use["constants"])
    return made


def _graph(tree: Tree) -> Tree:
    optional = _filled(
        inputs=_sets(tree["inputs"]), outputs=_sets(tree["outputs"]), cells=_sets(tree["cells"]), modes=tree["modes"],
        divide=tree["divide"], layout=tree.get("layout"),
    )  # fmt: skip
    return _filled(doc=tree["doc"]) | {"blocks": _blocks(tree["blocks"])} | optional


def _verb(tree: Tree) -> Tree:
    limit = {} if tree["ending_limit_ns"] is None else _timed("ending_limit", tree["ending_limit_ns"])
    head = _filled(doc=tree["doc"], manual=tree["manual"], initial=tree["initial"], ending=tree["ending"]) | limit
    head |= _filled(suspend=None if tree["suspend"] == "idle" else tree["suspend"], if_cut_off=tree["if_cut_off"])
    return (
        head
        | _filled(transitions=[{"from": t["from"], "condition": t["condition"], "to": t["to"]} for t in tree["transitions"]])
        | {"blocks": _blocks(tree["blocks"])}
        | _filled(
            objects={
                n: {"device_type": o["device_type"], "each": True} if o["each"] else o["device_type"] for n, o in tree["objects"].items()
            },
            instantiation_parameters=_sets(tree["instantiation_parameters"]),
            cells=_sets(tree["cells"]),
            input_parameters={name: _input(given) for name, given in tree["input_parameters"].items()},
            output_values=tree["output_values"],
        )
        | {"command_lists": {name: [_command(c) for c in given["commands"]] for name, given in tree["command_lists"].items()}}
        | _filled(
            conditions={name: _condition(given) for name, given in tree["conditions"].items()},
            modes=tree["modes"],
            requires={name: _requirement(given) for name, given in tree["requires"].items()},
            layout=tree.get("layout"),
        )
    )


def _input(given: Tree) -> Any:
    default = {} if given["default"] is None else {"default": given["default"]}
    more = default | _filled(
        unit=given["unit"], within=given["within"], tunable=given["tunable"], preset=given.get("preset"),
        counted_from=given["counted_from"], member=given.get("member"), form=given.get("form"),
    )  # fmt: skip
    return {"targets": _one(given["targets"])} | more if more else _one(given["targets"])


def _condition(given: Tree) -> Any:
    returns = {} if given["returns"] is None else {"returns": _one(given["returns"])}
    more = returns | _filled(raises=given["raises"], during=_one(given["during"]), priority=given["priority"] or None, alarm=given["alarm"])
    return _filled(on=_one(given["on"])) | more if more or not given["on"] else _one(given["on"])


def _requirement(given: Tree) -> Any:
    more = _filled(when=given["when"], remedy=given["remedy"])
    return {"raises": given["raises"]} | more if more else given["raises"]


def _command(command: Tree) -> Tree:
    """Returns a command in its short form, or in the long form if the short form would have a different meaning."""
    match command["command"]:
        case "install":
            return {"install": _one(command["blocks"])}
        case "execute" | "deactivate" as name:
            return {name: command["block"]}
        case "activate":
            times = {} if command["every_ns"] is None else _timed("every", command["every_ns"])
            budget = {} if command["budget_ns"] is None else _timed("budget", command["budget_ns"])
            if any(name.endswith("_ns") for name in (*times, *budget)):
                return command
            return {"activate": command["block"]} | times | _filled(tunable=command["tunable"]) | budget
        case "ready":
            return {"ready": True}
        case _:
            return _wait(command)


def _wait(command: Tree) -> Tree:
    conditions, time_ns = command.get("conditions") or [], command.get("time_ns")
    if conditions and time_ns is not None:
        return command
    if time_ns is not None:
        text = _time_text(time_ns)
        return {"wait": text} if text else command
    if not conditions:
        return {"wait": True}
    return command if len(conditions) == 1 and is_duration(conditions[0]) else {"wait": _one(conditions)}


def _timed(name: str, ns: int) -> Tree:
    text = _time_text(ns)
    return {name: text} if text else {f"{name}_ns": ns}


def _time_text(ns: int) -> str | None:
    """Formats a time as `20 ms`, or returns None if no such text represents exactly that time."""
    for unit, scale in _UNITS:
        if (ns >= scale and ns % max(1, scale // 1000) == 0) or unit == "ns":
            number = f"{ns / scale:.3f}".rstrip("0").rstrip(".")
            text = f"{number} {unit}"
            return text if ns >= 0 and duration_ns(text) == ns else None
    return None


def _device_type(tree: Tree) -> Tree:
    return _filled(
        doc=tree["doc"],
        verb=tree["verb"],
        arbitration=None if tree["arbitration"] == "refuse" else tree["arbitration"],
        svvs={
            n: {"type_text": s["type_text"]} | _filled(**{k: v for k, v in s.items() if k != "type_text"}) for n, s in tree["svvs"].items()
        },
        parameters={n: {"default": p["default"]} | _flagged(p) for n, p in tree["parameters"].items()},
        layout=tree.get("layout"),
    )


def _flagged(parameter: Tree) -> Tree:
    """Returns a parameter's unit and flags. An explicit `keep` is written even if it is false, because an absent `keep` has a different
    meaning."""
    kept = {} if parameter.get("keep") is None else {"keep": parameter["keep"]}
    return _filled(unit=parameter["unit"], tunable=parameter["tunable"], within=parameter.get("within")) | kept


def _composition(tree: Tree) -> Tree:
    steps = [{"from": _one(s["from"])} | _filled(condition=s["condition"]) | {"to": s["to"]} for s in tree["transitions"]]
    return (
        _filled(doc=tree["doc"], initial=tree["initial"], together=tree["together"], share=tree["share"], transitions=steps)
        | ({"until": tree["until"]} if tree["until"] != "any" else {})
        | {"parts": tree["parts"]}
        | _filled(rename=tree["rename"], preset=tree["preset"], layout=tree.get("layout"))
    )
