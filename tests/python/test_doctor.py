# SPDX-License-Identifier: Apache-2.0
"""`opengpac doctor`: its output for machines of every kind, and for this one."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from opengpac import cli, doctor


def machine(root: Path, **texts: str) -> Path:
    """Creates the files with which a machine describes itself; `/` is written `__`."""
    (root / "dev/shm").mkdir(parents=True)
    for name, text in texts.items():
        file = root / name.replace("__", "/")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text + "\n")
    return root


def found(root: Path) -> dict[str, doctor.Finding]:
    return {finding.what: finding for finding in doctor.examine(seconds=0, root=root).findings}


FIT = {
    "proc__version": "Linux version 6.12.9-rt (someone) #1 SMP PREEMPT_RT",
    "proc__cpuinfo": "flags\t\t: fpu tsc",
    "proc__sys__kernel__sched_rt_runtime_us": "-1",
    "proc__sys__kernel__sched_rt_period_us": "1000000",
    "sys__kernel__realtime": "1",
    "sys__devices__system__cpu__present": "0-3",
    "sys__devices__system__cpu__isolated": "3",
    "sys__devices__system__cpu__smt__active": "0",
    "sys__devices__system__cpu__cpu0__cpufreq__scaling_governor": "performance",
    "sys__devices__system__cpu__cpu0__cpuidle__state1__latency": "2",
    "sys__devices__system__clocksource__clocksource0__current_clocksource": "tsc",
}


def test_a_machine_that_is_fit(tmp_path: Path) -> None:
    findings = found(machine(tmp_path, **FIT))
    assert {finding.state for finding in findings.values()} <= {"ok"}
    assert findings["kernel"].found == "6.12.9-rt, fully preemptible (PREEMPT_RT)"
    assert findings["isolated cores"].found.startswith("3;")
    assert not any(finding.change for finding in findings.values())


@pytest.mark.parametrize(
    ("what", "texts", "said", "change"),
    [
        ("kernel", {"proc__version": "Linux version 6.1 PREEMPT_DYNAMIC", "sys__kernel__realtime": "0"}, "not fully", "linux-image-rt"),
        (
            "frequency governor",
            {"sys__devices__system__cpu__cpu1__cpufreq__scaling_governor": "powersave"},
            "performance, powersave",
            "cpupower",
        ),
        ("isolated cores", {"sys__devices__system__cpu__isolated": ""}, "none", "isolcpus="),
        ("cores", {"sys__devices__system__cpu__present": "0"}, "one", "low priority"),
        ("hyper-threading", {"sys__devices__system__cpu__smt__active": "1"}, "on", "nosmt"),
        ("clock", {"sys__devices__system__clocksource__clocksource0__current_clocksource": "hpet"}, "hpet", "tsc"),
        ("machine", {"proc__cpuinfo": "flags\t\t: fpu hypervisor"}, "virtual", "host"),
    ],
)
def test_what_could_be_better_is_named_with_its_remedy(tmp_path: Path, what: str, texts: dict[str, str], said: str, change: str) -> None:
    finding = found(machine(tmp_path, **{**FIT, **texts}))[what]
    assert finding.state == "better" and said in finding.found and change in finding.change


def test_only_idle_states_that_are_on_and_slow_are_named(tmp_path: Path) -> None:
    place = "sys__devices__system__cpu__cpu0__cpuidle__"
    states = {"state2": ("C6", "133", "0"), "state3": ("C8", "900", "1"), "state4": ("C1E", "10", "0")}
    texts = {
        f"{place}{state}__{key}": text for state, of in states.items() for key, text in zip(("name", "latency", "disable"), of, strict=True)
    }
    assert found(machine(tmp_path, **FIT, **texts))["idle states"].found == "C6 (133 us to leave)"


def test_what_a_machine_does_not_tell_is_left_out(tmp_path: Path) -> None:
    assert set(found(machine(tmp_path))) == {"kernel", "shared memory"}


def test_without_shared_memory_something_is_missing(tmp_path: Path) -> None:
    examination = doctor.examine(seconds=0, root=tmp_path)
    assert not examination.fit and str(examination).splitlines()[-1].startswith("missing: shared memory")


def test_each_core_and_none_are_measured() -> None:
    examination = doctor.examine(seconds=0.1)
    assert [latency.core for latency in examination.latencies] == [*sorted(os.sched_getaffinity(0)), None]
    assert all(latency.firings > 0 and latency.worst_us >= 0 for latency in examination.latencies)
    assert {"rights", "latency"} <= {finding.what for finding in examination.findings}


def test_the_command_says_it_for_people_and_programs(capsys: pytest.CaptureFixture[str]) -> None:
    status = cli.main(["doctor", "--seconds", "0", "--json"])
    told = json.loads(capsys.readouterr().out)
    assert status == (0 if all(finding["state"] != "missing" for finding in told["findings"]) else 1)
    assert cli.main(["doctor", "--seconds", "0"]) == status
    assert capsys.readouterr().out.startswith(f"{told['findings'][0]['state']:<8}kernel")


def test_ctrl_c_ends_it_with_a_word(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def pressed(line: str) -> None:
        raise KeyboardInterrupt

    examine = doctor.examine
    monkeypatch.setattr(doctor, "examine", lambda seconds, tell: examine(seconds, tell=pressed))
    assert cli.main(["doctor", "--seconds", "600"]) == 130
    assert "interrupted; skip the measurement" in capsys.readouterr().err
