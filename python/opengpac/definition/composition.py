# SPDX-License-Identifier: Apache-2.0
"""Composition: combines verbs into one verb, whose transitions lead from part to part without Python in the loop.

`compose` is the explicit form; `approach.then("contact", grasp)`, `approach >> grasp` and `together(a, b)` are short forms. The
model, in Rust, defines the meaning of a composition and which parts can be combined; this module only writes the definition.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

from ..application.reports import Report
from ..errors import DefinitionError, Terminated, refuse
from ..refusals.argument_types import taking
from ..refusals.source_location import Place, here
from ..values.encoding import plain
from . import entering
from .blocks import BlockUse, names_of
from .conditions import Termination
from .parameters import InputParameter, absent
from .verbs import Verb

if TYPE_CHECKING:
    from ..system.system import System

AnyVerb: TypeAlias = "Verb[..., Any]"
Parts: TypeAlias = "Mapping[str, AnyVerb] | Sequence[AnyVerb] | AnyVerb"
Transitions: TypeAlias = "Mapping[tuple[str, str], str] | Mapping[tuple[Any, str | None], str]"


@dataclass(frozen=True)
class _Step:
    """One entry of the augmented τ, as specified."""

    origins: tuple[str, ...]
    condition: str | None
    to: str
    place: Place

    def json(self) -> dict[str, Any]:
        return {"from": list(self.origins), "condition": self.condition, "to": self.to, "place": self.place.json()}


@dataclass(frozen=True)
class Composition:
    """Parts of a composed verb, as specified."""

    name: str
    parts: Mapping[str, AnyVerb]
    place: Place
    steps: tuple[_Step, ...] = ()
    initial: str | None = None
    rename: Mapping[str, str] = field(default_factory=dict)
    preset: Mapping[str, Any] = field(default_factory=dict)
    share: tuple[str, ...] = ()
    together: bool = False
    until: str = "any"
    doc: str = ""
    open: bool = False
    """True if `then` appends to this composition instead of treating it as a single part."""

    def json(self) -> dict[str, Any]:
        """Returns the composition in the model's format."""
        return {
            "name": self.name, "doc": self.doc, "parts": {label: verb.json() for label, verb in self.parts.items()},
            "transitions": [step.json() for step in self.steps], "initial": self.initial, "rename": dict(self.rename),
            "preset": {name: plain(value, f"the preset of '{name}'") for name, value in self.preset.items()}, "share": list(self.share),
            "together": self.together, "until": self.until, "place": self.place.json(),
        }  # fmt: skip


class ComposedVerb(Verb[..., Report]):
    """A verb composed of verbs; it is called, placed and composed like any other. Created by `gpac.compose`, `gpac.together`, `then` and
    `>>`.

    Its blocks, cells and command lists carry the label of their part (`grasp.start`), as do the keys of `conditions` and
    `output_values`, which have one entry for each part.
    """

    _definition_kind = "compositions"
    """Section of a definition file that holds composed verbs."""

    def __init__(self, composition: Composition) -> None:
        self.composition = composition
        self._parts = dict(composition.parts)
        self.name, self.doc, self.place = composition.name, composition.doc, composition.place
        self.layout: dict[str, Any] = {}
        self.blocks: dict[str, BlockUse] = {}
        self.placed_in, self.instance_name = None, None
        self._blocks_of_parts()
        made = self._made = entering.compose(self._parts.values(), composition.json(), self.own_system())
        self.blocks = {label: self.blocks[label] for label in made["blocks"]}
        types = {obj.device_type.definition_name(): obj for part in self._parts.values() for obj in part.objects.values()}
        self.objects = {n: dataclasses.replace(types[obj["device_type"]], each=obj["each"]) for n, obj in made["objects"].items()}
        self.instantiation_parameters, self.cells = made["instantiation_parameters"], made["cells"]
        self.input_parameters = {n: self._written(n, _input(given)) for n, given in made["input_parameters"].items() if not given["preset"]}
        self.output_values = {n: [target] for n, target in made["output_values"].items()}
        self.command_lists = {n: given["commands"] for n, given in made["command_lists"].items()}
        self.transitions = {(t["from"], t["condition"]): t["to"] for t in made["transitions"]}
        self.modes, self.initial, self.manual = made["modes"], made["initial"], made["manual"]
        required = [part.requires[n] for part in self._parts.values() for n in part.requires]
        self.requires = {n: next(r for r in required if r.raises.__name__ == given["raises"]) for n, given in made["requires"].items()}
        self.conditions = {key: self._termination(key, line) for key, line in made["conditions"].items()}
        self.placement, self.intervals = self._placed()
        self._take_calls()
        entering.check_verb(self, self.own_system())

    @property
    def parts(self) -> Mapping[str, AnyVerb]:
        """Verbs from which this verb was composed, by label."""
        return self._parts

    def _own_systems(self) -> set[System]:
        """Returns the systems whose code modules the parts need."""
        return set().union(*(part._own_systems() for part in self._parts.values()))

    def json(self) -> dict[str, Any]:
        """Returns the composed verb in the model's format."""
        return self._made

    def raising(self, exception: type[Terminated]) -> Verb[..., Report]:
        """Refuses any `exception`: exceptions of a composed verb belong to its parts."""
        refuse(
            DefinitionError,
            f"'{self.name}' is composed, but raising() applies to a single verb",
            "call it on a part: retract.raising(Jammed)",
        )

    def reported(self, key: str) -> str:
        """Returns the name that reports use for the entry `key` of the tables of conditions and outputs."""
        return key.rsplit(".", 1)[-1]

    def _blocks_of_parts(self) -> None:
        for label, part in self._parts.items():
            if part.placed_in is not None:
                self.placed_in = part.placed_in
            for own, use in part.blocks.items():
                self.blocks[f"{label}.{own}"] = use
                self.blocks.setdefault(own, use)

    def _renamed(self, label: str, name: str) -> str:
        return self.composition.rename.get(f"{label}.{name}", name)

    def _written(self, name: str, parameter: InputParameter) -> InputParameter:
        """Returns the input parameter with the conversion and the default member that its part defines."""
        for label, part in self._parts.items():
            for own, given in part.input_parameters.items():
                if (given.member or given.form) and self._renamed(label, own) == name:
                    root, dot, rest = given.member.partition(".")
                    return dataclasses.replace(parameter, member=f"{self._renamed(label, root)}{dot}{rest}", form=given.form)
        return parameter

    def _termination(self, key: str, line: Mapping[str, Any]) -> Termination:
        """Returns an entry of the table of conditions, with the exception classes that the parts assign to it."""
        classes: dict[type[Terminated], None] = dict.fromkeys(self._awaited(line) if line["raises"] else ())
        for label, part in self._parts.items():
            for own, given in part.conditions.items():
                name = part.reported(own)
                renamed = self._renamed(label, name)
                if given.raises is not None and key in (f"{label}.{own.removesuffix(name)}{renamed}", renamed):
                    classes[given.raises] = None
        returns, place = line["returns"], line["place"]
        return Termination(
            on=tuple(line["on"]),
            returns=None if returns is None else tuple(returns),
            raises=_one_class([*classes]) if line["raises"] else None,
            during=tuple(line["during"]),
            priority=line["priority"],
            alarm=line["alarm"],
            place=Place(place["file"], place["line"]) if place else self.place,
        )

    def _awaited(self, line: Mapping[str, Any]) -> Iterable[type[Terminated]]:
        """Yields the exception classes of parts that end a list together, that is, parts in which the same system condition leads to a
        list of their own."""
        for condition in (c for (begins, c), to in self.transitions.items() if begins == "start" and [to] == line["during"]):
            for part in self._parts.values():
                begins = part.initial or next(iter(part.command_lists), "")
                own = part.transitions.get((begins, condition))
                yield from (t.raises for t in part.conditions.values() if t.raises is not None and own in t.during)

    def _placed(self) -> tuple[dict[str, str], dict[str, int]]:
        """Returns the placements set by `on` for the parts, and the intervals that it changed."""
        shared = set(self.composition.share)
        placement: dict[str, str] = {}
        intervals: dict[str, int] = {}
        for label, part in self._parts.items():
            for pattern, source in part.placement.items():
                own = [n for n in part.blocks if n in shared]
                if len(own) < len(part.blocks) and pattern not in own:
                    placement.setdefault(f"{label}.{pattern}", source)
                for block in own if pattern == "*" else [n for n in own if n == pattern]:
                    placement.setdefault(block, source)
            for block, interval in part.intervals.items():
                intervals[block if block in shared else f"{label}.{block}"] = interval
        return placement, intervals


def _input(given: Mapping[str, Any]) -> InputParameter:
    default, place = given["default"], given["place"]
    where = Place(place["file"], place["line"]) if place else here()
    within = tuple(given["within"]) if given["within"] else None
    value = absent if default is None else default
    return InputParameter(tuple(given["targets"]), value, given["tunable"], given["unit"], where, within, given["counted_from"])


_both: dict[tuple[type[Terminated], ...], type[Terminated]] = {}


def _one_class(classes: list[type[Terminated]]) -> type[Terminated]:
    """Returns an exception class for several parts that end at once: a subclass of the exception classes of all parts, so that an
    `except` clause for any of them catches it."""
    if len(classes) <= 1:
        return classes[0] if classes else Terminated
    bases = tuple(c for c in classes if not any(c is not other and issubclass(other, c) for other in classes))
    if len(bases) == 1:
        return bases[0]
    return _both.setdefault(bases, type("And".join(c.__name__ for c in bases), bases, {}))


# ---- public functions ----


@taking
def compose(
    name: str,
    parts: Parts,
    *,
    transitions: Transitions | None = None,
    initial: str | None = None,
    rename: Mapping[str, str] | None = None,
    preset: Mapping[str, Any] | None = None,
    share: Sequence[str] = (),
    doc: str = "",
) -> ComposedVerb:
    """Composes several verbs into one: `compose("pick", {"approach": approach, "grasp": grasp}, transitions={("approach", "contact"):
    "grasp"})`.

    `name` is the verb's name. `parts` are verbs by label, verbs (labelled by their names), or a chain created by `then` and `>>`,
    which receives its name here. The key of an entry of `transitions` is a condition with a part (meaning every list of the part
    that the condition ends), a list (`"approach.back_off"`) or a tuple of lists; the value is the part (meaning its initial list)
    or list that follows. The condition None stands for every normal end except a halt. `initial` is the first part.
    `rename={"grasp.speed": "closing_speed"}` renames a parameter, object, output or condition of one part; `{"grasp.*": "hand_*"}`
    renames every parameter, object and output of it that no other entry renames. `preset={"approach.speed": 0.1}` fixes the value
    of an input of one part; `share=["servo"]` merges the blocks of that label into one instance, which keeps running across a
    transition. `doc` describes the verb in a sentence. Raises all conflicts at once (`CompositionConflict`, `TypeMismatch`, …).
    """
    base = Composition(name, _labelled(parts, name), here())
    if isinstance(parts, ComposedVerb) and parts.composition.open:
        base = dataclasses.replace(parts.composition, name=name, place=here(), open=False)
    return ComposedVerb(
        dataclasses.replace(
            base,
            steps=(*base.steps, *_steps(transitions or {}, name)),
            initial=initial if initial is not None else base.initial,
            rename={**base.rename, **_renames(rename or {}, base.parts)},
            preset={**base.preset, **(preset or {})},
            share=(*base.share, *names_of(share)),
            doc=doc or base.doc,
        )
    )


def _renames(rename: Mapping[str, str], parts: Mapping[str, AnyVerb]) -> dict[str, str]:
    """Returns `rename` with each `*` entry expanded to the names that it covers."""
    found: dict[str, str] = {}
    for name, to in rename.items():
        label, _, own = name.rpartition(".")
        part = parts.get(label)
        if own != "*" or part is None or to.count("*") != 1:
            found[name] = to
            continue
        names = [*part.signature.parameters, *map(part.reported, part.output_values)]
        found |= {f"{label}.{each}": to.replace("*", each) for each in names if f"{label}.{each}" not in rename}
    return found


@taking
def together(
    *verbs: AnyVerb | Mapping[str, AnyVerb],
    name: str | None = None,
    rename: Mapping[str, str] | None = None,
    preset: Mapping[str, Any] | None = None,
    share: Sequence[str] = (),
    until: str = "any",
    doc: str = "",
) -> ComposedVerb:
    """Combines several verbs into one that runs them at the same time. Its single initial list, `start`, contains the leading commands
    of all parts, in order.

    With `until="any"`, the first condition that ends a part ends all parts, and the verb returns the outputs that each part defines
    for that condition. With `until="all"`, the verb ends with `completed` when every part has reached a normal end, and returns the
    outputs of all parts; a finished part keeps running until then, and a failed part ends all parts. A transition leaves that list as
    a whole. If a system condition (`halted`, `time_limit`) leads several parts to lists of their own, those lists are also merged
    into one, which ends when all parts have finished their lists. A part that has no transition for it ends, unless it is already
    coming to rest. Parts must not write the same SVV, and only one of the initial lists may contain a wait. `name`, `rename`,
    `preset`, `share` and `doc` are as in `compose`; by default, the name joins the names of the parts, `a_and_b`.
    """
    if until not in ("any", "all"):
        refuse(DefinitionError, f"until= must be 'any' or 'all', not {until!r}", "write until='any' or until='all'")
    parts = verbs[0] if len(verbs) == 1 and isinstance(verbs[0], Mapping) else [v for v in verbs if not isinstance(v, Mapping)]
    labelled = _labelled(parts, name or "together")
    composition = Composition(name or "_and_".join(labelled), labelled, here(), together=True, until=until, doc=doc)
    return ComposedVerb(
        dataclasses.replace(composition, rename=_renames(rename or {}, labelled), preset=dict(preset or {}), share=tuple(names_of(share)))
    )


def then(verb: AnyVerb, condition: str | None, following: AnyVerb, label: str | None) -> ComposedVerb:
    """Implements `verb.then(condition, following)`: extends a chain by one part; any other verb starts a new chain."""
    for part in (verb, following):
        _check_verb(part, "a composition")
    chain = Composition("", {verb.name: verb}, here(), open=True)
    if isinstance(verb, ComposedVerb) and verb.composition.open:
        chain = verb.composition
    if label is not None and label in chain.parts:
        refuse(DefinitionError, f"two parts of a chain are labelled '{label}'", "give each part its own label")
    label = _unique(label or following.name, chain.parts)
    step = _Step(tuple(chain.parts), condition, label, here())
    parts = {**chain.parts, label: following}
    return ComposedVerb(dataclasses.replace(chain, name="_then_".join(parts), parts=parts, steps=(*chain.steps, step), place=here()))


Verb._chain = staticmethod(then)


def _labelled(parts: Parts | Iterable[AnyVerb], name: str) -> dict[str, AnyVerb]:
    if isinstance(parts, Verb):
        parts = [parts]
    labelled: dict[str, AnyVerb] = {}
    pairs = parts.items() if isinstance(parts, Mapping) else ((None, verb) for verb in parts)
    for label, verb in pairs:
        _check_verb(verb, f"composition '{name}'")
        labelled[str(label) if label is not None else _unique(verb.name, labelled)] = verb
    return labelled


def _unique(label: str, known: Mapping[str, AnyVerb]) -> str:
    """Returns a unique label: `move`, `move_2`, `move_3` …"""
    number, unique = 1, label
    while unique in known:
        number += 1
        unique = f"{label}_{number}"
    return unique


def _check_verb(verb: object, where: str) -> None:
    if not isinstance(verb, Verb):
        refuse(DefinitionError, f"a part of {where} must be a verb, not {verb!r}", "pass verbs: {'approach': approach, 'grasp': grasp}")


def _steps(transitions: Transitions, name: str) -> list[_Step]:
    steps: list[_Step] = []
    for key, to in transitions.items():
        if not (isinstance(key, tuple) and len(key) == 2 and isinstance(to, str)):
            refuse(
                DefinitionError,
                f"transition {key!r}: {to!r} of composition '{name}' lacks a part or a condition",
                "write ('part', 'condition'): 'part'",
            )
        origins, condition = key
        steps.append(_Step(tuple(names_of(origins)), condition, to, here()))
    return steps
