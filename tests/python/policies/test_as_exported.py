# SPDX-License-Identifier: Apache-2.0
"""Networks in the forms in which exporters write them, compared with the reference evaluator of `onnx`."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper
from onnx.reference import ReferenceEvaluator

import opengpac as gpac
from opengpac import Term
from policies.test_sanitized import kept
from policy_networks import dense, model

__all__ = ["kept"]

RNG = np.random.default_rng(5)
W = RNG.standard_normal((4, 3)).astype(np.float32)


def saved(tmp_path: Path, made: onnx.ModelProto, name: str = "net.onnx", **how: Any) -> Path:
    onnx.save(made, tmp_path / name, **how)
    return tmp_path / name


def same_as_reference(file: Path, policy: gpac.Policy, **given: np.ndarray) -> None:
    """Checks that one invocation of the block gives the reference's values for the inputs in their own shapes."""
    expected = ReferenceEvaluator(str(file)).run(None, given)
    ran = policy.run(**{name: [np.ravel(value).astype(float)] for name, value in given.items()})
    assert ran.fault is None, ran.fault
    for output, value in zip(onnx.load(file).graph.output, expected, strict=True):
        np.testing.assert_allclose(np.ravel(getattr(ran, output.name)[0]), np.ravel(value).astype(float), rtol=2e-5, atol=1e-5)


def test_weights_in_a_second_file(tmp_path: Path) -> None:
    made = onnx.load(dense(tmp_path / "whole.onnx", [12, 32, 4]))
    file = saved(tmp_path, made, save_as_external_data=True, location="net.onnx.data", size_threshold=0)
    assert (tmp_path / "net.onnx.data").stat().st_size > 1000
    obs = RNG.standard_normal((1, 12)).astype(np.float32)
    same_as_reference(file, gpac.policy(file), obs=obs)
    cell = gpac.System("cell", clock="virtual")
    code = cell.download(str(file))
    np.testing.assert_array_equal(code["net"].run(obs=obs).actions, gpac.policy(tmp_path / "whole.onnx").run(obs=obs).actions)


def _second_file(tmp_path: Path, change: Callable[[onnx.TensorProto], None]) -> Path:
    made = onnx.load(dense(tmp_path / "whole.onnx", [12, 32, 4]))
    file = saved(tmp_path, made, save_as_external_data=True, location="net.onnx.data", size_threshold=0)
    made = onnx.load(file, load_external_data=False)
    change(made.graph.initializer[0])
    file.write_bytes(made.SerializeToString())
    return file


def _entry(key: str, value: str) -> Callable[[onnx.TensorProto], None]:
    def change(tensor: onnx.TensorProto) -> None:
        for entry in tensor.external_data:
            if entry.key == key:
                entry.value = value

    return change


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("location", "gone.data", "its values are in 'gone.data', which cannot be read in the folder of the network"),
        ("location", "../whole.onnx", "'../whole.onnx', which is outside the folder of the network"),
        ("location", "/etc/passwd", "'/etc/passwd', which is outside the folder of the network"),
        ("offset", "99999999", "its values end at byte 100001535 of 'net.onnx.data'"),
        ("length", "many", "its length 'many' is not a number"),
        ("length", "3", "its shape [32, 12] needs 384 values, but the file has a different number"),
    ],
)
def test_a_second_file_that_does_not_fit_is_refused_with_the_name_of_the_first(tmp_path: Path, key: str, value: str, words: str) -> None:
    file = _second_file(tmp_path, _entry(key, value))
    with pytest.raises(gpac.errors.ModuleError) as refusal:
        gpac.policy(file)
    assert words in str(refusal.value) and f"policy '{file}' is refused" in str(refusal.value)


@pytest.mark.parametrize("leading", ["batch", None, -1])
def test_an_open_leading_dimension_is_one_and_is_told(tmp_path: Path, leading: Any) -> None:
    made = onnx.load(dense(tmp_path / "whole.onnx", [12, 8, 4]))
    for value in (*made.graph.input, *made.graph.output):
        dim = value.type.tensor_type.shape.dim[0]
        dim.Clear()
        if isinstance(leading, str):
            dim.dim_param = leading
        elif leading is not None:
            dim.dim_value = leading
    file = saved(tmp_path, made)
    policy = gpac.policy(file)
    assert "Left open by the file: dimension 0" in policy.doc and "of input 'obs' is 1" in policy.doc
    same_as_reference(file, policy, obs=RNG.standard_normal((1, 12)).astype(np.float32))


def test_the_symbol_of_a_leading_dimension_is_one_wherever_it_stands(tmp_path: Path) -> None:
    nodes = [helper.make_node("Transpose", ["memory"], ["flat"], perm=[1, 0, 2]), helper.make_node("Squeeze", ["flat", "one"], ["rows"]),
             helper.make_node("Add", ["obs", "rows"], ["y"])]  # fmt: skip
    made = model(nodes, {"obs": ["n", 3], "memory": [1, "n", 3]}, {"y": [1, 3]}, {"one": np.array([1])})
    file = saved(tmp_path, made)
    same_as_reference(file, gpac.policy(file), obs=np.ones((1, 3), np.float32), memory=np.full((1, 1, 3), 2, np.float32))


def test_another_open_dimension_is_refused_and_can_be_given(tmp_path: Path) -> None:
    made = model([helper.make_node("Relu", ["obs"], ["y"])], {"obs": ["batch", "width"]}, {"y": [1, 3]})
    file = saved(tmp_path, made)
    with pytest.raises(gpac.errors.ModuleError, match=r"dimension 1 of 2 is dynamic \('width'\).*shapes=\{'obs': \(1, \.\.\.\)\}"):
        gpac.policy(file)
    same_as_reference(file, gpac.policy(file, shapes={"obs": (1, 3)}), obs=np.array([[-1, 0, 2]], np.float32))


def test_what_no_output_needs_is_left_out(tmp_path: Path) -> None:
    nodes = [helper.make_node("StringNormalizer", ["names"], ["unused"], name="strange"), helper.make_node("Relu", ["obs"], ["y"])]
    made = model(nodes, {"obs": [1, 3]}, {"y": [1, 3]}, {"names": np.array(["a"], dtype=object)})
    assert gpac.policy(saved(tmp_path, made)).run(obs=[[-1.0, 0.0, 2.0]]).y.tolist() == [[0.0, 0.0, 2.0]]


@pytest.mark.parametrize("kind", [np.float16, np.float64])
def test_weights_and_inputs_of_other_widths(tmp_path: Path, kind: Any) -> None:
    of = helper.np_dtype_to_tensor_dtype(np.dtype(kind))
    graph = helper.make_graph(
        [helper.make_node("MatMul", ["obs", "w"], ["h"]), helper.make_node("Tanh", ["h"], ["y"])],
        "wide",
        [helper.make_tensor_value_info("obs", of, [1, 4])],
        [helper.make_tensor_value_info("y", of, [1, 3])],
        [numpy_helper.from_array(W.astype(kind), "w")],
    )
    file = saved(tmp_path, helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=10))
    obs = RNG.standard_normal((1, 4)).astype(kind)
    exact = np.tanh(obs.astype(float) @ W.astype(kind).astype(float))
    np.testing.assert_allclose(gpac.policy(file).run(obs=obs.astype(float)).y, exact, rtol=1e-5, atol=1e-6)


def test_half_precision_is_read_to_the_bit(tmp_path: Path) -> None:
    every = np.arange(2**16, dtype=np.uint16).view(np.float16)
    values = every[np.isfinite(every)][::61]
    for raw in (True, False):
        listed = helper.make_tensor("w", TensorProto.FLOAT16, [len(values)], values.tolist())
        tensor = numpy_helper.from_array(values, "w") if raw else listed
        graph = helper.make_graph(
            [helper.make_node("Cast", ["w"], ["x"], to=TensorProto.FLOAT), helper.make_node("Add", ["x", "obs"], ["y"])],
            "half",
            [helper.make_tensor_value_info("obs", TensorProto.FLOAT, [1])],
            [helper.make_tensor_value_info("y", TensorProto.FLOAT, [len(values)])],
            [tensor],
        )
        file = saved(tmp_path, helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=10), f"half_{raw}.onnx")
        np.testing.assert_array_equal(gpac.policy(file).run(obs=[[0.0]]).y[0], values.astype(float))


def test_an_input_of_integers_chooses_rows_of_a_table(tmp_path: Path) -> None:
    """An embedding of a command, as in language and skill policies."""
    graph = helper.make_graph(
        [helper.make_node("Gather", ["table", "skill"], ["row"]), helper.make_node("Add", ["row", "obs"], ["y"])],
        "skills",
        [
            helper.make_tensor_value_info("skill", TensorProto.INT64, ["batch"]),
            helper.make_tensor_value_info("obs", TensorProto.FLOAT, [1, 3]),
        ],
        [helper.make_tensor_value_info("y", TensorProto.FLOAT, [1, 3])],
        [numpy_helper.from_array(W, "table")],
    )
    file = saved(tmp_path, helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=10))
    policy = gpac.policy(file)
    obs = np.array([[1, 2, 3]], np.float32)
    for skill in (0, 3, -1):
        same_as_reference(file, policy, skill=np.array([skill]), obs=obs)
    assert policy.run(skill=[[4.0]], obs=obs.astype(float)).fault is not None


def test_integers_in_an_operator_for_floats_are_refused_by_the_node(tmp_path: Path) -> None:
    graph = helper.make_graph(
        [helper.make_node("Div", ["k", "two"], ["half"], name="halve"), helper.make_node("Cast", ["half"], ["y"], to=TensorProto.FLOAT)],
        "whole",
        [helper.make_tensor_value_info("k", TensorProto.INT64, [1])],
        [helper.make_tensor_value_info("y", TensorProto.FLOAT, [1])],
        [numpy_helper.from_array(np.array([2]), "two")],
    )
    file = saved(tmp_path, helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=10))
    with pytest.raises(gpac.errors.ModuleError, match=r"node 'halve' \(Div\): it computes with integers.*cast them to floats first"):
        gpac.policy(file)


def test_what_depends_on_constants_alone_is_computed_at_once(tmp_path: Path, kept: Path) -> None:
    """Weights behind Slice, Concat, Equal, Where and Range, and a computed shape: the code is that of a product with constant weights."""
    nodes = [
        helper.make_node("Shape", ["obs"], ["shape"]),
        helper.make_node("Gather", ["shape", "last"], ["width"], axis=0),
        helper.make_node("Range", ["zero", "width_0", "one"], ["steps"]),
        helper.make_node("Squeeze", ["width"], ["width_0"]),
        helper.make_node("Equal", ["steps", "two"], ["is_two"]),
        helper.make_node("Where", ["is_two", "big", "small"], ["scale"]),
        helper.make_node("Slice", ["w", "from", "to", "axis"], ["w_left"]),
        helper.make_node("Concat", ["w_left", "w_left"], ["w_wide"], axis=1),
        helper.make_node("Unsqueeze", ["scale", "axis"], ["column"]),
        helper.make_node("Mul", ["w_wide", "column"], ["weights"]),
        helper.make_node("MatMul", ["obs", "weights"], ["y"]),
    ]
    nodes[2], nodes[3] = nodes[3], nodes[2]
    constants = {
        "last": np.array([1]), "zero": np.array(0), "one": np.array(1), "two": np.array(2), "big": np.array(9, np.float32),
        "small": np.array(1, np.float32), "w": W, "from": np.array([0]), "to": np.array([2]), "axis": np.array([1]),
    }  # fmt: skip
    file = saved(tmp_path, model(nodes, {"obs": ["batch", 4]}, {"y": [1, 4]}, constants))
    same_as_reference(file, gpac.policy(file), obs=RNG.standard_normal((1, 4)).astype(np.float32))
    text = kept.read_text()
    kept.unlink()
    weights = np.hstack([W[:, :2]] * 2) * np.where(np.arange(4) == 2, 9, 1).astype(np.float32)[:, None]
    gpac.policy(saved(tmp_path, model([nodes[-1]], {"obs": ["batch", 4]}, {"y": [1, 4]}, {"weights": weights})))
    assert kept.read_text() == text


NAMES = [("/model/obs", "/model/actions"), ("int", "NULL"), ("obs.1", "1"), ("μ", "σ"), ("M_PI", "FLT_MAX"), ("self", "report")]


@pytest.mark.parametrize("names", NAMES)
def test_every_name_of_an_input_is_a_port_of_some_name(tmp_path: Path, names: tuple[str, str]) -> None:
    file = saved(tmp_path, model([helper.make_node("Relu", [names[0]], [names[1]])], {names[0]: [1, 2]}, {names[1]: [1, 2]}), "int.onnx")
    policy = gpac.policy(file)
    given, made = (next(iter(side)) for side in (policy.inputs, policy.outputs))
    assert getattr(policy.run(**{given: [[-1.0, 2.0]]}), made).tolist() == [[0.0, 2.0]]
    with pytest.raises(gpac.errors.ModuleError, match="'int' is a reserved word of C or OpenGPAC: give the port or block another name"):
        gpac.policy(file, {names[0]: Term("int", size=2)})


def test_two_names_that_become_one_port_are_refused(tmp_path: Path) -> None:
    made = model([helper.make_node("Add", ["a.b", "a/b"], ["y"])], {"a.b": [1, 2], "a/b": [1, 2]}, {"y": [1, 2]})
    file = saved(tmp_path, made)
    with pytest.raises(gpac.errors.ModuleError, match=r"'a\.b' and 'a/b' would both be port 'a_b': name them in inputs="):
        gpac.policy(file)
    named = gpac.policy(file, {"a.b": Term("first", size=2), "a/b": Term("second", size=2)})
    assert named.run(first=[[1.0, 2.0]], second=[[10.0, 20.0]]).y.tolist() == [[11.0, 22.0]]


DECLARATIONS = {
    "reversed clip": ({"clip": (1, -1)}, {}, "clip of 'q' is an empty range, 1 to -1"),
    "a reversed element": ({"clip": ([-1, 2, -1], [1, 1, 1])}, {}, "clip of 'q' is an empty range, 2 to 1 at element 1"),
    "reversed within": ({"within": (2, 1)}, {}, "within of 'q' is an empty range, 2 to 1"),
    "one end": ({"clip": 3.0}, {}, "must be a minimum and a maximum"),
    "two lengths": ({"clip": ([1, 2], [3, 4, 5])}, {}, "has 2 minima but 3 maxima"),
    "an infinite scale": ({"scale": float("inf")}, {}, "not a list of finite numbers"),
    "text": ({"offset": "much"}, {}, "not a list of finite numbers"),
    "never": ({}, {"every": "0 s"}, "the interval of the policy must be more than 0 s, not '0 s'"),
    "negative": ({}, {"every": -0.02}, "the interval of the policy cannot be -0.02 s: its range is at least 0 s"),
    "a negative age": ({}, {"age_max": "-1 s"}, "age_max of the policy cannot be -1 s: its range is at least 0 s"),
}


@pytest.mark.parametrize("fault", DECLARATIONS)
def test_a_declaration_that_cannot_be_meant_is_refused(tmp_path: Path, fault: str) -> None:
    term, options, words = DECLARATIONS[fault]
    file = dense(tmp_path / "net.onnx", [3, 3])
    with pytest.raises(gpac.Error) as refusal:
        gpac.policy(file, {"obs": Term("q", size=3, **term)}, **options)
    assert words in str(refusal.value), refusal.value


@pytest.mark.parametrize("what", ["clip", "within"])
def test_a_range_may_have_one_end(tmp_path: Path, what: str) -> None:
    file = saved(tmp_path, model([helper.make_node("Identity", ["obs"], ["y"])], {"obs": [1, 2]}, {"y": [1, 2]}))
    for ends, expected in (((0.0, float("inf")), [0.0, 1e30]), ((float("-inf"), 0.0), [-1e30, 0.0])):
        policy = gpac.policy(file, {"obs": Term("q", size=2, **{what: ends})})
        np.testing.assert_allclose(policy.run(q=[[-1e30, 1e30]]).y[0], expected, rtol=1e-6)
