"""Small networks for the tests, and files with metadata as trainers write them."""

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper


def model(
    nodes: Sequence[onnx.NodeProto],
    inputs: Mapping[str, Sequence[int | str]],
    outputs: Mapping[str, Sequence[int]],
    constants: Mapping[str, np.ndarray] | None = None,
    opset: int = 17,
) -> onnx.ModelProto:
    """Returns a model of 32-bit floats."""
    values = [[helper.make_tensor_value_info(n, TensorProto.FLOAT, s) for n, s in side.items()] for side in (inputs, outputs)]
    initializers = [numpy_helper.from_array(np.asarray(x), name) for name, x in (constants or {}).items()]
    graph = helper.make_graph(list(nodes), "policy", values[0], values[1], initializers)
    return helper.make_model(graph, opset_imports=[helper.make_opsetid("", opset)], ir_version=10)


def dense(file: Path, sizes: Sequence[int], activation: str = "Elu", seed: int = 1, metadata: Mapping[str, str] | None = None) -> Path:
    """Writes a network of fully connected layers: input `obs`, output `actions`."""
    rng = np.random.default_rng(seed)
    nodes, constants, x = [], {}, "obs"
    for i, (a, b) in enumerate(itertools.pairwise(sizes)):
        constants[f"w{i}"] = (rng.standard_normal((b, a)) / np.sqrt(a)).astype(np.float32)
        constants[f"b{i}"] = (rng.standard_normal(b) * 0.1).astype(np.float32)
        is_last = i == len(sizes) - 2
        nodes.append(helper.make_node("Gemm", [x, f"w{i}", f"b{i}"], ["actions" if is_last else f"h{i}"], transB=1, name=f"layer{i}"))
        if not is_last:
            nodes.append(helper.make_node(activation, [f"h{i}"], [f"a{i}"], name=f"activation{i}"))
            x = f"a{i}"
    made = model(nodes, {"obs": [1, sizes[0]]}, {"actions": [1, sizes[-1]]}, constants)
    helper.set_model_props(made, dict(metadata or {}))
    onnx.save(made, file)
    return file


def identity(file: Path, width: int, metadata: Mapping[str, str] | None = None) -> Path:
    """Writes a network that returns its input, which shows the effect of a declaration."""
    made = model([helper.make_node("Identity", ["obs"], ["actions"], name="same")], {"obs": [1, width]}, {"actions": [1, width]})
    helper.set_model_props(made, dict(metadata or {}))
    onnx.save(made, file)
    return file
