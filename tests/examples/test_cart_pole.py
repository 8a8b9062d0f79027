# SPDX-License-Identifier: Apache-2.0
"""The example of model-predictive control: its solver agrees with CasADi's own, and it holds the pole."""

from typing import Any

import casadi as ca
import numpy as np

import cart_pole_mpc as example


def test_the_solver_finds_what_qrqp_finds_within_its_iterations() -> None:
    problem, law = example.problem(), example.controller()
    x, given = ca.SX.sym("x", example.STEPS), ca.SX.sym("given", 5)
    cost = 0.5 * x.T @ problem.h @ x + (problem.f @ given).T @ x
    quiet = {"print_iter": False, "print_header": False, "print_info": False, "max_iter": 500}
    peer = ca.qpsol("peer", "qrqp", {"x": x, "p": given, "f": cost, "g": problem.a @ x + problem.s @ given}, quiet)
    random = np.random.default_rng(5)
    at_the_limit = 0
    for _ in range(12):
        state = random.normal(size=5) * [0.15, 0.15, 0.2, 0.4, 0.3]
        memory: list[Any] = [np.zeros(example.STEPS), np.zeros(2 * example.STEPS), np.zeros(2 * example.STEPS)]
        for _ in range(5):
            found = law(*state, *memory)
            memory = [found[2], found[3], found[4]]
        wanted = float(peer(p=state, lbg=-problem.upper, ubg=problem.upper)["x"][0])
        at_the_limit += abs(abs(wanted) - example.FORCE_MAX) < 1e-6
        assert abs(float(found[0]) - wanted) < 1e-3
    assert 1 <= at_the_limit <= 11, "some solutions are at the limit of the force, some are not"


def test_it_holds_the_pole(programs: Any) -> None:
    done = programs.run("cart_pole_mpc", "--seconds", "8")
    assert done.code == 0, done.printed
    assert "All verbs ended as they should" in done.printed and "400 solutions" in done.printed
