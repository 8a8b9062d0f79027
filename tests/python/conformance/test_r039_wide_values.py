# SPDX-License-Identifier: Apache-2.0
"""Types at their extremes: numbers from 2^63 up, and arrays of more than one dimension."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import opengpac as gpac
from opengpac import activate, on
from opengpac import library as lib
from rig import Rig

MOST = 2**64 - 1


@pytest.mark.parametrize("less", [0, 1, 2**63 - 1, 2**63])
def test_r039_a_uint64_is_a_number_in_stores_outputs_and_reports(rig: Rig, less: int) -> None:
    y = rig.cell.svv("y", "uint64_t")
    verb = gpac.Verb(
        "filling",
        blocks={"m": rig.block("wide.most")},
        instantiation_parameters={"y": "m.y"},
        input_parameters={"less": "m.less"},
        output_values={"y": "m.y", "full": "m.full"},
        conditions={"full": on("m.full", returns=["y", "full"])},
        command_lists={"start": [activate("m", every="1 ms")]},
    )
    report = verb.on(rig.fast)(y, less=less)
    assert [y.value, report.y, report.full, report.value] == [MOST - less] * 4
    assert {type(given) for given in (report.y, report.full, report.value)} == {int}


def test_r039_a_uint64_is_stored_whole(memory_rig: Rig) -> None:
    y = memory_rig.cell.svv("y", "uint64_t", initial=2**63)
    assert y.value == 2**63
    for value in (MOST, np.uint64(MOST), 2**63 + 1, 5):
        y.value = value
        assert y.value == int(value)
    pair = memory_rig.cell.svv("pair", "uint64_t[2]", initial=[1, MOST])
    assert pair.value.tolist() == [1, MOST]
    for wrong in (2**64, -1):
        with pytest.raises(gpac.ValueRefused):
            y.value = wrong
    with pytest.raises(gpac.ValueRefused, match="does not fit int64_t"):
        memory_rig.cell.svv("signed", "int64_t", initial=2**63)


def test_r039_a_matrix_is_a_type_of_ports_parameters_and_state(memory_rig: Rig) -> None:
    tried = memory_rig.block("matrix.scaled").run(a=[[[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]] * 2)
    first = np.array([[1.0, 2.0], [3.0, 4.0], [4.0, 6.0]])
    assert np.array_equal(tried.y, [first, 2 * first])


def test_r039_the_jacobian_of_the_library_is_wired_to_a_block_in_c(rig: Rig) -> None:
    names = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"]
    arm = gpac.robots.Kinematics.of_mjcf(str(Path(gpac.__file__).parent / "robots" / "ur5e.xml"), names)
    verb = gpac.Verb(
        "pushing",
        blocks={"j": lib.jacobian(chain=arm.chain), "e": rig.block("matrix.efforts")},
        instantiation_parameters={"q": "j.q", "wrench": "e.wrench", "effort": "e.effort"},
        cells={"jacobian": ["j.jacobian", "e.jacobian"]},
        modes={"j.q": "asynchronous"},
        command_lists={"start": [activate("j", every="1 ms"), activate("e", every="1 ms")]},
    )
    q = rig.cell.svv("q", "double[6]", initial=[0.1, -1.2, 1.1, 0.3, 0.7, 0.2])
    wrench = rig.cell.svv("wrench", "double[6]", initial=[10.0, -5.0, 3.0, 0.5, 0.2, -0.1])
    effort = rig.cell.svv("effort", "double[6]")
    verb.on(rig.fast).asynch(q, wrench, effort)
    rig.cell.advance("3 ms")
    jacobian = lib.jacobian.run(q=[q.value], chain=arm.chain).jacobian[0]
    assert np.allclose(effort.value, jacobian @ wrench.value) and np.abs(effort.value).min() > 0
