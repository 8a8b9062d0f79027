# SPDX-License-Identifier: Apache-2.0
"""Processors of two hosts: their instances, and the loss of a host."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from joining import LISTENER, Joining, free_endpoint
from opengpac import activate, library, on
from opengpac.cell import DigitalOutput

LIMIT = "30 s"

VALVE = """
from opengpac.driver import Driver, write


class Valves(Driver):
    valve = write("bool")

    def exchange(self):
        pass
"""


def reaches(name: str = "reaches", **options: Any) -> gpac.Verb[..., Any]:
    """Returns a verb whose constant arrives on another processor."""
    return gpac.Verb(
        name,
        blocks={"wave": library.signal_generator(amplitude=0.0, offset=1.5), "far": library.await_range(low=1.0, high=2.0)},
        cells={"u": ["wave.y", "far.u"]},
        output_values={"seen": "wave.y"},
        command_lists={"start": [activate("far"), activate("wave", every="5 ms")]},
        conditions={"far": on("far.done", returns=["seen"])},
        **options,
    )


def endless() -> gpac.Verb[..., Any]:
    """Returns a verb that runs until something ends it."""
    return gpac.Verb(
        "endless",
        blocks={"wave": library.signal_generator(amplitude=1.0)},
        instantiation_parameters={"y": "wave.y"},
        command_lists={"start": [activate("wave", every="5 ms")]},
    )


def timer(cell: gpac.System, name: str, **hardware: Any) -> gpac.Source:
    """Returns a timer of 5 ms on a processor of its own."""
    return cell.processor(name, **hardware).timer("fast", period="5 ms", priority=80)


def test_a_value_goes_to_the_other_host_and_a_report_comes_back(listening: gpac.System, joins: Callable[..., Joining]) -> None:
    joins()
    here = timer(listening, "rtp0")
    there = listening.processor("rtp1", host="cell-b").software("soft", priority=70)
    assert reaches().on({"wave": here, "far": there})(time_limit=LIMIT).seen == 1.5


def test_a_code_module_goes_to_the_other_host(listening: gpac.System, joins: Callable[..., Joining], built: dict[str, str]) -> None:
    joins()
    timer(listening, "rtp0")
    there = timer(listening, "rtp1", host="cell-b")
    counting = gpac.Verb(
        "counting",
        blocks={"count": listening.download(built["count"], "count")["count"]},
        input_parameters={"limit": "count.enough"},
        output_values={"last": "count.y"},
        command_lists={"start": [activate("count", every="5 ms")]},
        conditions={"enough": on("count.enough", returns=["last"])},
    )
    assert counting.on(there)(limit=10, time_limit=LIMIT).last == 10


def test_a_device_is_opened_on_the_other_host(listening: gpac.System, joins: Callable[..., Joining]) -> None:
    joins()
    timer(listening, "rtp0")
    processor = listening.processor("rtp1", host="cell-b")
    there = processor.timer("fast", period="5 ms", priority=80)
    drive = processor.physical_device("drive", gpac.drivers.loopback("x"), exchange=there)
    push = gpac.Verb(
        "push",
        blocks={
            "push": library.signal_generator(amplitude=0.0, offset=1.0),
            "write": library.write_channel,
            "read": library.read_channel,
            "far": library.await_range(low=0.001, high=1e6),
        },
        instantiation_parameters={"drive.position": "read.channel", "drive.effort": "write.channel"},
        cells={"u": ["push.y", "write.u"], "q": ["read.y", "far.u"]},
        output_values={"position": "read.y"},
        command_lists={"start": [activate("push", every="5 ms"), activate("write"), activate("read", every="5 ms"), activate("far")]},
        conditions={"far": on("far.done", returns=["position"])},
    )
    assert push.on(there)(drive["x"], time_limit=LIMIT).position >= 0.001


def test_a_device_that_only_a_guard_makes_safe_is_warned_of_on_a_lent_host(
    listening: gpac.System, joins: Callable[..., Joining], caplog: pytest.LogCaptureFixture, tmp_path: Path
) -> None:
    joins()
    (tmp_path / "valve.py").write_text(VALVE)
    valves = []
    for name, hardware in (("rtp0", {}), ("rtp1", {"host": "cell-b"})):
        processor = listening.processor(name, **hardware)
        source = processor.timer("fast", period="10 ms", priority=80)
        device = processor.physical_device(f"plc_{name}", gpac.drivers.python(tmp_path / "valve.py", age_max="60 s"), exchange=source)
        valves.append(DigitalOutput(f"valve_{name}", device["valve"]))
    for valve in valves:
        valve.enable()
        valve.disable()
        valve.enable()
    said = [record.getMessage() for record in caplog.records if "continues to execute its last commands" in record.getMessage()]
    assert len(said) == 1 and "'plc_rtp1'" in said[0] and "no guard runs on host 'cell-b'" in said[0], said
    assert [(entry["about"], entry["text"]) for entry in listening.log() if entry["kind"] == "guard"] == [("plc_rtp1", said[0])]
    devices = listening.physical_devices
    assert devices["plc_rtp1"].about["unguarded"] and not devices["plc_rtp0"].about.get("unguarded")


def test_two_hosts_join_beside_each_other(listening: gpac.System, joins: Callable[..., Joining]) -> None:
    joins("cell-b")
    joins("cell-c")
    timer(listening, "rtp0")
    there = timer(listening, "rtp1", host="cell-b")
    elsewhere = listening.processor("rtp2", host="cell-c").software("soft", priority=70)
    assert reaches().on({"wave": there, "far": elsewhere})(time_limit=LIMIT).seen == 1.5


def test_a_host_that_is_killed_is_lost_and_the_others_go_on(listening: gpac.System, joins: Callable[..., Joining]) -> None:
    host = joins()
    here, there = timer(listening, "rtp0"), timer(listening, "rtp1", host="cell-b")
    stays = endless().on(here).asynch(listening.svv("stays"))
    goes = endless().on(there).asynch(listening.svv("goes"))
    host.kill()
    with pytest.raises(gpac.Terminated) as caught:
        goes.wait(timeout=LIMIT)
    assert caught.value.condition == "processor_lost" and "rtp1" in str(caught.value)
    assert stays.state == "running"
    assert reaches().on(here)(time_limit=LIMIT).seen == 1.5
    with pytest.raises(gpac.InvalidState, match="rtp1"):
        reaches("again").on(there)(time_limit=LIMIT)


def test_after_a_reset_a_host_that_has_joined_again_works(listening: gpac.System, joins: Callable[..., Joining]) -> None:
    first = joins()
    timer(listening, "rtp0")
    there = timer(listening, "rtp1", host="cell-b")
    goes = endless().on(there).asynch(listening.svv("goes"))
    first.kill()
    with pytest.raises(gpac.Terminated, match="processor_lost"):
        goes.wait(timeout=LIMIT)
    joins()
    listening.reset()
    assert reaches().on(there)(time_limit=LIMIT).seen == 1.5


@pytest.mark.parametrize("way", ["certificates", "token"])
def test_a_host_joins_over_tls(certificates: Path, joins: Callable[..., Joining], tmp_path: Path, way: str) -> None:
    at = free_endpoint("tls")
    server: dict[str, Any] = {"certificate": certificates / "server.pem", "key": certificates / "server.key"}
    options = ["--ca", str(certificates / "ca.pem")]
    if way == "token":
        (tmp_path / "token").write_text("a-token-of-the-tests\n")
        server["token"] = "a-token-of-the-tests"
        options += ["--token-file", str(tmp_path / "token")]
    else:
        server["authority"] = certificates / "ca.pem"
        options += ["--cert", str(certificates / "client.pem"), "--key", str(certificates / "client.pem")]
    with gpac.System("line", progress=False) as cell:
        cell.listen(at, LISTENER, **server)
        joins("cell-b", *options, at=at)
        timer(cell, "rtp0")
        assert reaches().on(timer(cell, "rtp1", host="cell-b"))(time_limit=LIMIT).seen == 1.5


def test_a_host_without_the_token_stays_out(certificates: Path, joins: Callable[..., Joining], tmp_path: Path) -> None:
    at = free_endpoint("tls")
    (tmp_path / "token").write_text("another-token-of-the-tests\n")
    with gpac.System("line", progress=False) as cell:
        cell.listen(at, LISTENER, token="a-token-of-the-tests", certificate=certificates / "server.pem", key=certificates / "server.key")
        status, said = joins("cell-b", "--ca", str(certificates / "ca.pem"), "--token-file", str(tmp_path / "token"), at=at).ended()
    assert status == 1 and f"cannot connect to '{at}'" in said and "another-token" not in said
