# SPDX-License-Identifier: Apache-2.0
"""An evaluation of a learned policy in its block on the virtual clock, compared with onnxruntime: one thread, bound inputs and outputs."""

from __future__ import annotations

import importlib
import itertools
import tempfile
import time as clock
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from lines import Line, digits, median, time

import opengpac as gpac
from opengpac import activate

SIZES = {"small": (48, 64, 64, 12), "medium": (48, 256, 128, 12), "large": (48, 512, 256, 128, 12)}
BAR = 0.5


def measure(rounds: int, quick: bool) -> Iterator[Line]:
    """Measures three networks of fully connected layers with Elu."""
    for name, sizes in SIZES.items():
        what = f"{name}, {'-'.join(map(str, sizes))}, batch 1"
        try:
            ours, theirs, far = _taken(sizes, rounds, 500 if quick else 4000)
        except ImportError as why:
            yield Line("policy", what, bar_text=f"≤ {BAR} ×", note=f"not taken: {why} (pip install onnx onnxruntime)")
            continue
        ratio = median([a / b for a, b in zip(ours, theirs, strict=True)])
        note = f"largest difference {far:.1e}; mean of a block's evaluations beside the median of onnxruntime's"
        yield Line(
            "policy",
            what,
            time(median(ours)),
            f"onnxruntime: {time(median(theirs))}",
            ratio,
            f"{digits(ratio)} ×",
            BAR,
            f"≤ {BAR} ×",
            note=note,
        )


def _taken(sizes: tuple[int, ...], rounds: int, times: int) -> tuple[list[float], list[float], float]:
    onnxruntime: Any = importlib.import_module("onnxruntime")
    with tempfile.TemporaryDirectory() as folder:
        file = _dense(Path(folder) / "policy.onnx", sizes)
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        session = onnxruntime.InferenceSession(str(file), options, providers=["CPUExecutionProvider"])
        x = np.random.default_rng(2).standard_normal((1, sizes[0])).astype(np.float32)
        policy = gpac.policy(file)
        far = float(np.abs(session.run(None, {"obs": x})[0] - policy.run(obs=x).actions).max())
        binding = session.io_binding()
        binding.bind_cpu_input("obs", x)
        binding.bind_output("actions")
        with gpac.System("bench", clock="virtual", progress=False) as cell:
            block = _block(cell, policy, x[0])
            pairs = [(block(times), _median(lambda: session.run_with_iobinding(binding), times)) for _ in range(rounds)]
    return [ours for ours, _ in pairs], [theirs for _, theirs in pairs], far


def _block(cell: gpac.System, policy: gpac.Policy, x: np.ndarray) -> Callable[[int], float]:
    """Returns a function that runs the block `times` times and returns the mean duration by a probe, ns."""
    source = cell.processor("rtp0").timer("fast", period="1 ms")
    verb = gpac.Verb(
        "thinking",
        blocks={"policy": policy},
        instantiation_parameters={"x": "policy.obs", "y": "policy.actions"},
        command_lists={"start": [activate("policy", every="1 ms")]},
    )
    verb.on(source).asynch(cell.svv("x", policy.items["obs"].type, initial=x), cell.svv("y", policy.items["actions"].type))

    def run(times: int) -> float:
        cell.block_times(during="60 s")
        total, before = _seen(cell), None
        cell.advance(times * 1e-3)
        before, total = total, _seen(cell)
        return (total[0] - before[0]) / (total[1] - before[1])

    return run


def _seen(cell: gpac.System) -> tuple[float, int]:
    """Returns the total time of the evaluations that the probe has measured, ns, and their number."""
    found: list[dict[str, Any]] = cell.statistics["sources"]["rtp0.fast"].get("blocks", [])
    return sum(block["mean_ns"] * block["samples"] for block in found), sum(block["samples"] for block in found)


def _median(does: Callable[[], Any], times: int) -> float:
    taken = []
    for _ in range(times):
        begun = clock.perf_counter_ns()
        does()
        taken.append(clock.perf_counter_ns() - begun)
    return float(np.median(taken))


def _dense(file: Path, sizes: tuple[int, ...]) -> Path:
    """Writes a network of random weights."""
    import onnx
    from onnx import TensorProto, helper, numpy_helper

    rng, nodes, constants, x = np.random.default_rng(1), [], [], "obs"
    for layer, (inputs, outputs) in enumerate(itertools.pairwise(sizes)):
        weights = rng.standard_normal((inputs, outputs)) / np.sqrt(inputs), rng.standard_normal(outputs) * 0.1
        constants += [numpy_helper.from_array(w.astype(np.float32), f"{kind}{layer}") for kind, w in zip("wb", weights, strict=True)]
        out = "actions" if layer == len(sizes) - 2 else f"h{layer}"
        nodes.append(helper.make_node("Gemm", [x, f"w{layer}", f"b{layer}"], [out]))
        if out != "actions":
            nodes.append(helper.make_node("Elu", [out], [f"a{layer}"]))
            x = f"a{layer}"
    ends = [helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, n]) for name, n in (("obs", sizes[0]), ("actions", sizes[-1]))]
    graph = helper.make_graph(nodes, "policy", ends[:1], ends[1:], constants)
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=10), file)
    return file
