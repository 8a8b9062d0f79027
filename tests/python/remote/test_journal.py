# SPDX-License-Identifier: Apache-2.0
"""A daemon with a journal is killed and restarted: programs find their cell as it was."""

from __future__ import annotations

import resource
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import opengpac as gpac
import swing
from daemons import PATIENCE_S, Daemon, environment
from opengpac.robots import Joint

MODEL = """<mujoco><worldbody><body name="link"><joint name="hinge" axis="0 1 0"/><geom type="capsule" size="0.02 0.1"/></body></worldbody>
<actuator><motor name="hinge" joint="hinge"/></actuator></mujoco>"""


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[..., Daemon]]:
    """Yields a function that starts the daemon of one journal repeatedly; ends all of them."""
    made: list[Daemon] = []

    def again(*options: str) -> Daemon:
        made.append(Daemon(tmp_path, "virtual", "--journal", str(tmp_path / "cell.journal"), *options))
        return made[-1]

    yield again
    for one in reversed(made):
        one.stop()


def test_a_daemon_that_was_killed_holds_the_joint_again(start: Callable[..., Daemon]) -> None:
    daemon = start()
    cell = gpac.connect(daemon.url, name="panel")
    axis = swing.build(cell).enable()
    axis.kp = 45.0
    swing.swing().on(cell.sources["rtp0.slow"]).new_instance(axis).start(seconds=1000.0)
    daemon.kill()
    with pytest.raises(gpac.ConnectionLost):
        assert cell.names
    daemon = start()
    assert "played 10 of 10 calls, 0 of them failed" in daemon.said
    with gpac.connect(daemon.url, name="panel") as cell:
        assert cell.session is not None and cell.session.returned
        axis = cell.device("axis", Joint)
        assert (axis.state, axis.kp) == ("standstill", 45.0), "the servo goes on, the motion does not"
        assert all(i.device for i in cell.instances)
        assert swing.swing().on(cell.sources["rtp0.slow"])(axis, seconds=0.2).condition == "over"


def test_after_an_end_in_order_everything_is_there_and_nothing_runs(start: Callable[..., Daemon]) -> None:
    daemon = start()
    with gpac.connect(daemon.url, name="panel") as cell:
        swing.build(cell).enable()
    daemon.stop()
    with gpac.connect(start().url, name="panel") as cell:
        axis = cell.device("axis", Joint)
        assert axis.state == "disabled"
        assert axis.enable().state == "standstill"


def test_a_program_that_makes_its_own_system_leaves_nothing_to_do(start: Callable[..., Daemon], tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(
        "import opengpac as gpac, swing\n"
        "with gpac.System('cell', clock='virtual') as cell:\n"
        "    axis = swing.build(cell).enable()\n"
        "    swing.swing().on(cell.sources['rtp0.slow'])(axis, seconds=0.2)\n"
    )
    daemon, lines = start(), []
    paths = f"{Path(__file__).parent.parent}:{environment()['PYTHONPATH']}"
    for _ in range(3):
        subprocess.run(
            [sys.executable, program], env=environment(PYTHONPATH=paths, OPENGPAC_SYSTEM=daemon.url), timeout=PATIENCE_S, check=True
        )
        daemon.kill()
        daemon = start()
        lines.append(len((tmp_path / "cell.journal").read_text().splitlines()))
    assert lines[1:] == lines[:-1], "what is defined again and deleted again does not make it longer"
    with gpac.connect(daemon.url) as cell:
        assert (cell.instances, cell.names["logical_devices"]) == ([], [])


def test_the_files_of_a_model_are_kept_beside_it(start: Callable[..., Daemon], tmp_path: Path) -> None:
    (tmp_path / "link.xml").write_text(MODEL)
    daemon = start()
    with gpac.connect(daemon.url) as cell:
        fast = cell.processor("rtp0").timer("fast", period="2 ms", priority=80)
        fast.processor.physical_device("link", gpac.drivers.mujoco(tmp_path / "link.xml"), exchange=fast)
    daemon.kill()
    (tmp_path / "link.xml").unlink()
    with gpac.connect(start().url) as cell:
        assert "hinge" in cell.physical_devices["link"].parts


def test_where_the_disk_is_full_it_says_so_and_knows_it_later(start: Callable[..., Daemon], tmp_path: Path) -> None:
    daemon, journal = start("--audit", "/dev/null"), tmp_path / "cell.journal"

    def room(size: int) -> None:
        resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))

    with gpac.connect(daemon.url, name="panel") as cell:
        axis = swing.build(cell).enable()
        room(journal.stat().st_size + 10)
        with pytest.raises(gpac.AuditFailed, match=r"cannot be written.*the call was carried out, but is lost if the daemon dies"):
            cell.svv("first", "double")
        with pytest.raises(gpac.AuditFailed, match=r"cannot be written.*nothing was done; free up disk space"):
            cell.svv("second", "double")
        axis.kp = 45.0
        axis.disable()
        axis.enable()
        cell.emergency_stop("a disk holds nobody up")
        cell.reset()
        assert "second" not in cell.names["svvs"]
        room(resource.RLIM_INFINITY)
        cell.svv("third", "double")
        assert any("cannot be written" in entry["text"] for entry in cell.log() if entry["kind"] == "journal")
    daemon.kill()
    with gpac.connect(start().url, name="panel") as cell:
        assert {"first", "third"} <= {*cell.names["svvs"]}
        assert (cell.device("axis", Joint).kp, cell.device("axis").state) == (45.0, "disabled")


def refused(tmp_path: Path, *options: str) -> str:
    """Returns the message of a daemon that does not start."""
    words = [
        "rts",
        "--name",
        "cell",
        "--socket",
        str(tmp_path / "cell.sock"),
        "--clock",
        "virtual",
        "--journal",
        str(tmp_path / "cell.journal"),
    ]
    done = subprocess.run(
        [sys.executable, "-m", "opengpac", *words, *options], env=environment(), capture_output=True, text=True, timeout=PATIENCE_S
    )
    assert done.returncode == 1 and "listening" not in done.stdout
    return done.stderr


def test_a_journal_that_cannot_be_played_is_refused_by_file_and_line(start: Callable[..., Daemon], tmp_path: Path) -> None:
    daemon, journal = start(), tmp_path / "cell.journal"
    with gpac.connect(daemon.url) as cell:
        cell.processor("rtp0")
        cell.svv("level", "double")
    daemon.kill()
    text = journal.read_text()
    journal.write_text(text.replace('"line":"call"', '"line":"cull"'))
    assert f"the journal '{journal}' cannot be played: line 2: unknown variant" in refused(tmp_path)
    journal.write_text(text.replace('"double"', '"treble"'))
    assert "line 3: call 'svv' failed" in refused(tmp_path, "--journal-strict")
    daemon = start()
    assert "played 2 of 2 calls, 1 of them failed" in daemon.said
    assert "another daemon keeps the journal" in refused(tmp_path, "--socket", str(tmp_path / "other.sock"))


def test_what_does_not_go_together_is_said(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "opengpac", "rts", "--journal-strict", "--socket", str(tmp_path / "s")],
        env=environment(), capture_output=True, text=True, timeout=PATIENCE_S,
    )  # fmt: skip
    assert done.returncode == 1 and "--journal-strict is given without a journal; add --journal FILE" in done.stderr
