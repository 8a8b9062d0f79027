# SPDX-License-Identifier: Apache-2.0
"""Forced signals of a daemon: role and command, and the end of the session that forces."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import opengpac as gpac
from cell_rig import channel
from daemons import Daemon, environment
from opengpac.cell import DigitalInput


def signals(cell: gpac.System) -> tuple[DigitalInput, DigitalInput]:
    """Returns two enabled inputs."""
    fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
    io = fast.processor.physical_device("io", gpac.drivers.scripted([channel("gate"), channel("part")]), exchange=fast)
    return DigitalInput("gate", io["gate"]).enable(), DigitalInput("part", io["part"]).enable()


def token(folder: Path, role: str) -> str:
    """Returns a new token of that role."""
    words = ["token", "new", "--tokens", str(folder / "tokens.json"), "--role", role, "--name", role]
    done = subprocess.run([sys.executable, "-m", "opengpac", *words], env=environment(), capture_output=True, text=True, check=True)
    return done.stdout.split()[-1]


@pytest.fixture
def roles(tmp_path: Path) -> Iterator[Callable[..., gpac.System]]:
    """Yields a function that connects to a daemon with a role."""
    tokens = {role: token(tmp_path, role) for role in ("operate", "configure")}
    made = Daemon(tmp_path, "virtual", "--listen", "127.0.0.1:0", "--tokens", str(tmp_path / "tokens.json"))
    url = next(url for url in made.urls if url.startswith("http"))
    yield lambda role, name, **how: gpac.connect(url, token=tokens[role], name=name, **how)
    made.stop()


def test_forcing_needs_configure_and_command_and_ends_with_its_session(roles: Callable[..., gpac.System]) -> None:
    with roles("configure", "first") as cell:
        gate, part = signals(cell)
        with roles("configure", "watch", command=False) as watch:
            with pytest.raises(gpac.NotCommanding):
                watch.force(watch.device("gate", DigitalInput), True)
            cell.force(gate, True)
            cell.force(part, True)
            assert [of.who.split(" ")[0] for of in watch.forced.values()] == ["first", "first"]
            assert cell.release(part) == ["part"]
            assert cell.session is not None
            cell.session.release_command()
            with roles("operate", "operator") as operator:
                with pytest.raises(gpac.NotAllowed, match="configure"):
                    operator.force(operator.device("part", DigitalInput), True)
                assert operator.release() == ["gate"], "the role operate suffices for a release"
            with roles("configure", "second") as second:
                second.force(second.device("gate", DigitalInput), True)
                assert list(watch.forced) == ["gate"]
            assert watch.forced == {}, "the session was closed"
            assert "session 'second' was closed" in [entry["text"] for entry in watch.log() if entry["kind"] == "release"]


def test_a_restarted_daemon_forces_nothing(tmp_path: Path) -> None:
    options = ("--journal", str(tmp_path / "journal"))
    daemon = Daemon(tmp_path, "virtual", *options)
    with gpac.connect(daemon.url, name="first") as cell:
        gate, _ = signals(cell)
        cell.force(gate, True)
        cell.advance("2 ms")
        assert gate.value.value is True
        daemon.kill()
        daemon = Daemon(tmp_path, "virtual", *options)
    with gpac.connect(daemon.url, name="second", command=False) as cell:
        assert cell.forced == {} and [alarm.code for alarm in cell.alarms] == []
    daemon.stop()
