# SPDX-License-Identifier: Apache-2.0
"""Parallel tests: each runs once, `alone` ones at the end, and a test that kills its process fails alone."""

from __future__ import annotations

import json
import os
import random
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from afar import until
from orphans import lives
from stretches import Stretches

RUNNING = Path(__file__).parent.parent / "running"
COMMAND = [sys.executable, "-m", "pytest", "-p", "side_by_side", "-p", "no:cacheprovider", "-o", "addopts=", "-n", "3"]


def environment() -> dict[str, str]:
    """Returns the environment of a separate run: with the plugin, without those of installed packages."""
    outside = {key: value for key, value in os.environ.items() if not key.startswith("PYTEST")}
    return {**outside, "PYTHONPATH": str(RUNNING), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}


def run(folder: Path, text: str, *options: str) -> subprocess.CompletedProcess[str]:
    """Runs a file of tests in three workers."""
    (folder / "pytest.ini").write_text("[pytest]\n")
    (folder / "test_it.py").write_text(text)
    return subprocess.run([*COMMAND, *options], cwd=folder, env=environment(), capture_output=True, text=True, timeout=120, check=False)


@given(st.integers(0, 60), st.integers(1, 7), st.integers(0, 2**32))
def test_every_test_is_taken_once_whoever_asks(tests: int, workers: int, seed: int) -> None:
    stretches, chance = Stretches(range(tests), workers), random.Random(seed)
    taken: list[int] = []
    asking = [*range(workers)]
    while asking:
        worker = chance.choice(asking)
        test = chance.choice([stretches.take, stretches.neighbour])(worker)
        if test is None and (test := stretches.take(worker)) is None:
            asking.remove(worker)
        elif chance.random() < 0.1:
            stretches.put_back(worker, test)
        else:
            taken.append(test)
    assert sorted(taken) == [*range(tests)]


def test_neighbours_stay_with_one_worker_while_it_has_some() -> None:
    stretches = Stretches(range(12), 3)
    assert [stretches.take(1) for _ in range(4)] == [4, 5, 6, 7]
    assert [stretches.take(1) for _ in range(2)] == [2, 3], "the second half of the longest stretch"


EACH_ONCE = """
import os, pathlib, pytest

@pytest.fixture(scope="module", autouse=True)
def counted():
    with open("setups", "a") as out:
        out.write(f"{os.environ['PYTEST_WORKER']}\\n")

@pytest.mark.parametrize("n", range(40))
def test_it(n, tmp_path, capsys):
    print("seen", n)
    assert capsys.readouterr().out == f"seen {n}\\n"
    with open("ran", "a") as out:
        out.write(f"{n} {os.environ['PYTEST_WORKER']} {os.environ['XDG_RUNTIME_DIR']}\\n")
    (tmp_path / "one").mkdir()
"""


def test_each_test_runs_once_in_workers_with_folders_of_their_own(tmp_path: Path) -> None:
    ran = run(tmp_path, EACH_ONCE)
    assert ran.returncode == 0 and "40 passed" in ran.stdout, ran.stdout + ran.stderr
    rows = [line.split() for line in (tmp_path / "ran").read_text().splitlines()]
    assert sorted(int(number) for number, _, _ in rows) == list(range(40))
    workers = {worker: folder for _, worker, folder in rows}
    assert len({*workers.values()}) == len(workers) and not any(map(os.path.exists, workers.values()))
    setups = (tmp_path / "setups").read_text().split()
    assert len(setups) < 40 and {*setups} == {*workers}, "a fixture of the module is made once for neighbours, not for each"
    notes = [json.loads(line) for line in (tmp_path / "out" / "tests.jsonl").read_text().splitlines()]
    assert len(notes) == 40 and all(note["processor_s"] >= 0.0 for note in notes)


ALONE = """
import os, pathlib, pytest

def others():
    return [name for name in os.listdir("running") if name != str(os.getpid())]

@pytest.fixture(autouse=True)
def running():
    pathlib.Path("running").mkdir(exist_ok=True)
    mine = pathlib.Path("running", str(os.getpid()))
    mine.touch()
    yield
    mine.unlink()

@pytest.mark.alone
@pytest.mark.parametrize("n", range(5))
def test_alone(n):
    assert not others()
    assert len(list(open("ended"))) == 30

@pytest.mark.parametrize("n", range(30))
def test_together(n):
    with open("ended", "a") as out:
        out.write("one\\n")
"""


def test_those_that_have_to_be_alone_come_after_all_others_have_ended(tmp_path: Path) -> None:
    ran = run(tmp_path, ALONE)
    assert ran.returncode == 0 and "35 passed" in ran.stdout, ran.stdout + ran.stderr


DIES = """
import os, signal, pytest

@pytest.mark.parametrize("n", range(20))
def test_it(n):
    if n == 7:
        os.kill(os.getpid(), signal.SIGKILL)
    if n == 13:
        os._exit(3)
    assert n != 17, "seventeen"
"""


def test_one_that_kills_its_process_fails_by_its_name_and_the_others_run(tmp_path: Path) -> None:
    ran = run(tmp_path, DIES)
    assert ran.returncode == 1 and "3 failed, 17 passed" in ran.stdout, ran.stdout + ran.stderr
    assert re.search(r"worker w\d ended by SIGKILL while it ran test_it.py::test_it\[7\]", ran.stdout), ran.stdout
    assert re.search(r"worker w\d ended with status 3 while it ran test_it.py::test_it\[13\]", ran.stdout), ran.stdout
    assert "AssertionError: seventeen" in ran.stdout


def test_the_first_failure_ends_the_run_where_that_is_asked_for(tmp_path: Path) -> None:
    ran = run(tmp_path, "import pytest\n@pytest.mark.parametrize('n', range(900))\ndef test_it(n):\n    assert n\n", "-x")
    assert ran.returncode == 1 and "stopping after 1 failures" in ran.stdout, ran.stdout + ran.stderr
    assert "1 failed" in ran.stdout and "899 passed" not in ran.stdout


WAITS = """
import os, pathlib, time, pytest

@pytest.fixture(autouse=True)
def cleans():
    pathlib.Path(f"{os.getpid()}.began").touch()
    yield
    pathlib.Path(f"{os.getpid()}.cleaned").touch()

@pytest.mark.parametrize("n", range(3))
def test_it(n):
    time.sleep(600)
"""


@pytest.mark.parametrize("signal_number", [signal.SIGINT, signal.SIGKILL])
def test_an_interrupted_run_leaves_no_worker(tmp_path: Path, signal_number: int) -> None:
    """Ctrl-C cleans up all fixtures; if the first process is killed, each worker ends with its test."""
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    (tmp_path / "test_it.py").write_text(WAITS if signal_number == signal.SIGINT else WAITS.replace("600", "0.5"))
    with subprocess.Popen(COMMAND, cwd=tmp_path, env=environment(), stdout=subprocess.PIPE, text=True) as started:
        try:
            until(lambda: len([*tmp_path.glob("*.began")]) == 3, "three tests run")
            workers = [int(path.stem) for path in tmp_path.glob("*.began")]
            started.send_signal(signal_number)
            said = started.communicate()[0]
        finally:
            started.kill()
    until(lambda: not any(map(lives, workers)), "the workers have ended")
    if signal_number == signal.SIGINT:
        assert "KeyboardInterrupt" in said or "Interrupted" in said, said
        assert len([*tmp_path.glob("*.cleaned")]) == 3
