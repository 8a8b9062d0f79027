# SPDX-License-Identifier: Apache-2.0
"""Sessions: watching, commanding, their ends, and resumption."""

from __future__ import annotations

import threading

import pytest

import opengpac as gpac
import swing
from daemons import Daemon


def test_a_session_says_who_it_is(daemon: Daemon) -> None:
    with gpac.connect(daemon.url, name="operator") as cell:
        assert (cell.name, cell.virtual, cell.now) == ("cell", True, 0.0)
        session = cell.session
        assert session is not None and session.commands and not session.returned
        assert repr(session) == f"session 'operator' with {daemon.url}: commands, role download"
        assert [line["name"] for line in session.sessions] == ["operator"]
    assert cell.closed and repr(cell) == "system 'cell': closed"
    with pytest.raises(gpac.InvalidState, match="system 'cell' is closed"):
        cell.advance("1 s")


def test_one_commands_and_others_watch(daemon: Daemon) -> None:
    with gpac.connect(daemon.url, name="first") as first, gpac.connect(daemon.url, name="second", command=False) as second:
        first.processor("rtp0").timer("fast", period="1 ms", priority=80)
        level = first.svv("level", unit="m", initial=2.5)
        assert second.svv("level").value == 2.5 and second.svv("level").unit == "m"
        assert second.session is not None and second.session.holder == "first"
        with pytest.raises(gpac.NotCommanding, match="'first'") as caught:
            second.svv("level").value = 3.0
        assert caught.value.file == __file__
        with pytest.raises(gpac.NotCommanding, match="'first'"):
            gpac.connect(daemon.url, name="third")
        with pytest.raises(gpac.NotCommanding, match="'first'"):
            second.session.take_command()
        second.session.take_command(force=True)
        second.svv("level").value = 3.0
        assert level.value == 3.0
        with pytest.raises(gpac.NotCommanding, match="'second'"):
            level.value = 4.0
        second.session.release_command()
        assert second.session.holder is None
        assert first.session is not None
        first.session.take_command()
        level.value = 4.0
        assert second.svv("level").value == 4.0


def test_whoever_is_refused_leaves_no_session_behind(daemon: Daemon) -> None:
    with gpac.connect(daemon.url, name="first") as first:
        with pytest.raises(gpac.NotCommanding):
            gpac.connect(daemon.url, name="second")
        with pytest.raises(gpac.InUse, match="'first'"):
            gpac.connect(daemon.url, name="first")
        assert first.session is not None and [line["name"] for line in first.session.sessions] == ["first"]


def test_what_runs_goes_on_where_a_session_is_closed_in_order(daemon: Daemon) -> None:
    with gpac.connect(daemon.url, name="first") as cell:
        joint = swing.build(cell).enable()
        started = swing.swing().on(cell.sources["rtp0.slow"]).named("long").new_instance(joint).start(seconds=1.0)
        assert started.state == "running"
    with gpac.connect(daemon.url, name="second") as cell:
        assert [*cell.processors] == ["rtp0"] and [*cell.sources] == ["rtp0.fast", "rtp0.slow"]
        assert (cell.sources["rtp0.slow"].period, cell.sources["rtp0.slow"].priority) == (0.02, 60)
        assert cell.device("axis").state == "moving"
        report = cell.instance("long").wait()
        assert report.condition == "over" and report.verb == "swing"


def test_a_program_that_fails_is_cut_off_at_once(daemon: Daemon) -> None:
    class Mistake(Exception):
        pass

    with pytest.raises(Mistake), gpac.connect(daemon.url, name="first", lost_after="60 s") as cell:
        joint = swing.build(cell).enable()
        on_slow = cell.sources["rtp0.slow"]
        swing.swing().on(on_slow).named("halts").new_instance(joint).start(seconds=10.0)
        raise Mistake
    with gpac.connect(daemon.url, name="second") as cell:
        cell.advance(until=lambda: all(i.state == "running" for i in cell.instances), within="20 s")
        assert [i.device for i in cell.instances] == ["axis"], "the servo goes on, the action is halted and gone"
        assert cell.device("axis").state == "standstill"
    with gpac.connect(daemon.url, name="first") as cell:
        assert cell.session is not None and cell.session.returned
        assert [(report.verb, report.condition) for report in cell.kept_reports()] == [("swing", "halted")]
        assert cell.kept_reports() == [], "each is given once"


def test_the_same_name_takes_up_what_a_lost_session_left(daemon: Daemon) -> None:
    cell = gpac.connect(daemon.url, name="operator")
    joint = swing.build(cell).enable()
    goes_on = swing.swing("goes_on", if_cut_off="continue").on(cell.sources["rtp0.slow"])
    instance = goes_on.new_instance(joint).start(seconds=1.0)
    name = instance.name
    assert cell.session is not None
    cell.session.abandon()
    with pytest.raises(gpac.ConnectionLost, match=r"reconnect with gpac\.connect\('unix://.*', name='operator'\)"):
        instance.wait()
    cell.close()
    with gpac.connect(daemon.url, name="operator") as cell:
        again = cell.instance(name, goes_on)
        assert again.state == "running" and again.wait().condition == "over"
        assert again.wait().commanded == again.report.commanded


def test_a_daemon_that_dies_ends_every_wait(real_daemon: Daemon) -> None:
    cell = gpac.connect(real_daemon.url, name="operator")
    joint = swing.build(cell).enable()
    instance = swing.swing().on(cell.sources["rtp0.slow"]).new_instance(joint).start(seconds=1000.0)
    killer = threading.Thread(target=real_daemon.kill)
    killer.start()
    with pytest.raises(gpac.ConnectionLost, match=r"the connection to the system at unix://.* was lost") as caught:
        instance.wait()
    killer.join()
    assert caught.value.file == __file__
    with pytest.raises(gpac.ConnectionLost):
        _ = cell.now
    cell.close()


def test_a_session_lives_while_python_is_busy(real_daemon: Daemon) -> None:
    with gpac.connect(real_daemon.url, name="busy", lost_after="3 s") as cell, gpac.connect(real_daemon.url, command=False) as clock:
        begun = clock.now
        while clock.now < begun + 4.0:
            sum(range(1000))
        assert cell.session is not None and not cell.session.lost and cell.session.holder == "busy"
        assert cell.now > begun


def test_the_thread_that_shows_life_may_not_die_unseen(daemon: Daemon, monkeypatch: pytest.MonkeyPatch) -> None:
    cell = gpac.connect(daemon.url, name="operator")
    assert cell.session is not None

    def broken(*_: object, **__: object) -> None:
        raise RuntimeError("a fault in the package")

    monkeypatch.setattr(cell.session, "request", broken)
    cell.session._alive.join()
    monkeypatch.undo()
    with pytest.raises(gpac.ConnectionLost, match="has ended: RuntimeError"):
        _ = cell.now
    cell.close()


def test_a_program_takes_up_its_own_session_though_the_system_thinks_that_it_lives(daemon: Daemon) -> None:
    with gpac.connect(daemon.url, name="operator") as old:
        assert old.session is not None
        old.session.transport.cut("a cable was pulled")
        with pytest.raises(gpac.ConnectionLost, match="a cable was pulled"):
            _ = old.now
        with gpac.connect(daemon.url, name="operator") as new:
            assert new.now == 0.0
