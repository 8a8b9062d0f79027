# SPDX-License-Identifier: Apache-2.0
"""`cell.studio()`: the page of a system inside a program, its users, and its lifetime."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
from pathlib import Path

import pytest

import opengpac as gpac
from browser import Browser
from opengpac import activate
from opengpac.studio import server

CLOCKS = ("virtual", "monotonic")


def wave(cell: gpac.System) -> gpac.VerbInstance:
    """Starts a verb that writes the SVV `y` until it is ended."""
    fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
    made = gpac.Verb(
        "wave",
        blocks={"wave": gpac.library.signal_generator(shape=0, offset=2.5)},
        instantiation_parameters={"y": "wave.y"},
        command_lists={"start": [activate("wave", every="1 ms")]},
    )
    return made.on(fast).asynch(y=cell.svv("y"))


@pytest.mark.parametrize("clock", CLOCKS)
def test_a_page_shows_a_running_system_and_commands_it(page: Path, clock: str) -> None:
    with gpac.System("cell", clock) as cell:
        running = wave(cell)
        browser = Browser(cell.studio().url)
        assert browser.fetch("GET", "/", token="") == (200, (page / "index.html").read_text())
        assert browser.fetch("GET", "/assets/index-1f2e.js", token="")[0] == 200
        assert browser.fetch("GET", "/v1/version", token="")[0] == 401
        assert json.loads(browser.fetch("GET", "/v1/version")[1])["role"] == "operate"
        (instance,) = browser.call("installed")["instances"]
        assert (instance["name"], instance["state"], instance["list"]) == ("wave#1", "running", "start")
        browser.command()
        assert browser.call("halt", instance=instance["id"])["condition"] == "halted"
        assert running.state == "ended"
        who = {(entry["who"], entry["text"], entry["about"]) for entry in cell.log() if entry["kind"] == "command"}
        assert {("program", "start", "wave#1"), ("studio-test (studio)", "halt", "wave#1")} <= who


@pytest.mark.parametrize("clock", CLOCKS)
def test_the_stream_of_a_page_has_values_and_the_scope(page: Path, clock: str) -> None:
    with gpac.System("cell", clock) as cell:
        wave(cell)
        stream = Browser(cell.studio().url).stream()
        stream.say(subscribe="scope", id="s", names=["y"], every_ms=10)
        assert stream.next()["scope"]["channels"][0]["name"] == "y"
        if cell.virtual:
            cell.advance("5 ms")
        assert stream.next()[:4] == b"1CSG"
        stream.say(unsubscribe="s")
        stream.close()


def test_a_page_that_may_record_has_a_folder_for_it(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    folder = tmp_path / "data" / "opengpac" / "recordings"
    with gpac.System("cell", "virtual") as cell:
        wave(cell)
        with cell.studio(role="observe") as there:
            assert not folder.exists(), "a page that may not record makes none"
            browser = Browser(there.url)
            assert browser.refused("record", path="run.mcap", svvs=["y"]) == "NotAllowed"
        # The default role: it opens on the machine of the user who started it, for that user.
        browser = Browser(cell.studio().url)
        browser.command()
        number = browser.call("record", path="run.mcap", svvs=["y"])["recording"]
        assert [*folder.iterdir()] == [folder / "run.mcap"]
        browser.call("stop_recording", recording=number)
        # A replay runs code of the recording, which remains the privilege of the role `configure`.
        assert browser.refused("replay", path="run.mcap") == "NotAllowed"


def test_where_no_folder_can_be_made_a_page_has_none(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "file"))
    assert server.records_of_user() is None
    with gpac.System("cell", "virtual") as cell:
        assert json.loads(Browser(cell.studio(role="configure").url).fetch("GET", "/v1/version")[1])["role"] == "configure"


BUSY = """
import sys
from browser import Browser
browser = Browser(sys.argv[1])
while browser.call("read", names=["y"])["values"]["y"]["value"] != 2.5:
    pass
for _ in range(20):
    assert browser.call("read", names=["y"])["values"]["y"]["value"] == 2.5
open(sys.argv[2], "w").close()
"""


def test_requests_are_answered_while_python_does_nothing_else(page: Path, tmp_path: Path) -> None:
    with gpac.System("cell") as cell:
        wave(cell)
        done = tmp_path / "done"
        script = [sys.executable, "-c", BUSY, cell.studio().url, str(done)]
        switch = sys.getswitchinterval()
        asking = subprocess.Popen(script, env={"PYTHONPATH": str(Path(__file__).parent.parent)})
        sys.setswitchinterval(1000.0)
        try:
            # Python switches to no other thread by time.
            turns = 0
            while not done.exists() and asking.poll() is None:
                turns += sum(range(100_000)) > 0
        finally:
            sys.setswitchinterval(switch)
            status = asking.wait(60)
    assert status == 0 and turns > 0


def test_two_systems_have_pages_of_their_own(page: Path) -> None:
    with gpac.System("one", clock="virtual") as one, gpac.System("two", clock="virtual") as two:
        first, second = Browser(one.studio().url), Browser(two.studio().url)
        assert json.loads(first.fetch("GET", "/v1/version")[1])["system"] == "one"
        assert json.loads(second.fetch("GET", "/v1/version")[1])["system"] == "two"
        assert first.fetch("GET", "/v1/version", token=second.token)[0] == 401
        one.studio().stop()
        assert second.fetch("GET", "/v1/version")[0] == 200


def test_asked_for_again_it_is_the_same_until_it_is_stopped(page: Path) -> None:
    with gpac.System("cell", clock="virtual") as cell:
        with cell.studio() as there:
            assert cell.studio() is there and cell.studio(port=Browser(there.url).port) is there
            assert there.url in repr(there) and f'href="{there.url}"' in there._repr_html_()
            with pytest.raises(gpac.InvalidState, match="stop"):
                cell.studio(role="observe")
            with pytest.raises(gpac.InvalidState, match="stop"):
                cell.studio(edit=True)
        assert there.closed and "stopped" in repr(there) and "stopped" in there._repr_html_()
        again = cell.studio(role="observe")
        assert again is not there
        browser = Browser(again.url)
        assert browser.refused("emergency_stop", reason="x") == "NotAllowed"
    assert again.closed
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection((browser.host, browser.port))
    with pytest.raises(gpac.InvalidState):
        cell.studio()


def test_only_edit_may_install(page: Path) -> None:
    definition = {"name": "level", "type_text": "double"}
    with gpac.System("cell", clock="virtual") as cell:
        with cell.studio() as there:
            browser = Browser(there.url)
            browser.command()
            assert browser.refused("svv", **definition) == "NotAllowed"
        browser = Browser(cell.studio(edit=True).url)
        browser.command()
        browser.call("svv", **definition)
        assert cell.names["svvs"] == ["level"]
        with pytest.raises(gpac.CallError, match="edit"):
            cell.studio(role="observe", edit=True)


def test_a_port_that_is_taken_and_what_is_no_port(page: Path) -> None:
    with gpac.System("cell", clock="virtual") as cell, socket.create_server(("127.0.0.1", 0)) as taken:
        with pytest.raises(gpac.InUse, match="choose another port"):
            cell.studio(port=taken.getsockname()[1])
        for wrong in (-1, 70_000, "80", True):
            with pytest.raises(gpac.CallError, match="port"):
                cell.studio(port=wrong)  # type: ignore[arg-type]
        with pytest.raises(gpac.CallError, match="role"):
            cell.studio(role="download")


def test_an_audit_file_is_written_where_one_is_named(page: Path, tmp_path: Path) -> None:
    with gpac.System("cell", clock="virtual") as cell:
        Browser(cell.studio(audit=tmp_path / "audit.jsonl").url).command("panel")
    lines = [json.loads(line) for line in (tmp_path / "audit.jsonl").read_text().splitlines()]
    assert [(line["call"], line["session"], line["who"], line["outcome"]) for line in lines] == [
        ("open_session", "panel", "studio", "ok"),
        ("take_command", "panel", "studio", "ok"),
    ]


def test_a_page_that_was_not_built_is_refused_with_the_remedy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "PAGE", tmp_path / "none")
    with gpac.System("cell", clock="virtual") as cell, pytest.raises(gpac.FileFailed, match="make page"):
        cell.studio()


def test_no_browser_is_opened_without_a_screen(page: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr(server.webbrowser, "open", lambda url: bool(opened.append(url)) or True)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with gpac.System("cell", clock="virtual") as cell:
        there = cell.studio(open=True)
        assert not opened
        monkeypatch.setenv("DISPLAY", ":0")
        assert cell.studio(open=True) is there
        (url,) = opened
        # Every user can read the command line of a browser.
        assert there.url not in url and url.startswith("file://")
        file = Path(url.removeprefix("file://"))
        assert there.url in file.read_text() and file.stat().st_mode & 0o077 == 0 and file.parent.stat().st_mode & 0o077 == 0
    assert not file.exists()
