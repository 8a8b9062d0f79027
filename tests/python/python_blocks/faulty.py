# SPDX-License-Identifier: Apache-2.0
"""Functions that are not valid blocks: name → (source, line of the fault within it, part of the message, part of the remedy)."""

HEAD = """import math
import numpy as np
from typing import Annotated as A
import opengpac as gpac
from opengpac.python import Condition, Input, Invocation, Output, Parameter, State
TABLE = [1.0, 2.0]
COUNT = 3
def helper(x): return x
U, Y = A[float, Input("u")], A[float, Output("y")]
@gpac.block
"""
"""Text before each source; the function begins on the line after it."""

_IN = "def f(u: U, y: Y):\n    "

FAULTY: dict[str, tuple[str, int, str, str]] = {
    "list": (_IN + "y = 0.0\n    a = [u, u]", 3, "makes a list", 'State(type="double[6]")'),
    "dictionary": (_IN + "a = {1: u}", 2, "makes a dictionary", "State"),
    "comprehension": (_IN + "y = sum(x for x in (u, u))", 2, "calls 'sum'", "call only"),
    "list comprehension": (_IN + "a = [x for x in (u, u)]", 2, "makes a list", "write a loop"),
    "text": (_IN + "a = 'text'", 2, "uses text", "numbers"),
    "formatted text": (_IN + "a = f'{u}'", 2, "makes a string", "condition"),
    "print": (_IN + "y = u\n    print(u)", 3, "it prints", "output or a condition"),
    "exception": (_IN + "if u < 0:\n        raise ValueError\n    y = u", 3, "raises", "condition"),
    "catch": (_IN + "try:\n        y = 1 / u\n    except ZeroDivisionError:\n        y = 0.0", 2, "catches", "if"),
    "assert": (_IN + "assert u > 0", 2, "asserts", "condition"),
    "recursion": (_IN + "f(u, y)", 2, "calls itself", "loop"),
    "helper": (_IN + "y = helper(u)", 2, "calls 'helper'", "write its body"),
    "global list": (_IN + "y = TABLE[0]", 2, "uses 'TABLE' of its module, which is a list", "Parameter or a State"),
    "global statement": (_IN + "global COUNT\n    COUNT = 4", 2, "changes a variable of its module", "State"),
    "import": (_IN + "import os", 2, "imports", "top of the file"),
    "file": (_IN + "open(u)", 2, "calls 'open'", "call only"),
    "with": (_IN + "with u:\n        y = u", 2, "'with'", "driver"),
    "lambda": (_IN + "g = lambda x: x", 2, "defines a function", "expression"),
    "class": (_IN + "class B: pass", 2, "defines a class", "item"),
    "generator": (_IN + "yield u", 2, "generator", "State"),
    "value returned": (_IN + "y = u\n    return u", 3, "returns a value", "return y"),
    "expression returned": (_IN + "return u + 1", 2, "returns a value", "return y"),
    "struct": ('def f(u: A[float, Input(type="pose")], y: Y):\n    y = u', 1, "type of 'u' cannot be 'pose'", "one item for each member"),
    "size": ('def f(u: A[np.ndarray, Input(type="double[n]")], y: Y):\n    y = u[0]', 1, "whose length is not a number", "write the block"),
    "unit of an input": ('def f(\n  u: A[float, Input("u", "rda/s")], y: Y):\n    y = u', 2, "rda/s", "'rad'"),
    "unit of a parameter": ('def f(y: Y,\n  k: A[float, Parameter("k", "Nm")] = 1.0):\n    y = k', 2, "'Nm'", "N.m"),
    "none": (_IN + "y = None", 2, "uses None", "numbers"),
    "complex": (_IN + "y = 1j", 2, "complex", "numbers"),
    "array made": (_IN + "a = np.zeros(3)", 2, "numpy.zeros|np.zeros|allocates|numba cannot", ""),
    "array sum": ('def f(q: A[np.ndarray, Input(type="double[3]")], y: Y):\n    a = q + q\n    y = a[0]', 2, "allocates memory", "State"),
    "input changed": (_IN + "u = 2.0", 2, "changes 'u'", "variable of another name"),
    "element of an input": ('def f(q: A[np.ndarray, Input(type="double[3]")], y: Y):\n    q[0] = 1.0', 2, "changes 'q'", "output or a State"),  # noqa: E501
    "array replaced": ('def f(u: U, q: A[np.ndarray, Output(type="double[3]")]):\n    q = u', 2, "replaces array 'q'", "q[i]"),
    "unknown name": (_IN + "y = v", 2, "'v' is undefined", "declare it"),
    "method": ('def f(q: A[np.ndarray, Input(type="double[3]")], y: Y):\n    y = q.mean()', 2, "calls 'q.mean'", "call only"),
    "invocation": ("def f(u: U, y: Y, i: Invocation):\n    y = i.seconds", 2, "no 'seconds'", "time"),
    "number into an int": ("def f(u: U, y: Y, n: A[int, State()]):\n    n += 0.5", 1, "cannot be assigned a float64", "int(…)"),
    "no annotation": ("def f(u, y: Y):\n    y = u", 1, "'u' has no annotation", "Input"),
    "no word": ("def f(u: float, y: Y):\n    y = u", 1, "must specify exactly one of", "Input"),
    "no output": ("def f(u: U):\n    a = u", 1, "neither an output", "Output"),
    "type of no port": ("def f(\n    u: A[str, Input()],\n    y: Y):\n    y = 1.0", 2, "type of 'u' is str", "float, int or bool"),
    "type of C": ('def f(u: A[float, Input(type="long")], y: Y):\n    y = u', 1, "'long'", "double"),
    "default": ('def f(y: Y,\n      k: A[int, Parameter()] = 0.5):\n    y = k', 2, "must be a value of int64_t, not 0.5", "int64_t"),
    "default's length": (
        'def f(y: Y, k: A[np.ndarray, Parameter(type="double[3]")] = (1.0, 2.0)):\n    y = k[0]', 1, "default of 'k'", "double[3]"),
    "default of an output": ("def f(u: U, y: Y = 1.0):\n    y = u", 1, "cannot have a default", "State"),
    "mode": ('def f(u: A[float, Input(mode="fast")], y: Y):\n    y = u', 1, "mode of input 'u' cannot be 'fast'", "asynchronous"),
    "star": ("def f(y: Y, *u: U):\n    y = 1.0", 1, "'*u'", "name each"),
    "word of C": ("def f(switch: U, y: Y):\n    y = switch", 1, "'switch' is reserved by C", "another name"),
    "condition's type": ("def f(u: U, c: A[float, Condition()]):\n    c = u > 1", 1, "condition 'c'", "bool"),
}  # fmt: skip
