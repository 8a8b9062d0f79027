# SPDX-License-Identifier: Apache-2.0
"""Command of a remote system: sends requests for command, and answers the requests of other sessions."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from .. import _native
from ..errors import CallError, ConnectionLost, NotCommanding, OutOfRange, refusals, refuse
from ..values.quantities import Quantity, duration_ns, duration_text

LOOK_S = 0.1
"""Polling interval for the answer to a request for command, s."""

Ask = Callable[[str, str, Any], Any]
"""Function that sends a request of the session, given method, path and body."""


@dataclass(frozen=True)
class CommandRequest:
    """A session that requests command: its `name`, its caller `who`, its `person`, its `reason`, and the remaining waiting time in
    seconds."""

    number: int
    name: str
    who: str
    person: str | None
    reason: str
    left_s: float

    def __str__(self) -> str:
        why = f": {self.reason}" if self.reason else ""
        return f"session '{self.name}' of {self.person or self.who} requests command{why} (waiting for another {self.left_s:.0f} s)"


@dataclass(frozen=True)
class Commanding:
    """Holder of command: the session `holder`, its caller `who`, its `person`, and the pending `requests`, oldest first."""

    holder: str | None
    who: str | None
    person: str | None
    requests: tuple[CommandRequest, ...]

    def __str__(self) -> str:
        first = f"session '{self.holder}' of {self.person or self.who} has command" if self.holder else "no session has command"
        return "\n".join([first, *map(str, self.requests)])


def commanding(told: Mapping[str, Any]) -> Commanding:
    """Converts the system's report on the holder of command to an object."""
    fields = ("number", "name", "who", "person", "reason")
    asks = tuple(CommandRequest(**{field: one[field] for field in fields}, left_s=one["left_ms"] / 1e3) for one in told["requests"])
    return Commanding(told["holder"], told["who"], told["person"], asks)


def asked_for(ask: Ask, name: str, reason: str, timeout: Quantity) -> None:
    """Requests command as the session `name`, and waits until it is granted. Raises `NotCommanding` if it is declined."""
    wait_ns = duration_ns(timeout, "timeout")
    if not 1e9 <= wait_ns <= 600e9:
        refuse(OutOfRange, f"the timeout of a request for command must be from 1 s to 10 min, not {timeout!r}", "pass '30 s', for example")
    with refusals:
        told = ask("POST", "/v1/command/request", {"reason": reason, "wait_ms": wait_ns // 1_000_000})
    mine = [*told["requests"], *told["settled"]]
    number = max((one["number"] for one in mine if one["name"] == name), default=0)
    try:
        while not _settled(told, number, name, wait_ns):
            time.sleep(LOOK_S)
            with refusals:
                told = ask("GET", "/v1/command", None)
    except (NotCommanding, ConnectionLost):
        raise
    except BaseException:
        _withdraw(ask, name)
        raise


def _settled(told: Mapping[str, Any], number: int, name: str, wait_ns: int) -> bool:
    """Returns whether the request with that number was granted. Raises an exception if it ended otherwise."""
    if told["holder"] == name:
        return True
    ended = [one for one in told["settled"] if one["number"] == number]
    if not ended:
        if any(one["number"] == number for one in told["requests"]):
            return False
        refuse(NotCommanding, f"there is no longer a request of session '{name}' for command", "request it again")
    outcome, by, reason = ended[0]["outcome"], ended[0]["by"], ended[0]["reason"]
    holder = f"session '{told['holder']}' of {told['person'] or told['who']}" if told["holder"] else "no session"
    if outcome == "timed_out":
        refuse(
            NotCommanding,
            f"no one answered the request for command within {duration_text(wait_ns)}: {holder} has command",
            "ask that person",
        )
    if outcome == "granted":
        refuse(NotCommanding, f"command was granted to session '{name}' but then taken away: {holder} has command", "request it again")
    by = f" by session '{by}'" if by and by != name else ""
    refuse(
        NotCommanding,
        f"the request for command was {outcome}{by}{f': {reason}' if reason else ''}",
        f"try again later: {holder} has command",
    )


def _withdraw(ask: Ask, name: str) -> None:
    """Withdraws the request, and releases command if it was granted in the meantime, because no caller waits for it any longer."""
    with contextlib.suppress(ConnectionLost):
        try:
            ask("DELETE", "/v1/command/request", {"reason": f"session '{name}' is no longer waiting"})
        except _native.Refused:
            with contextlib.suppress(_native.Refused):
                ask("DELETE", "/v1/command", None)


def name_of(session: object) -> str:
    """Returns the name of a session, given its request for command or the name itself."""
    if isinstance(session, CommandRequest):
        return session.name
    if not isinstance(session, str):
        refuse(
            CallError,
            f"command cannot be granted to {session!r}",
            "pass one of session.command.requests, or a name from session.sessions",
        )
    return session
