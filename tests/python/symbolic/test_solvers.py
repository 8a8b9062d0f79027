# SPDX-License-Identifier: Apache-2.0
"""Solvers in blocks: an invocation is a fault if CasADi's own evaluation finds no solution, and otherwise has its values."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import pytest

import opengpac as gpac
from opengpac.symbolic.solvers import reporting

QUIET = {"print_iter": False, "print_header": False, "print_info": False}
SQP: dict[str, Any] = {
    "qpsol": "qrqp", "print_header": False, "print_iteration": False, "print_time": False, "print_status": False, "qpsol_options": QUIET,
}  # fmt: skip


@dataclass
class Problem:
    """Solver for `x` with parameters p and b; `arguments` computes its other arguments from these."""

    solver: ca.Function
    arguments: Callable[[Any, Any], dict[str, Any]]

    @property
    def function(self) -> ca.Function:
        p, b = ca.MX.sym("p", 3), ca.MX.sym("b")
        return ca.Function("solved", [p, b], [self.solver(**self.arguments(p, b))["x"]], ["p", "b"], ["x"])

    def solved(self, p: Any, b: Any) -> Any:
        """Returns CasADi's own solution, or `None` if it finds none."""
        try:
            x = self.solver(**self.arguments(p, b))["x"]
        except RuntimeError:
            return None
        return np.array(x).ravel() if self.solver.stats()["success"] else None


def _bounds(p: Any, b: Any) -> dict[str, Any]:
    """Constrains the sum to about b, which three numbers up to 1 cannot reach if b is 5."""
    return {"x0": 0, "p": p, "lbg": b, "ubg": b + 0.1, "lbx": -1, "ubx": 1}


def _nlp(**options: Any) -> Problem:
    x, p = ca.MX.sym("x", 3), ca.MX.sym("p", 3)
    problem = {"x": x, "p": p, "f": ca.sumsqr(x - p) + ca.sin(x[0] * x[1]) + x[2] ** 4, "g": ca.sum1(x)}
    return Problem(ca.nlpsol("nlp", "sqpmethod", problem, SQP | options), _bounds)


def _qp(**options: Any) -> Problem:
    x, p = ca.MX.sym("x", 3), ca.MX.sym("p", 3)
    problem = {"x": x, "p": p, "f": ca.sumsqr(x - p) + x[0] * x[1], "g": ca.sum1(x)}
    return Problem(ca.qpsol("qp", "qrqp", problem, QUIET | options), _bounds)


def _root(**options: Any) -> Problem:
    x, p, b = ca.MX.sym("x", 3), ca.MX.sym("p", 3), ca.MX.sym("b")
    equations = ca.Function("g", [x, p, b], [x**3 + b * x - 20 * p], ["x", "p", "b"], ["r"])
    return Problem(ca.rootfinder("root", "fast_newton", equations, options), lambda p, b: {"x0": 1, "p": p, "b": b})


PROBLEMS = {
    "an iteration": lambda: _nlp(max_iter=1), "few iterations": lambda: _nlp(max_iter=4), "default": lambda: _nlp(),
    "error_on_fail": lambda: _nlp(max_iter=4, error_on_fail=True), "no line search": lambda: _nlp(max_iter_ls=0),
    "second order": lambda: _nlp(second_order_corrections=True), "limited memory": lambda: _nlp(hessian_approximation="limited-memory"),
    "convexified": lambda: _nlp(convexify_strategy="regularize"), "elastic": lambda: _nlp(elastic_mode=True, gamma_0=1),
    "inner iterations": lambda: _nlp(qpsol_options=QUIET | {"max_iter": 2}),
    "inner failures are taken": lambda: _nlp(qpsol_options=QUIET | {"error_on_fail": False}),
    "qrqp": lambda: _qp(), "qrqp, few": lambda: _qp(max_iter=2), "qrqp, no error": lambda: _qp(max_iter=2, error_on_fail=False),
    "newton": lambda: _root(), "newton, few": lambda: _root(max_iter=6), "newton, no error": lambda: _root(max_iter=6, error_on_fail=False),
}  # fmt: skip


def _points() -> list[tuple[np.ndarray, float]]:
    rng = np.random.default_rng(7)
    return [(rng.normal(0, 2, 3), float(rng.choice([0.0, 0.2, 1.0, 5.0]))) for _ in range(40)]


@pytest.mark.parametrize("name", PROBLEMS)
def test_an_invocation_is_a_fault_where_casadi_finds_no_solution(name: str) -> None:
    problem = PROBLEMS[name]()
    block = gpac.casadi(problem.function)
    solved = 0
    for p, b in _points():
        ran, expected = block.run(p=[p], b=[b]), problem.solved(p, b)
        if expected is None:
            assert ran.fault is not None and "fault 1" in ran.fault["text"], f"CasADi finds none at p={p}, b={b}; the block gives {ran.x}"
        else:
            assert ran.fault is None, f"CasADi gives {expected} at p={p}, b={b}, and the block is a fault"
            np.testing.assert_allclose(np.ravel(ran.x[0]), expected, rtol=1e-9, atol=1e-9)
            solved += 1
    assert solved < 40 or name.startswith("newton")


def test_a_mapped_solver_and_two_of_one_name_are_faults_too() -> None:
    few, many = _nlp(max_iter=1).function, _nlp(max_iter=50).function
    p, b = ca.MX.sym("p", 3), ca.MX.sym("b")
    both = ca.Function("both", [p, b], [few(p, b) + many(-p, b)], ["p", "b"], ["x"])
    for function in (few.map(1), both, both.map(1)):
        assert gpac.casadi(function, name="both").run(p=[[0.5, 2.0, -1.0]], b=[0.2]).fault is not None


def test_an_unsolved_iterate_is_published_where_that_is_asked_for() -> None:
    problem = _nlp(max_iter=1)
    block = gpac.casadi(problem.function, publish_unsolved=True)
    p, b = [0.5, 2.0, -1.0], 0.2
    ran = block.run(p=[p], b=[b])
    assert problem.solved(p, b) is None and ran.fault is None
    np.testing.assert_allclose(ran.x[0], np.array(problem.solver(**_bounds(p, b))["x"]).ravel(), rtol=1e-9)
    strict = gpac.casadi(_nlp(max_iter=1, error_on_fail=True).function, publish_unsolved=True)
    assert strict.run(p=[p], b=[b]).fault is not None


def test_a_solver_whose_c_hides_its_failures_is_refused() -> None:
    x, p = ca.MX.sym("x", 3), ca.MX.sym("p", 3)
    problem = {"x": x, "p": p, "f": ca.sumsqr(x - p), "g": ca.sum1(x)}
    solver = ca.nlpsol("careful", "feasiblesqpmethod", problem, SQP)
    function = ca.Function("solved", [p], [solver(x0=0, p=p)["x"]], ["p"], ["x"])
    with pytest.raises(
        gpac.errors.DefinitionError, match="the C code of Feasiblesqpmethod 'careful' does not report whether it found a solution"
    ):
        gpac.casadi(function)


def test_an_unknown_form_of_a_solver_is_refused() -> None:
    with pytest.raises(gpac.errors.DefinitionError, match="this version of CasADi generates unrecognised C code for Sqpmethod 'nlp'"):
        reporting("/* nlp:(x0)->(x) */\nstatic int f(void) { return 0; }\n", _nlp().function, "law")
