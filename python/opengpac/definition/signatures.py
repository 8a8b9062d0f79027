# SPDX-License-Identifier: Apache-2.0
"""Signatures of a verb's calls: objects, instantiation parameters, then input parameters, in the order of declaration."""

from __future__ import annotations

import dataclasses
import inspect
from inspect import Parameter, Signature
from typing import TYPE_CHECKING, Any

from ..errors import DefinitionError, did_you_mean, refuse

if TYPE_CHECKING:
    from .verbs import Verb


def roots(verb: Verb[..., Any]) -> list[str]:
    """Returns the instantiation parameters of a call: `drive` for `drive.position`; excludes members of objects."""
    names = dict.fromkeys(name.split(".", 1)[0] for name in verb.instantiation_parameters)
    return [name for name in names if name not in verb.objects]


def inputs(verb: Verb[..., Any]) -> list[str]:
    """Returns the input parameters of a start, excluding those that are parameters of objects."""
    return [name for name in verb.input_parameters if name.split(".", 1)[0] not in verb.objects]


def _default(verb: Verb[..., Any], name: str) -> Any:
    parameter = verb.input_parameters[name]
    return parameter.default if parameter.has_default else None


def call_signature(verb: Verb[..., Any], function: Any) -> Signature:
    """Returns the signature of `verb(...)`; if the verb was made from a function, that function's signature, including its defaults."""
    given = [*verb.objects, *roots(verb)]
    required = [Parameter(name, Parameter.POSITIONAL_OR_KEYWORD) for name in given]
    # The model refuses names with two meanings.
    named = [name for name in inputs(verb) if name.isidentifier() and name not in given]
    optional = [Parameter(name, Parameter.POSITIONAL_OR_KEYWORD, default=_default(verb, name)) for name in named]
    if function is None:
        return Signature([*required, *optional])
    try:
        declared = inspect.signature(function)
    except (TypeError, ValueError):
        refuse(
            DefinitionError, f"verb '{verb.name}' was created from {function!r}, which is not a function of your program", "omit function="
        )
    known = [*given, *inputs(verb)]
    for name, parameter in declared.parameters.items():
        if name not in known:
            refuse(
                DefinitionError,
                f"function '{verb.name}' has a parameter '{name}', but its verb does not",
                did_you_mean(name, known),
            )
        if name in verb.input_parameters and parameter.default is not Parameter.empty and not verb.input_parameters[name].has_default:
            verb.input_parameters[name] = dataclasses.replace(verb.input_parameters[name], default=parameter.default)
    missing = next((p.name for p in required if p.name not in declared.parameters), None)
    if missing is not None:
        refuse(DefinitionError, f"function '{verb.name}' lacks parameter '{missing}' of its verb", "add it to the function's parameters")
    more = [p.replace(kind=Parameter.KEYWORD_ONLY) for p in optional if p.name not in declared.parameters]
    return declared.replace(parameters=[*declared.parameters.values(), *more])


def arguments_signature(verb: Verb[..., Any]) -> Signature:
    """Returns the signature of `new_instance`: objects and instantiation parameters."""
    names = {*verb.objects, *roots(verb)}
    return verb.signature.replace(parameters=[p for p in verb.signature.parameters.values() if p.name in names])


def inputs_signature(verb: Verb[..., Any]) -> Signature:
    """Returns the signature of `start`: input parameters."""
    names = {*verb.objects, *roots(verb)}
    return verb.signature.replace(parameters=[p for p in verb.signature.parameters.values() if p.name not in names])
