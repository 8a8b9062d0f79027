# SPDX-License-Identifier: Apache-2.0
"""Symbolic functions as blocks: they give the values of CasADi's own evaluation on every mapping; and refusals."""

import importlib
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

import opengpac as gpac
from opengpac import activate, library, on
from opengpac.python import Condition, Input, Output
from symbolic.random_functions import SEEDS, drawn


@pytest.mark.parametrize("seed", SEEDS)
def test_a_block_has_the_values_of_casadi(seed: int) -> None:
    function, points = drawn(seed)
    block = gpac.casadi(function)
    ran = block.run(**points)
    for k in range(len(next(iter(points.values())))):
        expected = function(*(points[name][k] for name in points))
        for i in range(function.n_out()):
            wanted = np.array(ca.DM(expected[i] if function.n_out() > 1 else expected).full()).squeeze()
            found = np.asarray(getattr(ran, function.name_out(i))[k])
            np.testing.assert_allclose(found, wanted, rtol=1e-12, atol=1e-12)


def test_matrices_vectors_sparse_outputs_parameters_and_conditions() -> None:
    m, v, k = ca.MX.sym("m", 2, 3), ca.MX.sym("v", 1, 3), ca.MX.sym("k", 2, 2)
    function = ca.Function("shapes", [m, v, k], [k @ m, ca.diag(v.T), ca.sum2(v) > 5], ["m", "v", "k"], ["y", "d", "high"])
    block = gpac.casadi(
        function,
        inputs={"m": "rad", "v": Input("a row", "m", mode="asynchronous")},
        outputs={"y": Output("product", "rad"), "d": "m", "high": Condition("their sum is above 5")},
        parameters={"k": [[1, 2], [3, 4]]},
    )
    assert [(i.name, i.type, i.unit) for i in block.items.values()] == [
        ("m", "double[2][3]", "rad"), ("v", "double[3]", "m"), ("k", "double[2][2]", ""),
        ("y", "double[2][3]", "rad"), ("d", "double[3][3]", "m"), ("high", "", ""),
    ]  # fmt: skip
    ran = block.run(m=[[[1, 2, 3], [4, 5, 6]]] * 2, v=[[1, 2, 1], [1, 2, 3]])
    assert np.array_equal(ran.y[0], np.array([[1, 2], [3, 4]]) @ np.array([[1, 2, 3], [4, 5, 6]]))
    assert np.array_equal(ran.d[1], np.diag([1, 2, 3]))
    assert ran.conditions == [(1, "high", None)]


def test_a_state_is_fed_back_and_a_start_sets_it_again() -> None:
    x, u = ca.SX.sym("x", 2), ca.SX.sym("u")
    law = ca.Function("swing", [x, u], [x[0] + u, ca.vertcat(0.5 * x[0] + u, x[1] + 1)], ["x", "u"], ["y", "x_next"])
    block = gpac.casadi(law, states={"x": "x_next"}, initial={"x": [2.0, 0.0]})
    assert "x_next" not in block.items
    for _ in range(2):
        assert block.run(u=[1.0, 1.0, 0.0]).y.tolist() == [3.0, 3.0, 2.0]


def test_a_parameter_has_a_unit() -> None:
    k, u = ca.SX.sym("k"), ca.SX.sym("u")
    block = gpac.casadi(ca.Function("spring", [k, u], [k * u], ["k", "u"], ["f"]), {"u": "m"}, {"f": "N"}, parameters={"k": "80 N/m"})
    assert block.items["k"].unit == "N/m" and block.run(u=[0.5]).f.tolist() == [40.0] and block.run(k=2.0, u=[0.5]).f.tolist() == [1.0]


def test_a_solver_that_fails_is_a_fault() -> None:
    z, p = ca.MX.sym("z"), ca.MX.sym("p")
    solver = ca.qpsol("s", "qrqp", {"x": z, "p": p, "f": (z - p) ** 2, "g": z}, {"print_iter": False, "print_header": False})
    block = gpac.casadi(ca.Function("nearest", [p], [solver(p=p, lbg=0, ubg=2)["x"]], ["p"], ["y"]))
    np.testing.assert_allclose(block.run(p=[1.0, 5.0, -1.0]).y, [1.0, 2.0, 0.0], atol=1e-9)
    hopeless = gpac.casadi(ca.Function("hopeless", [p], [solver(p=p, lbg=2, ubg=0)["x"]], ["p"], ["y"]))
    assert "fault 1" in hopeless.run(p=[1.0]).fault["text"]


def law() -> gpac.CasadiBlock:
    """Returns a filter as a symbolic function."""
    x, u = ca.SX.sym("x"), ca.SX.sym("u")
    return gpac.casadi(ca.Function("smooth", [x, u], [x + 0.1 * ca.sin(u - x)] * 2, ["x", "u"], ["y", "next"]), states={"x": "next"})


def smoothing() -> gpac.Verb[..., gpac.Report]:
    """Returns a verb that runs a graph with that block for 100 ms."""
    graph = gpac.Graph("graph", blocks={"law": law(), "twice": library.gain(k=2.0)}, inputs={"u": "law.u"}, outputs={"y": "twice.y"},
                       cells={"x": ["law.y", "twice.u"]})  # fmt: skip
    return gpac.Verb(
        "smoothing",
        blocks={"noise": library.noise(seed=7), "graph": graph, "clock": library.time_limit(limit=0.1)},
        instantiation_parameters={"y": "graph.y"},
        cells={"u": ["noise.y", "graph.u"]},
        command_lists={"start": [activate("noise", every="5 ms"), activate("graph"), activate("clock", every="5 ms")]},
        conditions={"over": on("clock.expired", returns=[])},
    )


def test_a_process_gives_the_bits_of_the_virtual_clock() -> None:
    ends = []
    for place in ("virtual", "process"):
        with gpac.System("cell", clock="virtual" if place == "virtual" else "monotonic") as cell:
            source = cell.processor("rtp0", process=place == "process").timer("slow", period="5 ms", priority=50)
            y = cell.svv("y", history=100)
            smoothing().on(source)(y)
            ends.append(y.history[1:6]["value"].tolist())
    assert ends[0] == ends[1] and any(ends[0])


def test_a_recorded_function_is_run_again(tmp_path: Path) -> None:
    with gpac.System("cell", clock="virtual") as cell:
        cell.record(tmp_path / "run.mcap", replay=True)
        smoothing().on(cell.processor("rtp0").timer("slow", period="5 ms"))(cell.svv("y"))
    again = gpac.replay(tmp_path / "run.mcap", show=["y"], trust=True)
    assert again.same and again.firings >= 20


def one(*ins: Any, outs: Any = None, names: tuple[list[str], list[str]] = (["x"], ["y"])) -> ca.Function:
    """Returns a function of some arguments."""
    inputs = list(ins) or [ca.MX.sym("x")]
    return ca.Function("f", inputs, [inputs[0] if outs is None else outs], *names)


def refused() -> dict[str, tuple[Any, dict[str, Any], str]]:
    """Returns the refused cases: the function, arguments, and words of the message."""

    class Outside(ca.Callback):
        def __init__(self) -> None:
            ca.Callback.__init__(self)
            self.construct("outside", {})

        def eval(self, arg: Any) -> Any:
            return [arg[0]]

    x = ca.MX.sym("x")
    KEPT.append(Outside())
    ipopt = ca.nlpsol("s", "ipopt", {"x": x, "f": (x - 1) ** 2}, {"print_time": False, "ipopt.print_level": 0})
    return {
        "not a function": (lambda x: x, {}, "must be a casadi.Function"),
        "an expression": (x + 1, {}, "must be a casadi.Function"),
        "a wrong input": (one(), {"inputs": {"z": "rad"}}, "inputs= of block 'f' names 'z', but f has x"),
        "a wrong output": (one(), {"outputs": {"z": "rad"}}, "outputs= of block 'f' names 'z'"),
        "a wrong parameter": (one(), {"parameters": {"k": 1.0}}, "parameters= of block 'f' names 'k'"),
        "a wrong state": (one(), {"states": {"x": "z"}}, "states= of block 'f' names 'z'"),
        "two roles": (one(), {"inputs": {"x": "rad"}, "parameters": {"x": 1.0}}, "'x' of block 'f' is listed twice"),
        "a sparse input": (one(ca.MX.sym("x", ca.Sparsity.diag(2))), {}, "input 'x' of block 'f' is sparse: 2 of 2 x 2"),
        "a default's shape": (one(ca.MX.sym("x", 3)), {"parameters": {"x": [1, 2]}}, "finite numbers of double[3]"),
        "a state's shape": (one(outs=ca.MX.ones(2)), {"states": {"x": "y"}, "outputs": {"y": ""}}, "1 x 1"),
        "a condition's shape": (one(ca.MX.sym("x", 3)), {"outputs": {"y": Condition("c")}}, "must be a scalar output, not 3 x 1"),
        "an unknown unit": (one(), {"inputs": {"x": "furlong"}}, "furlong"),
        "another type": (one(), {"inputs": {"x": Input(type="float")}}, "type='float'"),
        "a word of C": (one(names=(["in"], ["out"])), {}, "reserved by C"),
        "no output": (one(), {"states": {"x": "y"}}, "has no output"),
        "a name": (one(), {"name": "my law"}, "not a valid name for a block"),
        "Python inside": (one(x, outs=KEPT[-1](x)), {}, "CallbackInternal"),
        "ipopt": (one(x, outs=ipopt(x0=x)["x"]), {}, "needs a library at run time: coin-or/IpStdCInterface.h"),
        "too large": (one(ca.MX.sym("x", 200, 200)), {}, "of work vectors"),
    }


KEPT: list[Any] = []
"""Callbacks to which CasADi holds references."""


@pytest.mark.parametrize("what", list(refused()))
def test_it_is_refused(what: str) -> None:
    function, given, words = refused()[what]
    with pytest.raises(gpac.Error) as refusal:
        gpac.casadi(function, **given)
    assert words in str(refusal.value) and "test_casadi.py" in str(refusal.value)


def test_without_casadi_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    load = importlib.import_module

    def missing(name: str, package: str | None = None) -> Any:
        if name == "casadi":
            raise ImportError("no module named casadi")
        return load(name, package)

    monkeypatch.setattr(importlib, "import_module", missing)
    with pytest.raises(gpac.DefinitionError, match=r"CasADi, which is not installed.*pip install 'opengpac\[casadi\]'"):
        gpac.casadi(object())
