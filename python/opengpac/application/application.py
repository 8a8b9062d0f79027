# SPDX-License-Identifier: Apache-2.0
"""Translates Python verb calls into the model's applications and start values."""

from __future__ import annotations

from collections.abc import Mapping
from inspect import BoundArguments
from typing import TYPE_CHECKING, Any

from ..definition.demands import check_order, check_placed
from ..devices.groups import Group
from ..errors import CallError, Error, UnknownName, refuse
from ..refusals.source_location import here
from ..values.quantities import duration_ns
from .arguments import argument_json, systems_in

if TYPE_CHECKING:
    from ..definition.verbs import Verb
    from ..system.system import System


def system_for(verb: Verb[..., Any], arguments: Mapping[str, Any]) -> System:
    """Returns the system to which a verb's placement and the arguments of a call belong."""
    names = verb.arguments_signature.parameters
    found = dict.fromkeys(system for name, given in arguments.items() if name in names for system in systems_in(given))
    for system in (verb._own_system(), verb.placed_in):
        if system is not None:
            found[system] = None
    if len(found) > 1:
        names = ", ".join(f"'{system.name}'" for system in found)
        refuse(
            CallError, f"the arguments of verb '{verb.name}' belong to several systems: {names}", "pass arguments that belong to one system"
        )
    if not found:
        refuse(
            CallError,
            f"the system in which verb '{verb.name}' runs is not specified",
            f"write {verb.name}.on(source)(…), or {verb.name}.on(system)(…)",
        )
    return next(iter(found))


def bind(verb: Verb[..., Any], signature: Any, args: Any, kwargs: Mapping[str, Any]) -> Any:
    """Binds the arguments of a call to the verb's parameters by name. Raises `CallError` if they do not match."""
    try:
        return signature.bind(*args, **kwargs)
    except TypeError as error:
        verb.refused_call(error, kwargs)
        raise


def application_json(verb: Verb[..., Any], bound: BoundArguments) -> dict[str, Any]:
    """Returns the application of a verb to its objects and instantiation arguments."""
    return {**applied(verb, arguments_json(verb, bound.arguments)), "place": here().json()}


def arguments_json(verb: Verb[..., Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the objects and instantiation arguments of a call in the model's format. Refuses deleted objects."""
    if verb.interpreted_blocks:
        check_placed(verb, system_for(verb, given))
    names = verb.arguments_signature.parameters
    if not names:
        return {}
    if verb.has_ordered_ports:
        check_order(verb, given)
    what = f"of verb '{verb.name}'"
    return {name: argument_json(one, f"argument '{name}' {what}") for name, one in given.items() if name in names and one is not None}


def applied(verb: Verb[..., Any], arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the application of a verb to its arguments, independent of the source line of the call."""
    return {
        "verb": verb.name, "name": verb.instance_name, "arguments": arguments, "placement": verb.placement,
        "every": verb.intervals, "owner": None,
    }  # fmt: skip


def values_json(verb: Verb[..., Any], arguments: Mapping[str, Any], objects: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the input values of a call; omitted values take their defaults on the real-time system."""
    if not verb.input_parameters:
        return {}
    groups = [given for given in objects.values() if isinstance(given, Group)]
    values: dict[str, Any] = {}
    for name, given in arguments.items():
        if name not in verb.input_parameters:
            continue
        if isinstance(given, Mapping) and len(groups) == 1:
            given = _over_present(name, given, groups[0])
        values[name] = verb.input_parameters[name].value(given, objects, f"'{name}'")
    for name, parameter in verb.input_parameters.items():
        if parameter.member and name not in values:
            values[name] = parameter.of_object(name, objects)
    return values


def _over_present(name: str, given: Mapping[str, Any], group: Group[Any]) -> Any:
    """Merges `{"elbow": 1.2}` into the current positions; all other members keep their current positions."""
    wanted: dict[str, Any] = {}
    for key, value in given.items():
        try:
            wanted[group[str(key)].name] = value
        except UnknownName as error:
            said = f"'{name}' names '{key}', which is not a member of group '{group.name}'"
            refuse(UnknownName, said, error.remedy)
    return [wanted.get(device.name, present) for device, present in zip(group, group.values("sensed"), strict=True)]


def options_json(kwargs: dict[str, Any], verb: Verb[..., Any]) -> dict[str, Any]:
    """Removes from `kwargs` the options that every start accepts (`time_limit`, `overruns`, `age_max`), and returns them."""
    options: dict[str, Any] = {}
    if not kwargs:
        return options
    for option, key in (("time_limit", "time_limit_ns"), ("age_max", "age_max_ns")):
        if option in kwargs and option not in verb.input_parameters:
            given = kwargs.pop(option)
            if given is not None:
                options[key] = duration_ns(given, f"'{option}'")
    if "overruns" in kwargs and "overruns" not in verb.input_parameters:
        options["overruns"] = kwargs.pop("overruns")
    return options


def checked_application(
    verb: Verb[..., Any], args: Any, kwargs: dict[str, Any], signature: Any
) -> tuple[System, dict[str, Any], dict[str, Any]]:
    """Registers the verb of a call in its system, and returns the system, the application and the objects, for a check."""
    options_json(kwargs, verb)
    bound = bind(verb, signature, args, kwargs)
    system = system_for(verb, bound.arguments)
    system._enter_verb(verb)
    objects = {name: given for name, given in bound.arguments.items() if name in verb.objects}
    return system, {**application_json(verb, bound), "values": _known_values(verb, bound, objects)}, objects


def checked_values(verb: Verb[..., Any], args: Any, kwargs: dict[str, Any], objects: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the start values of an instance, for a check."""
    options_json(kwargs, verb)
    return _known_values(verb, bind(verb, verb.inputs_signature, args, kwargs), objects)


def _known_values(verb: Verb[..., Any], bound: Any, objects: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the values that a check can determine; empty if they are known only at run time."""
    try:
        return values_json(verb, bound.arguments, objects)
    except Error:
        raise
    except Exception:
        return {}
