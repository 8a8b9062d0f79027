# SPDX-License-Identifier: Apache-2.0
"""Session of a programming system with a remote real-time system: its name, its heartbeat, and the holder of command."""

from __future__ import annotations

import contextlib
import http.client
import json
import logging
import os
import threading
import time
from collections.abc import Callable
from typing import Any

from .. import _native
from ..application.reports import Report
from ..errors import ConnectionLost, VersionMismatch, refusals, refuse
from ..values.quantities import Quantity
from .answers import Answer
from .commanding import Commanding, CommandRequest, asked_for, commanding, name_of
from .transport import Transport, readable, spoken

_logger = logging.getLogger("opengpac")

INTERFACE = 1
"""Version of the control interface that this package uses."""

ANSWER_S = 5.0
"""Time limit for the answer to a heartbeat, s."""

AGAIN_S = 10.0
"""Maximum time for which requests are retried while the system is too busy, s."""

_RESULT = b'{"result":'
"""Prefix of an answer that contains only a result."""


class Session:
    """A session, `cell.session`: its `name`, its `role`, whether it `returned`, and the holder of command.

    A separate thread sends a heartbeat every second, even while the program is busy; if it receives no answer, every call raises
    `ConnectionLost`, including those in progress. The system detects immediately when this process exits.
    """

    def __init__(self, transport: Transport, name: str, lost_after_ns: int, take_up: bool, person: str | None = None) -> None:
        self.url = str(transport.address)
        self.transport = transport
        self._id = ""
        self.version: dict[str, Any] = _version(transport)
        transport.reached = True
        transport.remedy = f"reconnect with gpac.connect({self.url!r}, name={name!r}); running verbs follow their policies"
        asked: dict[str, Any] = {"name": name, "lost_after_ms": lost_after_ns // 1_000_000, "take_up": take_up}
        if person is not None:
            asked["person"] = person
        with refusals:
            opened = self.request("POST", "/v1/sessions", asked)
        self.name: str = opened["name"]
        self.role: str = opened["role"]
        self.returned: bool = opened["returned"]
        """True if a session of this name was lost, so that this session has taken over its verbs and reports."""
        self.commands = False
        self.whole = False
        """True if the program uses the system as its own, like an embedded system, and leaves it empty."""
        self._closing: list[Callable[[], None]] = []
        self._id = opened["session"]
        self._every_s: float = opened["heartbeat_ms"] / 1e3
        self._ended = False
        self._wake, self._woken = os.pipe()
        self._alive = threading.Thread(target=self._live, name=f"opengpac {self.url}", daemon=True)
        self._alive.start()

    # ---- command ----

    def take_command(self, *, force: bool = False) -> None:
        """Takes command. Raises `NotCommanding`, which names the holder, if another session has it. `force` takes it from the holder;
        this requires the role `configure` or above."""
        with refusals:
            self.request("POST", "/v1/command", {"force": True} if force else {})
        self.commands = True

    def request_command(self, reason: str = "", *, timeout: Quantity = "60 s") -> None:
        """Requests command and waits until this session has it; returns immediately if no session has command.

        The holder reads the `reason` (one line, at most 200 characters) and hands over or declines. `NotCommanding` states who
        declined and why, or that no answer arrived within `timeout` (1 s to 10 min). Ctrl-C withdraws the request.
        """
        asked_for(self.request, self.name, reason, timeout)
        self.commands = True

    @property
    def command(self) -> Commanding:
        """Holder of command, and requests for command: `session.command.requests`."""
        with refusals:
            told = commanding(self.request("GET", "/v1/command"))
        # Command may have been handed to this session, or taken from it.
        self.commands = told.holder == self.name
        return told

    def hand_over(self, to: CommandRequest | str) -> None:
        """Hands command over to a session that requests it, or to the session named `to`; this session then only watches."""
        with refusals:
            self.request("POST", "/v1/command/hand_over", {"to": name_of(to)})
        self.commands = False

    def decline(self, request: CommandRequest | str, reason: str = "") -> None:
        """Declines a session's `request` for command, and sends it the `reason`."""
        with refusals:
            self.request("POST", "/v1/command/decline", {"name": name_of(request), "reason": reason})

    def release_command(self) -> None:
        """Releases command: the session that has waited longest for it receives it, if any; this session then only watches."""
        with refusals:
            self.request("DELETE", "/v1/command")
        self.commands = False

    @property
    def holder(self) -> str | None:
        """Name of the session that has command."""
        with refusals:
            return self.request("GET", "/v1/command")["holder"]

    @property
    def sessions(self) -> list[dict[str, Any]]:
        """Returns all sessions: name, role, origin, whether they have command and are alive, and the number of reports kept for them."""
        with refusals:
            return self.request("GET", "/v1/sessions")

    @property
    def lost(self) -> bool:
        """True if the connection was lost."""
        return self.transport.is_cut

    def kept_reports(self) -> list[Report]:
        """Returns the reports as described in `System.kept_reports`."""
        path = f"/v1/sessions/{self.name}/reports"
        with refusals:
            kept = self.request("GET", path)
            if kept["reports"]:
                self.request("DELETE", f"{path}?through={kept['reports'][-1]['number']}")
        if kept["lost"]:
            _logger.warning("%d end reports of session '%s' were discarded because there were too many", kept["lost"], self.name)
        return [Report(entry["report"]) for entry in kept["reports"]]

    # ---- requests ----

    def request(self, method: str, path: str, body: Any = None, *, timeout_s: float | None = None) -> Any:
        """Sends a request with a JSON body, and returns its result. Refusals are raised as `_native.Refused`."""
        return self.answer(method, path, b"" if body is None else json.dumps(body).encode(), timeout_s=timeout_s)["result"]

    def answer(
        self,
        method: str,
        path: str,
        body: bytes = b"",
        *,
        timeout_s: float | None = None,
        late: Callable[[Answer], None] | None = None,
    ) -> dict[str, Any]:
        """Sends a request, and returns the complete answer. `late` receives the answer to an interrupted request, as in
        `Transport.request`."""
        return _told(self._answered(method, path, body, timeout_s, late))

    def result_text(self, method: str, path: str, body: bytes, late: Callable[[Answer], None]) -> str | dict[str, Any]:
        """Sends a request, and returns the text of its result, or the complete answer if it states how to continue."""
        answer = self._answered(method, path, body, None, late)
        if answer.status == 200 and answer.body.startswith(_RESULT) and answer.body.endswith(b"}"):
            # The reader of the text checks that it is valid JSON.
            return answer.body[len(_RESULT) : -1].decode()
        told = _told(answer)
        return told if told.get("waiting") else json.dumps(told["result"])

    def _answered(self, method: str, path: str, body: bytes, timeout_s: float | None, late: Callable[[Answer], None] | None) -> Answer:
        """Returns the answer to a request. If the system is too busy, it has not executed the request, so the request is retried."""
        until = time.monotonic() + AGAIN_S
        while True:
            answer = self.transport.request(method, path, body, more=self.headers, timeout_s=timeout_s, late=late)
            if answer.status != 429 or time.monotonic() >= until:
                return answer
            time.sleep(answer.again_s)

    @property
    def headers(self) -> dict[str, str]:
        """Headers that identify the session."""
        return {"OpenGPAC-Session": self._id} if self._id else {}

    # ---- the end ----

    def close(self) -> None:
        """Ends the session properly: verbs that it started continue to run."""
        self._end(in_order=True)

    def abandon(self) -> None:
        """Drops the connection silently, as if this process had died; verbs that the session started follow their policies."""
        self._end(in_order=False)

    def at_end(self, close: Callable[[], None]) -> None:
        """Registers a function to be called at the end of the session."""
        self._closing.append(close)

    def _end(self, in_order: bool) -> None:
        if self._ended:
            return
        self._ended, self.commands = True, False
        for close in self._closing:
            close()
        if in_order:
            # This must come first: the system interprets the end of the held request as the end of this process. A lost session has
            # ended before.
            with contextlib.suppress(ConnectionLost, _native.Refused):
                self.request("DELETE", "/v1/sessions", timeout_s=ANSWER_S)
        os.close(self._woken)
        self._alive.join()
        self.transport.cut("this session is closed")

    # ---- the heartbeat ----

    def _live(self) -> None:
        """Sends heartbeats. On the same thread, keeps a request open that the system answers only at the end of the session."""
        hold: http.client.HTTPConnection | None = None
        try:
            hold = self.transport.hold("/v1/hold", self.headers)
            while not self._ended:
                assert hold.sock is not None
                ready = readable(self._every_s, hold.sock, self._wake)
                if self._ended or self._wake in ready:
                    return
                if ready and spoken(hold):
                    self.transport.cut(self._why_ended())
                    return
                self.request("POST", "/v1/heartbeat", {}, timeout_s=ANSWER_S)
        except _native.Refused as refused:
            self.transport.cut(json.loads(refused.args[0])[0]["message"])
        except ConnectionLost as lost:
            self.transport.cut(lost.message)
        except Exception as error:
            self.transport.cut(f"the thread that sends heartbeats has ended: {error!r}")
        finally:
            if hold is not None:
                self.transport.release(hold)
            os.close(self._wake)

    def _why_ended(self) -> str:
        """Returns the reason why the system answered the held request: this caller is no longer admitted, or the session has ended."""
        with contextlib.suppress(ConnectionLost):
            try:
                self.request("POST", "/v1/heartbeat", {}, timeout_s=ANSWER_S)
            except _native.Refused as refused:
                told = json.loads(refused.args[0])[0]
                if told["class"] == "NotAllowed":
                    return told["message"]
        return "the system has ended this session or has terminated"

    def __repr__(self) -> str:
        does = "commands" if self.commands else "watches"
        return f"session '{self.name}' with {self.url}: {does}, role {self.role}{', returned' if self.returned else ''}"


def _told(answer: Answer) -> dict[str, Any]:
    try:
        told = json.loads(answer.body)
        errors = None if answer.status < 400 else json.dumps(told["errors"])
    except (ValueError, KeyError, TypeError):
        refuse(ConnectionLost, f"the answer does not come from a control interface: status {answer.status}", "check the address")
    if errors is not None:
        raise _native.Refused(errors)
    return told


def _version(transport: Transport) -> dict[str, Any]:
    """Requests the server's versions; refuses incompatible ones."""
    transport.remedy = "check that the system is running there; opengpac rts starts one and prints its address"
    with refusals:
        there = _told(transport.request("GET", "/v1/version", timeout_s=ANSWER_S))
    there = there.get("result", there)
    mine, theirs = _native.version(), str(there.get("opengpac"))
    if there.get("interface") != INTERFACE or mine.split(".")[:2] != theirs.split(".")[:2]:
        refuse(
            VersionMismatch,
            f"the system at {transport.address} has OpenGPAC {theirs} with control interface {there.get('interface')}, "
            f"but this program has OpenGPAC {mine} with control interface {INTERFACE}",
            "install the same version on both sides",
        )
    return there
