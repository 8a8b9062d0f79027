# SPDX-License-Identifier: Apache-2.0
"""A call of a verb on a remote system, `verb(...)`: one request, which leaves nothing behind, however it ends."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator

import pytest

import opengpac as gpac
from afar import until
from daemons import Daemon
from rig import Rig


@pytest.fixture
def far_rig(real_daemon: Daemon, built: dict[str, str]) -> Iterator[Rig]:
    """Yields the small system in a daemon, in real time."""
    with gpac.connect(real_daemon.url, name="tests") as cell:
        yield Rig(cell, built)


def test_a_remote_call_leaves_nothing_either(far_rig: Rig) -> None:
    (a,) = far_rig.svvs("a")
    counting = far_rig.counting().on(far_rig.fast)
    assert [counting(a, limit=3).instance for _ in range(3)] == ["counting#1", "counting#2", "counting#3"]
    assert counting(a, limit=200).last == 200.0, "one that lasts longer than a request"
    with pytest.raises(gpac.Error):
        counting(a, limit="three")
    assert far_rig.cell.names["instances"] == []


@pytest.mark.parametrize("after_s", [0.03, 0.35])
def test_ctrl_c_in_a_remote_call_halts_it(far_rig: Rig, after_s: float) -> None:
    (a,) = far_rig.svvs("a")
    counting = far_rig.counting().on(far_rig.fast)
    counting(a, limit=3)

    def interrupt() -> None:
        until(lambda: a.number > 5, "it runs")
        time.sleep(after_s)
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=interrupt)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        counting(a, time_limit="60 s")
    thread.join()
    assert far_rig.cell.names["instances"] == []


def test_a_connection_that_is_lost_in_a_call_is_told(real_daemon: Daemon, built: dict[str, str]) -> None:
    cell = gpac.connect(real_daemon.url, name="tests")
    rig = Rig(cell, built)
    (a,) = rig.svvs("a")
    ending = threading.Timer(0.3, real_daemon.stop)
    ending.start()
    with pytest.raises(gpac.ConnectionLost):
        rig.counting().on(rig.fast)(a, time_limit="60 s")
    ending.join()
    cell.close()
