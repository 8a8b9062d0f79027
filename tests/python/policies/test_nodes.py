# SPDX-License-Identifier: Apache-2.0
"""The node tests of the onnx package, for every operator declared as supported: many nodes in one block, to save compilations."""

import importlib
import os
import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper
from onnx.backend.test.case import node as node_tests

import opengpac as gpac

ALL = os.environ.get("OPENGPAC_NODES") == "all"
SHARES = 3
VALUES_MAX = 25_000
"""Maximum number of values of one network's cases, as its scratch memory is bounded."""

OPERATORS = Path(__file__).parents[3] / "docs" / "policies.md"

AT_RUN_TIME = {"Gemm", "MatMul", "LayerNormalization", "PRelu", "Sub", "Where", "Greater", "And", "Einsum"}
"""Operators that are also tried with every input as a value at run time: those with a different translation then, and one for all
others."""

ANY_KIND = {
    "Equal", "Greater", "GreaterOrEqual", "Less", "LessOrEqual", "And", "Or", "Xor", "Not", "Where", "ArgMax", "ArgMin", "Einsum",
    "Range", "Size", "Tile",
}  # fmt: skip
"""Operators whose node tests also run with integers, truth values and floats of other widths."""

ROUNDED = {"test_averagepool_2d_ceil_last_window_starts_on_pad"}
"""Tests whose values are written with four digits."""

REFUSED = {
    "bidirectional": "its direction is not forward: the other directions need future values",
    "reverse": "its direction is not forward: the other directions need future values",
    "peepholes": "it has sequence_lens: export the network with sequences of fixed length",
    "training": "for training: export the network for inference",
    "dropout_default_mask": "for training: export the network for inference",
    "empty_set": "is dynamic ('without a name'): export the network with fixed shapes",
    "reshape_allowzero": "cannot become",
    "split_zero_size": "do not add up to dimension 0",
    "slice_start_out_of_bounds": "its output 'y' has no elements",
}
"""Parts of the names of tests that do not apply to policies, with the words of the refusal."""


@dataclass
class Case:
    name: str
    model: onnx.ModelProto
    inputs: list[np.ndarray]
    outputs: list[np.ndarray]
    constant: bool


def supported() -> set[str]:
    """Returns the operators that the page lists."""
    table = OPERATORS.read_text().split("<!-- operators -->")[1]
    return set(re.findall(r"`([A-Z]\w+)`", table))


def _collected() -> list[Any]:
    """Returns the node tests in the files of these operators; generating all of the package's takes nine seconds."""
    words = {re.sub(r"[^a-z]", "", operator.lower()) for operator in supported()}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # the infinities of their test values
        for file in Path(node_tests.__file__).parent.glob("*.py"):
            if re.sub(r"[^a-z0-9]", "", file.stem) in (words | {"reducel2", "batchnorm"}) - {"cast"}:
                importlib.import_module(f"{node_tests.__name__}.{file.stem}")
    return sorted(node_tests._NodeTestCases, key=lambda case: case.name)


def cases() -> Iterator[Case]:
    known = supported()
    for test in _collected():
        if any(part in test.name for part in REFUSED):
            continue
        model = test.model
        operators = {node.op_type for node in model.graph.node}
        if not operators <= known or any(node.domain for node in model.graph.node):
            continue
        inputs, outputs = ([np.asarray(x) for x in side] for side in test.data_sets[0])
        if not inputs or not outputs[0].size or any(x.dtype.kind not in "fiub" for x in (*inputs, *outputs)):
            continue
        if sum(x.size for x in (*inputs, *outputs)) > VALUES_MAX:
            continue
        if operators <= ANY_KIND:
            if any(np.abs(x).max(initial=0) > 2**24 for x in inputs if x.dtype.kind in "iu"):
                continue
        elif any(x.dtype != np.float32 for x in (inputs[0], *outputs)) or any(x.dtype not in (np.float32, np.int64) for x in inputs):
            continue
        yield Case(test.name, model, inputs, outputs, True)
        if len(inputs) > 1 and operators <= AT_RUN_TIME and all(x.dtype == np.float32 or operators <= ANY_KIND for x in inputs):
            yield Case(f"{test.name} (at run time)", model, inputs, outputs, False)


def joined(group: list[Case], opset: int) -> tuple[onnx.ModelProto, np.ndarray]:
    """Returns one network that contains all cases: each takes its inputs from one long vector, and writes its outputs into another."""
    nodes, initializers, given, results, at = [], [], [], [], 0
    for i, case in enumerate(group):
        names = {}
        for j, (info, value) in enumerate(zip(case.model.graph.input, case.inputs, strict=True)):
            name = names[info.name] = f"{i}_{info.name}"
            operator = case.model.graph.node[0].op_type
            is_known = operator == "Range" or (operator == "Tile" and j > 0)
            if is_known or (operator not in ANY_KIND and value.dtype != np.float32) or (j > 0 and case.constant):
                initializers.append(numpy_helper.from_array(value, name))
                continue
            given.append(value.ravel())
            for key, ints in (("from", [at]), ("to", [at + value.size]), ("shape", value.shape)):
                initializers.append(numpy_helper.from_array(np.array(ints, dtype=np.int64), f"{name}_{key}"))
            nodes.append(helper.make_node("Slice", ["x", f"{name}_from", f"{name}_to"], [f"{name}_flat"], name=f"{case.name}: slice"))
            kind = helper.np_dtype_to_tensor_dtype(value.dtype)
            nodes.append(helper.make_node("Cast", [f"{name}_flat"], [f"{name}_cast"], to=kind, name=f"{case.name}: cast"))
            nodes.append(helper.make_node("Reshape", [f"{name}_cast", f"{name}_shape"], [name], name=f"{case.name}: reshape"))
            at += value.size
        for tensor in case.model.graph.initializer:
            kept = onnx.TensorProto()
            kept.CopyFrom(tensor)
            kept.name = names[tensor.name] = f"{i}_{tensor.name}"
            initializers.append(kept)
        for node in case.model.graph.node:
            copied = onnx.NodeProto()
            copied.CopyFrom(node)
            copied.name = case.name
            copied.ClearField("input")
            copied.ClearField("output")
            copied.input.extend(f"{i}_{name}" if name else "" for name in node.input)
            copied.output.extend(f"{i}_{name}" if name else "" for name in node.output)
            nodes.append(copied)
        for output in case.model.graph.output:
            results.append(f"{i}_{output.name}_flat")
            cast = f"{i}_{output.name}_cast"
            nodes.append(helper.make_node("Cast", [f"{i}_{output.name}"], [cast], to=TensorProto.FLOAT, name=case.name))
            nodes.append(helper.make_node("Reshape", [cast, "all"], [results[-1]], name=f"{case.name}: result"))
    initializers.append(numpy_helper.from_array(np.array([-1], dtype=np.int64), "all"))
    nodes.append(helper.make_node("Concat", results, ["y"], axis=0, name="results"))
    total = sum(x.size for case in group for x in case.outputs)
    graph = helper.make_graph(
        nodes,
        "many",
        [helper.make_tensor_value_info("x", TensorProto.FLOAT, [at])],
        [helper.make_tensor_value_info("y", TensorProto.FLOAT, [total])],
        initializers,
    )
    return helper.make_model(graph, opset_imports=[helper.make_opsetid("", opset)]), np.concatenate(given).astype(np.float64)


def by_opset() -> dict[int, list[Case]]:
    groups: dict[int, list[Case]] = {}
    for case in cases():
        opset = max(entry.version for entry in case.model.opset_import if not entry.domain)
        if opset >= 7:
            groups.setdefault(opset, []).append(case)
    return groups


def share(group: list[Case]) -> list[Case]:
    """Returns all cases if `OPENGPAC_NODES=all`, as in `make faults`; otherwise a third, a different one each day.

    The C compiler takes half a minute for all.
    """
    return group if ALL else group[date.today().toordinal() % SHARES :: SHARES]


def parts(group: list[Case]) -> Iterator[list[Case]]:
    """Yields the cases in parts whose values fit the scratch memory of one network."""
    part: list[Case] = []
    size = 0
    for case in group:
        own = sum(x.size for x in (*case.inputs, *case.outputs))
        if part and size + 2 * own > VALUES_MAX:
            yield part
            part, size = [], 0
        part.append(case)
        size += 2 * own
    yield part


def test_the_node_tests_have_every_operator() -> None:
    groups = by_opset().values()
    seen = {node.op_type for group in groups for case in group for node in case.model.graph.node}
    assert sum(map(len, groups)) > 250
    # Operators whose tests have no floats at the first input, or that have no tests.
    assert supported() - seen <= {"Cast", "ConstantOfShape", "Expand", "Shape", "Constant", "Pad", "Range", "Not"}, supported() - seen


def test_what_is_not_for_policies_is_refused_by_its_file_and_in_words(tmp_path: Path) -> None:
    refused, known = set(), supported()
    for test in _collected():
        parts = [part for part in REFUSED if part in test.name]
        if not parts or not {node.op_type for node in test.model.graph.node} <= known:
            continue
        model = onnx.ModelProto()
        model.CopyFrom(test.model)
        # What a network is exported with as constants.
        for info, value in list(zip(model.graph.input, test.data_sets[0][0], strict=True))[1:]:
            model.graph.initializer.append(numpy_helper.from_array(np.asarray(value), info.name))
        del model.graph.input[1:]
        file = tmp_path / f"{test.name}.onnx"
        onnx.save(model, file)
        with pytest.raises(gpac.ModuleError) as refusal:
            gpac.policy(file)
        said = " ".join(str(refusal.value).split())
        assert f"policy '{file}' is refused" in said and any(REFUSED[part] in said for part in parts), (test.name, said)
        refused |= set(parts)
    assert refused == set(REFUSED), "each of them is tried"


def test_every_operator_gives_what_the_node_tests_say(tmp_path: Path) -> None:
    compared = 0
    groups = ((opset, part) for opset, group in by_opset().items() if (taken := share(group)) for part in parts(taken))
    for number, (opset, group) in enumerate(groups):
        model, given = joined(group, opset)
        file = tmp_path / f"nodes_{number}.onnx"
        onnx.save(model, file)
        result = gpac.policy(file).run(x=given[None, :])
        assert result.fault is None, result.fault
        y, at = np.asarray(result.y)[0], 0
        for case in group:
            for wanted in case.outputs:
                got = y[at : at + wanted.size].reshape(wanted.shape)
                at += wanted.size
                rtol = 5e-4 if case.name in ROUNDED else 2e-5
                np.testing.assert_allclose(got, wanted, rtol=rtol, atol=1e-5, err_msg=case.name)
            compared += 1
    assert compared > (250 if ALL else 250 // SHARES - len(by_opset()))
