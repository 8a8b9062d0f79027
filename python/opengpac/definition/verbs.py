# SPDX-License-Identifier: Apache-2.0
"""Verbs: blocks, parameters χ and ψ, outputs ω, command lists, conditions ν, transitions τ. They are called like functions."""

from __future__ import annotations

import copy
import dataclasses
import functools
import importlib
import inspect
import json
import os
from collections.abc import Callable, Mapping, Sequence, Sized
from inspect import Parameter, Signature
from typing import TYPE_CHECKING, Any, ClassVar, Generic, ParamSpec, Self, TypeVar, overload

from ..application import instances
from ..application.reports import Report
from ..errors import CallError, DefinitionError, Terminated, did_you_mean, refusals, refuse
from ..refusals.argument_types import all_taking
from ..refusals.declared_names import DeclaredNames
from ..refusals.source_location import Place, here
from ..system.processors import system_of
from ..system.sources import Source, placement_json
from ..values.quantities import Quantity, optional_ns, span_ns
from ..values.tables import CallSignature
from . import entering
from .blocks import Block, Blocks, mapping_of, modules_of, names_of, systems_of, uses_of
from .commands import checked
from .conditions import on, termination_of
from .demands import check_rates, interpreted
from .graphs import mode_json
from .parameters import Object, input_of, objects_of, requirement_of
from .signatures import arguments_signature, call_signature, inputs_signature
from .suspension import Holding, cut_off_json, suspend_json
from .verb_tables import VerbTables

if TYPE_CHECKING:
    from ..application.instances import VerbInstance
    from ..system.system import System
    from .composition import ComposedVerb

P = ParamSpec("P")
R = TypeVar("R", covariant=True)


@all_taking
class Verb(VerbTables, DeclaredNames, Generic[P, R]):
    """A verb, defined by the paper's mappings. `gpac.verb` creates one from a typed function.

    `verb(...)` creates an instance, starts it, waits for its end and deletes it; `verb.asynch(...)` creates and starts one;
    `verb.new_instance(...)` only creates one. `verb.on(source)` places the verb, `verb.named("x")` names its instance.

    Messages and listings use `name`. The keys of its mappings are free to choose; a *port* is `"label.port"`, a *member* is
    `"object.member"`:

    - `blocks`: label → block, graph or graph with constants, `{"filter": lib.lowpass(alpha=0.1)}`.
    - `command_lists`: name → commands in order: `activate`, `execute`, `wait`, `deactivate`. A list of commands is the verb's only list.
    - `objects`: name → device type, or `gpac.each(type)` for several devices, passed by each call (χ).
    - `instantiation_parameters`: name of an SVV passed by each call, or member of an object → ports that read or write it. A port
      of type `T[n]` takes one SVV of each of n devices.
    - `cells`: name → ports that share a value private to each instance.
    - `input_parameters` (ψ): name, or `"object.parameter"` → one or more ports, or `gpac.input(port, default=, tunable=)`. Numbers
      are in the SI unit of the port; text has a unit, `"90 deg"`. The value is stored once, at the start; a tunable one also later.
    - `output_values` (ω): name → port whose value is returned in the end report.
    - `conditions` (ν): name → `on("label.condition", returns=[...], raises=Error, during="list", priority=0)`, a block's condition
      alone, or `on()` under the name of a condition of the system, such as `"fault"` and `"halted"`. Without a transition a condition
      ends the verb.
    - `transitions` (τ): `(command list, condition)` → command list that follows, in the firing that met the condition.
    - `modes`: port → `"synchronous"`, `"asynchronous"` or `gpac.ratio(n)`; relaxes the mode that the block declares.
    - `requires`: member or SVV of type bool that must be true at each start → `gpac.required(Error, when=, remedy=)`.
    - `initial`: the first command list; required if there are several.
    - `ending`: the command list that runs at every end except an emergency stop, a lost processor and a second halt, for at most
      `ending_limit` (10 s).
    - `suspend`: `"idle"` (positions keep their values, and efforts, speeds or powers, which would keep driving, take idle values),
      `"hold"` (the last commands remain; refused if one of them would keep driving), `"hold_last"` (the last commands always remain),
      `"safe"` (the channels that it writes take their safe values in the meantime) or `gpac.holding(...)` (it comes to rest first).
    - `if_cut_off`: what a running instance does when its programming system is cut off: `"continue"`, `"halt"`, or `"safe"` (the
      outputs of its devices take their safe values immediately, it ends with `aborted`). The default is `"halt"`, and `"continue"`
      for a verb that keeps a logical device running.
    - `doc`: description in a sentence. `manual`: allows starts on devices in manual mode too. `function` is for `gpac.verb`.

    Raises `DefinitionError`, `UnknownName`, `TypeMismatch`, `UnitMismatch` and similar errors, several at once as
    `InstallationErrors`: for names and structure at definition, for rates and placement at creation, for claims and enabled devices
    at start.
    >>> import opengpac as gpac
    >>> from opengpac import activate, library as lib, on
    >>> gpac.Verb("wait", blocks={"clock": lib.time_limit}, input_parameters={"seconds": "clock.limit"},
    ...           command_lists={"start": [activate("clock", every="20 ms")]},
    ...           conditions={"over": on("clock.expired", returns=[])})
    simple verb wait(seconds=None)
      start        over                 ends, returns nothing
    """

    _definition_kind = "verbs"
    """Section of a definition file that holds verbs."""

    _chain: ClassVar[Callable[[Verb[..., Any], str | None, Verb[..., Any], str | None], ComposedVerb] | None] = None
    """Implementation of `then`, set by the higher layer `composition` when it is loaded."""

    _settable = frozenset({"layout"})

    _longer: tuple[str, int, Verb[..., Any], Verb[..., Any]] | None = None
    """Result of `_takes_longer`: the input parameter, its maximum number of values, the verb for longer lists, and the original verb."""

    def __init__(
        self: Verb[..., Report],
        name: str,
        *,
        blocks: Blocks,
        command_lists: Mapping[str, Sequence[Any]],
        objects: Mapping[str, Any] | None = None,
        instantiation_parameters: Mapping[str, Any] | None = None,
        cells: Mapping[str, Any] | None = None,
        input_parameters: Mapping[str, Any] | None = None,
        output_values: Mapping[str, Any] | None = None,
        conditions: Mapping[str, Any] | None = None,
        transitions: Mapping[tuple[str, str], str] | None = None,
        modes: Mapping[str, Any] | None = None,
        requires: Mapping[str, Any] | None = None,
        initial: str | None = None,
        ending: str | None = None,
        ending_limit: Quantity | None = None,
        suspend: str | Holding = "idle",
        if_cut_off: str | None = None,
        doc: str = "",
        manual: bool = False,
        function: Any = None,
    ) -> None:
        self.name = name
        self.doc = doc
        self.manual = manual
        self.blocks = uses_of(blocks)
        self.objects: dict[str, Object] = objects_of(objects)
        self.instantiation_parameters = mapping_of(instantiation_parameters)
        self.cells = mapping_of(cells)
        self.input_parameters = {str(n): input_of(given) for n, given in (input_parameters or {}).items()}
        self.output_values = {str(n): names_of(target) for n, target in (output_values or {}).items()}
        self.command_lists = {
            str(n): [checked(c, f"command list '{n}' of verb '{name}'") for c in _list(commands, n)]
            for n, commands in command_lists.items()
        }
        self.conditions = {str(n): termination_of(given, n) for n, given in (conditions or {}).items()}
        self.transitions = dict(transitions or {})
        self.modes = {str(port): mode_json(mode) for port, mode in (modes or {}).items()}
        self.requires = {str(n): requirement_of(given, n) for n, given in (requires or {}).items()}
        self.initial = initial
        self.ending = ending
        self.ending_limit_ns = optional_ns(ending_limit, f"the ending limit of verb '{name}'")
        self.suspend = suspend_json(suspend, name)
        self.if_cut_off = cut_off_json(if_cut_off, name)
        self.layout: dict[str, Any] = {}
        self.place = self._defined_at()
        self.placement: dict[str, str] = {}
        self.intervals: dict[str, int] = {}
        self.instance_name: str | None = None
        self.placed_in: System | None = None
        self._check_form()
        self._take_calls(function)
        entering.check_verb(self, self.own_system())

    def _take_calls(self, function: Any = None) -> None:
        self._function = function
        self._supported: list[str] = []
        self.signature = call_signature(self, function)
        self.arguments_signature = arguments_signature(self)
        self.inputs_signature = inputs_signature(self)
        self.__name__ = self.name
        self.__doc__ = self.doc or None

    # ---- calls: the three invocation modes ----

    @overload
    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R: ...
    @overload
    def __call__(self, *args: Any, time_limit: Quantity | None, **kwargs: Any) -> R: ...
    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Creates an instance, starts it, waits for its end and deletes it. Returns the report, or raises an exception after an abnormal
        end."""
        return instances.call(self, args, kwargs)

    @overload
    def asynch(self, *args: P.args, **kwargs: P.kwargs) -> VerbInstance[R]: ...
    @overload
    def asynch(self, *args: Any, time_limit: Quantity | None, **kwargs: Any) -> VerbInstance[R]: ...
    def asynch(self, *args: Any, **kwargs: Any) -> Any:
        """Creates and starts an instance and returns immediately; the instance's `wait()` waits for the end and deletes it."""
        return instances.start(self, args, kwargs)

    def new_instance(self, *args: Any, **kwargs: Any) -> VerbInstance[R]:
        """Creates an instance that can be started any number of times: `vi = move.new_instance(arm)`, `vi.start(goal, speed)`."""
        return instances.create(self, args, kwargs)

    # ---- options ----

    def on(self, where: Any = None, *, every: Mapping[str, Quantity] | None = None) -> Verb[P, R]:
        """Returns this verb with a placement. `where` is one source, `{"planner": slow, "generator": fast}`, or a system; `every`
        changes intervals."""
        changed = {str(label): span_ns(t, f"the interval of '{label}'") for label, t in (every or {}).items()}
        options: dict[str, Any] = {"intervals": {**self.intervals, **changed}}
        if isinstance(where, Source):
            where = {"*": where}
        if isinstance(where, Mapping):
            options["placement"] = {**placement_json(where), **self.placement}
            where = next(iter(where.values()), None)
        if where is not None:
            options["placed_in"] = system_of(where)
        return self._with(options)

    def named(self, name: str) -> Verb[P, R]:
        """Returns this verb with a `name` for its next instance."""
        return self._with({"instance_name": name})

    def raising(self, exception: type[Terminated]) -> Verb[P, R]:
        """Returns a copy of this verb whose normal ends raise `exception`, for example for a recovery in a composition that must not
        count as success.

        `gpac.compose("insert", {"push": push, "back": retract.raising(Jammed)}, transitions={("push", "jammed"): "back"})` retracts,
        then raises `Jammed`, whose `report` contains the transitions and the outputs. `>>` is refused, since no normal end remains.
        """
        if not (isinstance(exception, type) and issubclass(exception, Terminated)):
            refuse(
                DefinitionError,
                f"the argument of raising() must be a class derived from gpac.Terminated, not {exception!r}",
                "define one: class Jammed(gpac.Terminated)",
            )
        conditions = {"completed": on(), **self.conditions}
        normal = {name: t for name, t in conditions.items() if t.raises is None and (t.returns is not None or name == "completed")}
        new = self._with({"conditions": {**conditions, **{n: dataclasses.replace(t, raises=exception) for n, t in normal.items()}}})
        vars(new).pop("_text", None)
        return new

    def _takes_longer(self, parameter: str, most: int, longer: Verb[P, R]) -> None:
        """Redirects calls with more than `most` values of an input `parameter` to `longer`, which has the same labels, conditions and
        parameters, but larger tables. `new_instance`, which does not know the values, is unaffected. Call this right after the
        definition."""
        self._longer = (parameter, most, longer, copy.copy(self))

    def _fitting(self, args: Sequence[Any], kwargs: Mapping[str, Any]) -> Verb[P, R]:
        """Returns the verb with enough capacity for the values of a call: this one, or the one set by `_takes_longer`, with the
        placement and name of this one."""
        if self._longer is None:
            return self
        parameter, most, longer, defined = self._longer
        try:
            own = {name: value for name, value in kwargs.items() if name in self.signature.parameters}
            given = self.signature.bind_partial(*args, **own).arguments.get(parameter)
        except TypeError:
            return self
        if not isinstance(given, Sized) or len(given) <= most:
            return self
        options = ("conditions", "placement", "intervals", "placed_in", "instance_name")
        changed = {name: vars(self)[name] for name in options if vars(self)[name] is not vars(defined)[name]}
        if not changed:
            return longer
        new = longer._with(changed)
        vars(new).pop("_text", None)
        return new

    def _with(self, options: Mapping[str, Any]) -> Self:
        new = copy.copy(self)
        vars(new).update(options)
        # The prepared call depends on the placement and the name.
        vars(new).pop("_prepared", None)
        return new

    # ---- composition ----

    def then(self, condition: str | None, following: Verb[..., Any], *, label: str | None = None) -> ComposedVerb:
        """Returns a verb that continues with `following` when this one would end with `condition`; None stands for every normal end
        except a halt.

        `approach.then("contact", grasp)` continues in the firing that reports the contact, without Python. It can be chained;
        `gpac.compose("pick", approach.then("contact", grasp))` gives the chain a name. `label` is the label of the new part, by
        default the name of its verb.
        """
        if Verb._chain is None:
            importlib.import_module(f"{__package__}.composition")
        assert Verb._chain is not None, "composition returns it"
        return Verb._chain(self, condition, following, label)

    def __rshift__(self, following: Verb[..., Any]) -> ComposedVerb:
        """Returns `approach >> grasp`: this verb, followed by the other one at each normal end."""
        return self.then(None, following)

    # ---- the definition ----

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the verb to the TOML or JSON file at `path`, together with the graphs that it uses; the extension selects the format:
        `docs/files.md`.

        The file's other contents are preserved; `gpac.load` reads it. If the verb was made from a function, the function is not
        written: after loading, the verb is called by its parameters.

        `layout`, the positions of its boxes and lists in an editor, is written unchanged.
        """
        from .files import saving

        saving.save(path, self)

    def _defined_at(self) -> Place:
        return here()

    def own_system(self) -> System | None:
        """System whose code modules contain blocks of this verb, or of the verbs that keep its devices running; None if it uses no code
        modules."""
        return self._own_system()

    def _own_system(self) -> System | None:
        systems = self._own_systems()
        if len(systems) > 1:
            refuse(DefinitionError, f"verb '{self.name}' has blocks from two systems", "use blocks of one system")
        return next(iter(systems), None)

    def own_systems(self) -> set[System]:
        """Systems whose code modules the verb needs: at most one for a valid verb."""
        return self._own_systems()

    @functools.cached_property
    def _block_systems(self) -> frozenset[System]:
        """Systems whose code modules contain the verb's blocks. Cached, because a definition does not change."""
        return frozenset(systems_of(self.blocks.values()))

    def _own_systems(self) -> set[System]:
        found = set(self._block_systems)
        for obj in self.objects.values():
            verb = obj.device_type.definition_verb()
            if verb is not None:
                found |= verb._own_systems()
        return found

    @CallSignature
    def __signature__(self) -> Signature:
        """Signature of a call, including the time limit that all verbs accept."""
        limit = Parameter("time_limit", Parameter.KEYWORD_ONLY, default=None)
        return self.signature.replace(parameters=[*self.signature.parameters.values(), limit])

    @functools.cached_property
    def has_modules(self) -> bool:
        """True if any block of the verb comes from a code module of the component data base."""
        return bool(modules_of(self.blocks.values()))

    @functools.cached_property
    def interpreted_blocks(self) -> list[tuple[str, str]]:
        """Labels and names of the verb's blocks that run in Python."""
        return [*interpreted(self.blocks)]

    @functools.cached_property
    def has_ordered_ports(self) -> bool:
        """True if a block of the verb requires joint variables in a fixed order."""
        return any(isinstance(use.block, Block) and use.block.names for use in self.blocks.values())

    def json(self) -> dict[str, Any]:
        """Returns the verb in the model's format."""
        place = self.place.json()
        inputs = {n: p.json() for n, p in self.input_parameters.items()}
        return {
            "name": self.name, "doc": self.doc, "manual": self.manual, "blocks": {label: use.json() for label, use in self.blocks.items()},
            "objects": {n: o.json() for n, o in self.objects.items()}, "instantiation_parameters": self.instantiation_parameters,
            "cells": self.cells, "input_parameters": inputs, "output_values": {n: t[0] for n, t in self.output_values.items()},
            "command_lists": {n: {"commands": c, "place": place} for n, c in self.command_lists.items()}, "initial": self.initial,
            "ending": self.ending, "ending_limit_ns": self.ending_limit_ns, "suspend": self.suspend,
            "if_cut_off": self.if_cut_off,
            "conditions": {n: t.json() for n, t in self.conditions.items()},
            "transitions": [{"from": c, "condition": t, "to": to, "place": place} for (c, t), to in self.transitions.items()],
            "modes": self.modes, "requires": {n: r.json() for n, r in self.requires.items()}, "place": place,
        }  # fmt: skip

    def text(self) -> str:
        """Text of `json`. Cached, because a definition does not change."""
        return self._text

    @functools.cached_property
    def _text(self) -> str:
        with refusals:
            return json.dumps(self.json())
        raise AssertionError("`refusals` lets no exception pass silently")

    @functools.cached_property
    def report_class(self) -> type[Report]:
        """Class of the verb's reports: the function's return annotation, if it is a report class."""
        returns = self._function.__annotations__.get("return") if self._function is not None else None
        if isinstance(returns, str):
            returns = eval_annotation(returns, self._function)
        return returns if isinstance(returns, type) and issubclass(returns, Report) else Report

    def _instead(self, name: str) -> str:
        if name in self.input_parameters:
            return f"pass it in a call: {self.name}(…, {name}=…)"
        return "create another definition, because this one cannot be changed" if name in vars(self) else ""

    def _called(self) -> str:
        return f"verb '{self.name}'"

    def _check_form(self) -> None:
        check_rates(self.blocks, self.command_lists)
        for name, targets in self.output_values.items():
            if len(targets) != 1:
                refuse(
                    DefinitionError,
                    f"output value '{name}' of verb '{self.name}' has {len(targets)} sources",
                    "name exactly one",
                )
        for key in self.transitions:
            if not (isinstance(key, tuple) and len(key) == 2):
                refuse(
                    DefinitionError,
                    f"transition {key!r} of verb '{self.name}' lacks a list or a condition",
                    "write ('list', 'condition'): 'list'",
                )

    def refused_call(self, error: TypeError, kwargs: Mapping[str, Any]) -> None:
        """Raises `CallError` for mismatched arguments, based on `error`. If `kwargs` contains an unknown name, suggests the parameter
        that was probably meant."""
        known = [*self.signature.parameters, "time_limit"]
        wrong = next((name for name in kwargs if name not in known), None)
        remedy = did_you_mean(wrong, known) if wrong else f"call it as {self.name}{self.signature}"
        refuse(CallError, f"{self.name}(): {error}", remedy)


def eval_annotation(text: str, function: Any) -> Any:
    """Evaluates a return annotation in the scope of its function; returns None if that is impossible."""
    names = {**function.__globals__, **inspect.getclosurevars(function).nonlocals, **getattr(function, "__gpac_locals__", {})}
    try:
        return eval(text, names)
    except (NameError, AttributeError, SyntaxError, TypeError):
        return None


def _list(commands: Any, name: str) -> Sequence[Any]:
    if isinstance(commands, list | tuple):
        return commands
    refuse(
        DefinitionError, f"command list '{name}' must be a list of commands, not {commands!r}", "write [activate('block', every='1 ms')]"
    )
