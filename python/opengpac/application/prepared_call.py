# SPDX-License-Identifier: Apache-2.0
"""Caches the part of a verb's calls that does not change between calls: the mapping of arguments and the text of the request.

Each call still checks that its arguments exist, and to which system they belong.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Mapping, Sequence
from inspect import Parameter
from typing import TYPE_CHECKING, Any

from ..refusals.source_location import here
from .application import applied

if TYPE_CHECKING:
    from ..definition.verbs import Verb

_BY_NAME = (Parameter.POSITIONAL_OR_KEYWORD, Parameter.KEYWORD_ONLY)

_dumps = json.JSONEncoder().encode
_quoted = functools.lru_cache(1024)(_dumps)


class PreparedCall:
    """Prepared call of one verb with its placement and name; `of` caches it on the verb."""

    __slots__ = ("_arguments", "_head", "_shapes")

    def __init__(self) -> None:
        self._shapes: dict[tuple[Any, ...], list[tuple[str, int]]] = {}
        """Parameter indices of the passed arguments, in order. The key identifies the form of the call: the number of positional
        arguments, and the names of the keyword arguments."""
        self._arguments: dict[str, Any] = {}
        self._head = ""

    @staticmethod
    def of(verb: Verb[..., Any]) -> PreparedCall:
        """Returns the prepared call of a verb; creates it on the first call."""
        prepared: PreparedCall | None = verb.__dict__.get("_prepared")
        if prepared is None:
            prepared = verb._prepared = PreparedCall()
        return prepared

    def bound(self, verb: Verb[..., Any], args: Sequence[Any], kwargs: Mapping[str, Any]) -> dict[str, Any]:
        """Returns the argument of each parameter of a call. Raises `TypeError` like `Signature.bind`."""
        shape = (len(args), *kwargs)
        places = self._shapes.get(shape)
        if places is None:
            arguments = verb.signature.bind(*args, **kwargs).arguments
            parameters = verb.signature.parameters
            if any(parameter.kind not in _BY_NAME for parameter in parameters.values()):
                return arguments
            at = {name: index for index, name in enumerate((*[*parameters][: len(args)], *kwargs))}
            self._shapes[shape] = [(name, at[name]) for name in arguments]
            return arguments
        given = (*args, *kwargs.values()) if kwargs else args
        return {name: given[at] for name, at in places}

    def request(self, verb: Verb[..., Any], arguments: dict[str, Any], values: Mapping[str, Any], limits: Mapping[str, Any]) -> str:
        """Returns the arguments of the request `perform` as JSON; `arguments` are the verb's objects and SVVs in the model's format."""
        if not self._head or arguments != self._arguments:
            self._arguments, self._head = arguments, _dumps(applied(verb, arguments)).removesuffix("}")
        place = here()
        stated = f'"place": {{"file": {_quoted(place.file)}, "line": {place.line}}}'
        return f'{self._head}, {stated}, "values": {_dumps(values) if values else "{}"}, "limits": {_dumps(limits) if limits else "{}"}}}'
