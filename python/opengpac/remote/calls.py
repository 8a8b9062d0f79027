# SPDX-License-Identifier: Apache-2.0
"""A remote real-time system: converts each package call into a request to its control interface."""

from __future__ import annotations

import base64
import json
import threading
from typing import Any

from .. import _native
from ..system.calls import LASTING
from ..system.realtime import RealTimeSystem
from . import files
from .answers import Answer
from .emptying import leave_empty
from .ends import Ends
from .session import Session

SLICE_MS = 100
"""Duration of a single request during a wait, ms. After an interrupt, the system may keep waiting for up to that time."""


class Remote(RealTimeSystem):
    """Real-time system that is reached through a session."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self._ends: Ends | None = None
        self._lock = threading.Lock()

    def call(self, name: str, arguments_json: str = "", /) -> str:
        while True:
            answer = self._sent(name, arguments_json, SLICE_MS)
            if not answer.get("waiting"):
                return json.dumps(answer["result"])
            name, arguments_json = answer["go_on"]["call"], json.dumps(answer["go_on"]["arguments"])

    def begin(self, name: str, arguments_json: str, slice_ns: int, /) -> str | None:
        answer = self._sent(name, arguments_json, max(1, min(SLICE_MS, slice_ns // 1_000_000)))
        return None if answer.get("waiting") else json.dumps(answer["result"])

    def _sent(self, name: str, arguments_json: str, slice_ms: int) -> dict[str, Any]:
        return self.session.answer("POST", f"/v1/call/{name}", _with_slice(name, arguments_json, slice_ms).encode())

    def processor(
        self,
        name: str,
        core: int | None = None,
        supervisor: bool | None = None,
        process: Any = None,
        host: str | None = None,
        lost_after_ns: int | None = None,
        patience_ns: int | None = None,
    ) -> None:
        try:
            super().processor(name, core, supervisor, process, host, lost_after_ns, patience_ns)
        except _native.Refused:
            there = self._left("processors", name)
            if there is None or there["core"] != core or (supervisor and not there["supervisor"]):
                raise

    def source(
        self, processor: str, name: str, kind: str, priority: int, period_ns: int | None = None, virtual_cost_ns: int | None = None
    ) -> None:
        try:
            super().source(processor, name, kind, priority, period_ns, virtual_cost_ns)
        except _native.Refused:
            same = {"processor": processor, "kind": {"timer": {"period_ns": period_ns}} if kind == "timer" else kind, "priority": priority}
            if self._left("sources", f"{processor}.{name}") != same:
                raise

    def _left(self, kind: str, name: str) -> dict[str, Any] | None:
        """Returns an object left over from a program that used the system as its own. It could not be deleted, and the next program may
        create it again."""
        return self.configuration()[kind].get(name) if self.session.whole else None

    def physical_device(self, processor: str, name: str, kind: str, source: str, options: Any = None, place: Any = None) -> Any:
        return super().physical_device(processor, name, kind, source, files.carried(self.session, kind, options or {}), place)

    def download(self, path: str, name: str | None = None, python: str | None = None) -> Any:
        return files.put_module(self.session, path, name)

    def performing(self, arguments_json: str, made: list[int], slice_ns: int, /) -> str | None:
        body = _with_slice("perform", arguments_json, max(1, min(SLICE_MS, slice_ns // 1_000_000))).encode()

        def goes_on(answer: Answer) -> None:
            made.append(json.loads(answer.body)["go_on"]["arguments"]["instance"])

        # An interrupted call has begun all the same: its answer identifies the instance to end.
        told = self.session.result_text("POST", "/v1/call/perform", body, goes_on)
        if isinstance(told, str):
            return told
        made.append(told["go_on"]["arguments"]["instance"])
        return None

    def ended_fd(self) -> int:
        with self._lock:
            if self._ends is None:
                self._ends = Ends(self.session)
                self.session.at_end(self._ends.close)
            return self._ends.fd

    def read(self, names: list[str], /) -> tuple[int, list[tuple[bytes, int, int]]]:
        told = self._ask("read", {"names": names, "raw": True})
        rows = [told["values"][name] for name in names]
        return told["time_ns"], [(base64.b64decode(row["bytes"]), row["number"], row["time_ns"]) for row in rows]

    def history(self, name: str, count: int, /) -> list[tuple[int, int, bytes]]:
        rows = self._ask("history", {"name": name, "count": count, "raw": True})
        return [(row["number"], row["time_ns"], base64.b64decode(row["bytes"])) for row in rows]

    def close(self) -> None:
        if self.session.whole and not self.session.lost:
            leave_empty(self)
        self.session.close()


def _with_slice(name: str, arguments_json: str, slice_ms: int) -> str:
    """Returns the arguments of a blocking call, including the maximum duration of one of its requests."""
    if name not in LASTING:
        return arguments_json
    rest = (arguments_json or "{}").strip().removeprefix("{")
    return f'{{"slice_ms": {slice_ms}{"" if rest == "}" else ","} {rest}'
