# SPDX-License-Identifier: Apache-2.0
"""Makes the C code generated for CasADi's solvers report non-convergence.

CasADi's own evaluation reports it in `stats()["success"]`, or raises with `error_on_fail`. Its generated C code does neither for
`sqpmethod` and `fast_newton`: it returns 0 with the last iterate. This module inserts the check at the lines that leave the
iteration. A solver whose C code lacks these lines is refused, because results of failed runs would be published.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any

from ..errors import DefinitionError, refuse

_HEADS = re.compile(r"^/\* (\w+):\(.*\*/$", re.MULTILINE)
"""Comment that precedes each generated function: its name and signature."""


def reporting(text: str, function: Any, block: str, publish_unsolved: bool = False) -> str:
    """Returns the C code of a function in which each solver without a solution returns non-zero. With `publish_unsolved`, only solvers
    with `error_on_fail` do.

    Raises `DefinitionError` for a solver in whose C code the place for this check is unknown.
    """
    solvers = {(str(s.class_name()), str(s.name())): s for s in _solvers(function) if not publish_unsolved or _raises_on_failure(s)}
    for solver in solvers.values():
        checked = _CHECKS.get(str(solver.class_name()))
        if checked is None:
            remedy = "use 'sqpmethod' with 'qrqp' in nlpsol, 'qrqp' in qpsol or conic, 'fast_newton' in rootfinder"
            why = f"the C code of {solver.class_name()} '{solver.name()}' does not report whether it found a solution"
            refuse(DefinitionError, f"block '{block}': {why}", remedy)
        parts, known = _parts(text), False
        for i, (name, part) in enumerate(parts):
            if name == str(solver.name()) and (changed := checked(part)) is not None:
                parts[i], known = (name, changed), True
        if not known:
            remedy = "install the version of CasADi that opengpac[casadi] requires"
            why = f"this version of CasADi generates unrecognised C code for {solver.class_name()} '{solver.name()}'"
            refuse(DefinitionError, f"block '{block}': {why}", remedy)
        text = "".join(part for _, part in parts)
    return text


def _parts(text: str) -> list[tuple[str, str]]:
    """Splits the text before each generated function, and returns the parts, each with the function's name; the first part has the name
    ''."""
    heads = list(_HEADS.finditer(text))
    starts = [0, *(head.start() for head in heads)]
    names = ["", *(head[1] for head in heads)]
    return [(name, text[a:b]) for name, a, b in zip(names, starts, [*starts[1:], len(text)], strict=True)]


def _solvers(function: Any) -> Iterator[Any]:
    """Yields each function that iterates until convergence, including `function`."""
    for found in (function, *function.find_functions()):
        if str(found.class_name()) in _CHECKS or found.is_a("Nlpsol") or found.is_a("Conic") or found.is_a("Rootfinder"):
            yield found


def _raises_on_failure(function: Any) -> bool:
    """Returns whether the option `error_on_fail` is set. CasADi exposes it only in its serialization; if it is not found there, returns
    True."""
    key, text = _encoded("error_on_fail"), str(function.serialize({"debug": True}))
    _, _, rest = text.partition(key)
    return not rest.startswith(_encoded("b\0"))


def _encoded(text: str) -> str:
    """Returns text encoded as in CasADi's serialization: two letters per byte, low nibble first."""
    return "".join(chr(97 + (byte & 15)) + chr(97 + (byte >> 4)) for byte in text.encode())


def _sqpmethod(part: str) -> str | None:
    """Makes leaving the loop of `sqpmethod` because of the iteration limit or the step length a failure."""
    tests = re.compile(r"^( *if \(iter_count >= \d+(?: && iter_count >= \d+ && dx_norminf <= [^)]*)?\)) break;$", re.MULTILINE)
    part, n = tests.subn(r"\1 return 1;", part)
    return part if n == 2 else None


def _fast_newton(part: str) -> str | None:
    """Changes the loop of `fast_newton`, which exits early on convergence, to report a failure otherwise."""
    part, n = re.subn(r"^( *)(/\* Get the solution \*/)$", r"\1if (!opengpac_converged) return 1;\n\1\2", part, flags=re.MULTILINE)
    part, m = re.subn(r"if \(casadi_newton\(&m\)\) break;", "if (casadi_newton(&m)) { opengpac_converged = 1; break; }", part)
    part, k = re.subn(r"^( *)casadi_int iter;$", r"\1casadi_int iter; int opengpac_converged = 0;", part, flags=re.MULTILINE)
    return part if (n, m, k) == (1, 1, 1) else None


def _qrqp(part: str) -> str | None:
    """Makes `qrqp` return -1000, its code for `error_on_fail`, if it finds no search direction, because `sqpmethod` would continue after
    its own code 4."""
    known = re.search(r"^    return (?:-1000|-1);$", part, re.MULTILINE)
    return part.replace("    return 4;", "    return -1000;") if known and known[0].endswith("-1000;") else part if known else None


_CHECKS: dict[str, Callable[[str], str | None]] = {"Sqpmethod": _sqpmethod, "FastNewton": _fast_newton, "Qrqp": _qrqp}
"""Functions, by solver class, that make the solver's C code report a failure; they return None if it lacks the expected lines."""
