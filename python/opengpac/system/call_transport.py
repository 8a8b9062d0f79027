# SPDX-License-Identifier: Apache-2.0
"""Transport for calls: each is a name and the JSON text of its arguments, regardless of the connection to the system."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any


class CallTransport:
    """Transport for calls as texts, to an embedded or a remote system."""

    __slots__ = ()

    def call(self, name: str, arguments_json: str = "", /) -> str:
        """Makes a call and waits until it is complete; returns the JSON text of its result. Signals are handled in the meantime."""
        raise NotImplementedError

    def begin(self, name: str, arguments_json: str, slice_ns: int, /) -> str | None:
        """Like `call`, but waits for at most `slice_ns` of real time; returns None if the call has not finished. Only for calls that can
        be repeated."""
        raise NotImplementedError

    def _ask(self, name: str, arguments: Mapping[str, Any] | None = None) -> Any:
        if arguments is None:
            return json.loads(self.call(name))
        return json.loads(self.call(name, json.dumps({key: value for key, value in arguments.items() if value is not None})))

    def _ask_of(self, name: str, whole: Mapping[str, Any], arguments: Mapping[str, Any] | None = None) -> Any:
        given = {key: value for key, value in (arguments or {}).items() if value is not None}
        return json.loads(self.call(name, json.dumps({**whole, **given} if given else whole)))
