# SPDX-License-Identifier: Apache-2.0
"""Transport of calls: a name and the JSON text of its arguments, independent of the connection to the system."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any


class CallTransport:
    """Transport of calls as texts, to an embedded system or a remote one."""

    __slots__ = ()

    def call(self, name: str, arguments_json: str = "", /) -> str:
        """Makes a call, to its end; returns the JSON text of its answer. Signals are handled meanwhile."""
        raise NotImplementedError

    def begin(self, name: str, arguments_json: str, slice_ns: int, /) -> str | None:
        """Makes the call like `call`, for at most this much real time; returns None if it has not finished. For calls that can be
        repeated."""
        raise NotImplementedError

    def _ask(self, name: str, arguments: Mapping[str, Any] | None = None) -> Any:
        if arguments is None:
            return json.loads(self.call(name))
        return json.loads(self.call(name, json.dumps({key: value for key, value in arguments.items() if value is not None})))

    def _ask_of(self, name: str, whole: Mapping[str, Any], arguments: Mapping[str, Any] | None = None) -> Any:
        given = {key: value for key, value in (arguments or {}).items() if value is not None}
        return json.loads(self.call(name, json.dumps({**whole, **given} if given else whole)))
