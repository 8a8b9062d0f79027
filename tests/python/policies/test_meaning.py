# SPDX-License-Identifier: Apache-2.0
"""The meaning of a network's numbers is declared, read from the file, and compared: mismatches are refused with both sides."""

from pathlib import Path

import numpy as np
import onnx
import pytest
from onnx import helper
from onnx.reference import ReferenceEvaluator

import opengpac as gpac
from opengpac import Term, activate
from policy_networks import dense, identity, model

JOINTS = ["hip", "knee", "ankle"]
POSE = [0.1, -0.2, 0.3]
FILE = {
    "joint_names": "hip,knee,ankle",
    "default_joint_pos": "0.100,-0.200,0.300",
    "action_scale": "0.250,0.250,0.500",
    "observation_names": "joint_pos,joint_vel,actions",
    "observation_history_lengths": "2,1,1",
    "observation_units": "rad,rad/s",
    "action_units": "rad",
    "period": "0.02",
}
"""Metadata as mjlab and the exporters of whole-body tracking write them, with our keys for units and the period."""

POSITION = {"names": JOINTS, "unit": "rad", "history": 2, "observation": "joint_pos"}
VELOCITY = {"names": JOINTS, "unit": "rad/s", "observation": "joint_vel"}
TARGET = {"names": JOINTS, "unit": "rad"}


def declared(file: Path, q: dict = {}, dq: dict = {}, target: dict = {}, swap: bool = False, **options: object) -> gpac.Policy:  # noqa: B006
    terms = [Term("q", **POSITION | q), Term("dq", **VELOCITY | dq)]
    inputs = {"obs": [*(terms[::-1] if swap else terms), Term(previous="actions", observation="actions")]}
    return gpac.policy(file, inputs, {"actions": [Term("target", **TARGET | target)]}, **{"every": "20 ms", **options})


FAULTS = {
    "order of joints": (
        {"target": {"names": ["knee", "hip", "ankle"]}},
        "joints of 'target' and their order.* knee, hip, ankle, but the file has hip, knee",
    ),
    "order of sensed joints": (
        {"q": {"names": ["hip", "ankle", "knee"]}},
        "joints of 'joint_pos' .* hip, ankle, knee, but the file has hip, knee",
    ),
    "another joint": ({"dq": {"names": ["hip", "knee", "toe"]}}, "joints of 'joint_vel' .* toe, but the file has hip, knee, ankle"),
    "unit of an input": ({"dq": {"unit": "rad"}}, "unit of 'joint_vel'.* the declaration has rad, but the file has rad/s"),
    "unit of an output": ({"target": {"unit": "N.m"}}, r"unit of 'target'.* the declaration has N\.m, but the file has rad"),
    "scale": (
        {"target": {"scale": 0.25}},
        r"scale of 'target'.* the declaration has \[0\.25, 0\.25, 0\.25\], but the file has \[0\.25, 0\.25, 0\.5\]",
    ),
    "default pose of the action": ({"target": {"offset": 0.0}}, r"offset of 'target'.* the declaration has \[0\.0.*the file has \[0\.1"),
    "default pose of an input": (
        {"q": {"offset": [0.1, 0.2, 0.3]}},
        r"offset of 'joint_pos'.* 0\.2, 0\.3\], but the file has \[0\.1, -0\.2",
    ),
    "order of observations": (
        {"swap": True},
        "order of observations.* joint_vel, joint_pos, actions, but the file has joint_pos, joint_vel, actions",
    ),
    "history": ({"q": {"history": 1}, "dq": {"history": 2}}, "history of 'joint_pos'.* the declaration has 1, but the file has 2"),
    "rate": ({"every": "10 ms"}, r"period.* the declaration has 0\.01 s, but the file has 0\.02 s"),
    "shape": (
        {"q": {"history": 3}},
        r"input 'obs' has 12 elements \(shape \[1, 12\]\), but its declaration has 15: joint_pos 3 x 3, joint_vel 3, actions 3",
    ),
    "length of a list": ({"q": {"offset": [0.1, 0.2]}}, "'joint_pos' has 3 elements, but its offset has 2"),
    "name of an output": ({"states": {"obs": "h"}}, "no output 'h'; its outputs are 'actions'"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_of_meaning_is_refused_with_both_ends(tmp_path: Path, fault: str) -> None:
    given, message = FAULTS[fault]
    with pytest.raises(gpac.ModuleError, match=message):
        declared(dense(tmp_path / "walk.onnx", [12, 3], metadata=FILE), **given)


def test_what_is_left_out_is_read_from_the_file(tmp_path: Path) -> None:
    file = dense(tmp_path / "walk.onnx", [12, 16, 3], metadata=FILE)
    policy = declared(file)
    rng = np.random.default_rng(0)
    q, dq = rng.standard_normal((6, 3)), rng.standard_normal((6, 3))
    trial = policy.run(every="20 ms", q=q, dq=dq)
    reference, before, wanted = ReferenceEvaluator(str(file)), np.zeros(3), []
    for k in range(6):
        observed = np.concatenate([q[max(k - 1, 0)] - POSE, q[k] - POSE, dq[k], before]).astype(np.float32)
        before = np.asarray(reference.run(None, {"obs": observed[None]})[0])[0]  # pyright: ignore[reportArgumentType]
        wanted.append(before * [0.25, 0.25, 0.5] + POSE)
    assert trial.fault is None
    np.testing.assert_allclose(trial.target, wanted, atol=1e-5)
    assert "hip, knee, ankle" in policy.outputs["target"].doc and policy.outputs["target"].unit == "rad"


def test_values_are_scaled_clipped_and_limited_to_the_range_of_training(tmp_path: Path) -> None:
    meant = Term("q", unit="rad", offset=[1.0, 1.0], scale=0.5, clip=(-1.0, 1.0), within=([0.0, -9.0], [1.5, 9.0]))
    out = Term("y", scale=10.0, offset=0.5, clip=(-4.0, 15.0), size=2)
    policy = gpac.policy(identity(tmp_path / "same.onnx", 2), {"obs": meant}, {"actions": out})
    # As it is, and clipped before the network; limited to the range of training, and clipped behind the network; neither.
    trial = policy.run(q=[[1.25, 2.6], [1.9, 0.05], [0.9, 1.0]])
    np.testing.assert_allclose(trial.y, [[1.75, 5.5], [3.0, -4.0], [0.0, 0.5]], atol=1e-5)
    assert [(number, name) for number, name, _ in trial.conditions] == [(1, "out_of_distribution")]


def test_another_rate_than_that_of_training_is_a_fault(tmp_path: Path) -> None:
    policy = gpac.policy(identity(tmp_path / "same.onnx", 2), every="20 ms")
    assert policy.run(steps=3, every="20 ms", obs=[0.0, 0.0]).fault is None
    assert policy.run(steps=3, every="10 ms", obs=[0.0, 0.0]).fault["text"] == "the block returned fault 2"


def test_another_rate_is_refused_where_the_verb_is_made(tmp_path: Path) -> None:
    policy = gpac.policy(identity(tmp_path / "same.onnx", 2), every="20 ms")
    with pytest.raises(gpac.SchedulingError, match="'walk' is activated every 10 ms, but policy 'same' was trained for 20 ms"):
        gpac.Verb("go", blocks={"walk": policy}, command_lists={"start": [activate("walk", every="10 ms")]})


def test_a_wrong_unit_is_refused_at_the_binding_with_both_ends(tmp_path: Path) -> None:
    cell = gpac.System("cell", clock="virtual")
    source = cell.processor("rtp0").timer("slow", period="20 ms")
    policy = gpac.policy(identity(tmp_path / "same.onnx", 2), {"obs": Term("q", size=2, unit="rad")}, every="20 ms")
    verb = gpac.Verb(
        "go", blocks={"walk": policy}, instantiation_parameters={"q": "walk.q"}, command_lists={"start": [activate("walk", every="20 ms")]}
    )
    with pytest.raises(gpac.UnitMismatch, match=r"'seconds' .*walk\.q"):
        verb.on(source)(cell.svv("seconds", "double[2]", unit="s"))
    cell.close()


def test_joints_bound_in_another_order_are_refused(tmp_path: Path) -> None:
    cell = gpac.System("cell", clock="virtual")
    source = cell.processor("rtp0").timer("slow", period="20 ms")
    policy = gpac.policy(identity(tmp_path / "same.onnx", 3), {"obs": Term("q", names=JOINTS, unit="rad")}, every="20 ms")
    verb = gpac.Verb(
        "go", blocks={"walk": policy}, instantiation_parameters={"q": "walk.q"}, command_lists={"start": [activate("walk", every="20 ms")]}
    )
    hip, knee, ankle = (cell.svv(f"leg.{joint}.sensed", unit="rad") for joint in JOINTS)
    with pytest.raises(
        gpac.DefinitionError, match=r"'walk\.q' expects the order hip, knee, ankle, but 'q' has leg\.knee\.sensed, leg\.hip"
    ):
        verb.on(source).asynch([knee, hip, ankle])
    verb.on(source).asynch([hip, knee, ankle]).halt()
    cell.close()


def test_inputs_that_are_stale_or_beyond_the_range_are_conditions(tmp_path: Path) -> None:
    meant = {"obs": Term("q", size=2, within=(-1.0, 1.0))}
    policy = gpac.policy(identity(tmp_path / "same.onnx", 2), meant, every="20 ms", age_max="50 ms")
    trial = policy.run(every="20 ms", q=[[0, 0], [0, 2], [0, 0], [0, 0], [0, 0]], observed=0)
    assert trial.conditions == [(1, "out_of_distribution", 1), (3, "stale", 60_000_000), (4, "stale", 80_000_000)]


def _network(tmp_path: Path, **changed: object) -> Path:
    of = {"nodes": [helper.make_node("Relu", ["obs"], ["actions"], name="last")], "inputs": {"obs": [1, 4]}, "outputs": {"actions": [1, 4]}}
    onnx.save(model(**of | changed), tmp_path / "bad.onnx")  # type: ignore[arg-type]
    return tmp_path / "bad.onnx"


NETWORKS = {
    "operator": (
        {"nodes": [helper.make_node("NonZero", ["obs"], ["actions"], name="odd")]},
        r"node 'odd' \(NonZero\): the operator is not supported: export",
    ),
    "attribute": (
        {"nodes": [helper.make_node("Relu", ["obs"], ["actions"], name="odd", gain=2.0)]},
        r"node 'odd' \(Relu\): its attribute 'gain' is not",
    ),
    "dynamic shape": (
        {"inputs": {"obs": [1, "width"]}},
        r"input 'obs': its dimension 1 of 2 is dynamic \('width'\): .* shapes={'obs': \(1, \.\.\.\)}",
    ),
    "opset": ({"opset": 3}, "it uses opset 3, but only 7 to"),
    "missing value": (
        {"nodes": [helper.make_node("Relu", ["ghost"], ["actions"], name="odd")]},
        "node 'odd' .* reads 'ghost', which no earlier node",
    ),
    "missing output": ({"outputs": {"other": [1, 4]}}, "no node produces its output 'other'"),
    "shapes": (
        {"nodes": [helper.make_node("MatMul", ["obs", "w"], ["actions"], name="odd")], "constants": {"w": np.zeros((5, 2), np.float32)}},
        r"node 'odd' \(MatMul\): shapes \[1, 4\] and \[5, 2\] cannot be multiplied",
    ),
    "elements": (
        {"nodes": [helper.make_node("Add", ["obs", "w"], ["actions"])], "constants": {"w": np.zeros(4, np.complex64)}},
        "initializer 'w': its elements are complex64: export the network with floats",
    ),
}


@pytest.mark.parametrize("fault", NETWORKS)
def test_a_network_that_is_not_supported_is_refused_by_its_nodes_name(tmp_path: Path, fault: str) -> None:
    changed, message = NETWORKS[fault]
    with pytest.raises(gpac.ModuleError, match=message):
        gpac.policy(_network(tmp_path, **changed))


def test_a_damaged_file_is_refused_and_never_ends_the_process(tmp_path: Path) -> None:
    whole = dense(tmp_path / "whole.onnx", [4, 8, 3]).read_bytes()
    file = tmp_path / "damaged.onnx"
    for end in range(1, len(whole) - 40, 23):
        file.write_bytes(whole[:end])
        with pytest.raises(gpac.ModuleError, match=r"damaged|no ONNX|opset"):
            gpac.policy(file)


def test_an_open_shape_may_be_given(tmp_path: Path) -> None:
    """A leading one too, which is 1 where nothing is given."""
    file = _network(tmp_path, inputs={"obs": ["batch", 4]}, outputs={"actions": ["batch", 4]})
    rows = [1.0, -1.0, 2.0, -2.0, 3.0, -3.0, -4.0, 4.0]
    assert gpac.policy(file).run(obs=[rows[:4]]).actions.shape == (1, 4)
    assert gpac.policy(file, shapes={"obs": (2, 4)}).run(obs=[rows]).actions.tolist() == [[max(x, 0.0) for x in rows]]
