# SPDX-License-Identifier: Apache-2.0
"""Requests for command, and answers to them, between programs with one daemon."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor

import pytest

import opengpac as gpac
from daemons import Daemon
from opengpac.remote import commanding
from opengpac.remote.commanding import CommandRequest
from opengpac.remote.session import Session


@pytest.fixture
def two(daemon: Daemon) -> Iterator[tuple[Session, Session]]:
    """Yields a session that commands, and one that watches, whose person is Bert."""
    with gpac.connect(daemon.url, name="first") as first, gpac.connect(daemon.url, name="second", command=False, person="Bert") as second:
        assert first.session is not None and second.session is not None
        yield first.session, second.session


@pytest.fixture
def aside() -> Iterator[Callable[[Callable[[], None]], Future[None]]]:
    """Yields a function that runs another in parallel to the test."""
    with ThreadPoolExecutor(1) as pool:
        yield lambda call: pool.submit(call)


def asking(session: Session) -> CommandRequest:
    """Returns the next request."""
    while not (requests := session.command.requests):
        pass
    return requests[0]


def test_the_holder_sees_who_asks_and_hands_over(two: tuple[Session, Session], aside: Callable[..., Future[None]]) -> None:
    first, second = two
    assert (second.command.holder, second.command.requests) == ("first", ())
    answered = aside(lambda: second.request_command("shift change"))
    asks = asking(first)
    assert (asks.name, asks.person, asks.reason) == ("second", "Bert", "shift change") and 0 < asks.left_s <= 60
    assert str(asks).startswith("session 'second' of Bert requests command: shift change (waiting for another ")
    assert str(first.command).startswith("session 'first' of user ")
    first.hand_over(asks)
    answered.result()
    assert second.commands and not first.commands and first.holder == "second"
    # Command can also be handed over to a session that did not request it.
    second.hand_over("first")
    assert first.command.holder == "first" and first.commands and not second.commands


def test_the_holder_declines_with_its_reason(two: tuple[Session, Session], aside: Callable[..., Future[None]]) -> None:
    first, second = two
    answered = aside(lambda: second.request_command())
    first.decline(asking(first), "the tool is being changed")
    with pytest.raises(gpac.NotCommanding, match="was declined by session 'first': the tool is being changed"):
        answered.result()
    assert first.commands and not second.commands and first.command.requests == ()
    with pytest.raises(gpac.UnknownName, match="'second' has not requested command"):
        first.decline("second")
    with pytest.raises(gpac.NotCommanding, match="'first'"):
        second.hand_over("second")
    with pytest.raises(gpac.UnknownName, match="no session 'nobody'"):
        first.hand_over("nobody")


def test_a_request_ends_when_its_time_has_passed_and_when_command_comes_free(
    two: tuple[Session, Session], aside: Callable[..., Future[None]]
) -> None:
    first, second = two
    with pytest.raises(gpac.NotCommanding, match="no one answered the request for command within 1 s: session 'first'"):
        second.request_command(timeout="1 s")
    answered = aside(lambda: second.request_command())
    asking(first)
    first.release_command()
    answered.result()
    assert second.holder == "second"
    second.release_command()
    second.request_command()
    assert second.commands


def test_who_is_interrupted_asks_no_longer(two: tuple[Session, Session], monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = two
    seen = threading.Event()

    def interrupt(_: float) -> None:
        seen.set()
        assert first.command.requests
        raise KeyboardInterrupt

    monkeypatch.setattr(commanding.time, "sleep", interrupt)
    with pytest.raises(KeyboardInterrupt):
        second.request_command()
    assert seen.is_set() and first.command.requests == () and first.holder == "first"


def test_what_makes_no_sense_is_refused(two: tuple[Session, Session], daemon: Daemon) -> None:
    first, second = two
    with pytest.raises(gpac.ValueRefused, match="pass '30 s', for example"):
        second.request_command(timeout="1 ms")
    with pytest.raises(gpac.CallError, match="reason"):
        second.request_command("two\nlines")
    with pytest.raises(gpac.CallError, match=r"session\.command\.requests"):
        first.hand_over(3)  # type: ignore[arg-type]
    with pytest.raises(gpac.CallError, match="person"):
        gpac.connect(daemon.url, name="third", command=False, person="")
