# SPDX-License-Identifier: Apache-2.0
"""Universal Robots programs, run cycle by cycle. Supports the subset of URScript that is needed by programs that follow registers.

A program becomes a Python generator that advances once per controller cycle. Controller functions that take time are generators too.
Variables that are not `local` are global, as in URScript, whose nested functions see the variables of their program.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Generator, Mapping
from typing import Any

Steps = Generator[None, None, Any]


class ScriptError(Exception):
    """Raised if the controller refuses a program or the program fails; the text is the one that the teach pendant shows."""


class _Halt(Exception):
    pass


class Program:
    """A running program. `step` advances its threads, then the program itself, and returns False when it has ended."""

    def __init__(self, text: str, builtins: Mapping[str, Callable[..., Any]], lasting: Mapping[str, Callable[..., Steps]]) -> None:
        self._threads: list[Steps] = []
        self._globals: dict[str, Any] = {**builtins, **lasting, **self._own()}
        tree, self.name = _translated(text, set(lasting))
        try:
            exec(compile(tree, "program", "exec"), self._globals)
        except SyntaxError as why:
            raise ScriptError(str(why)) from why
        self._main: Steps = self._globals[self.name]()

    def _own(self) -> dict[str, Any]:
        def halt() -> None:
            raise _Halt

        def run(thread: Callable[[], Steps]) -> Steps:
            self._threads.append(thread())
            return self._threads[-1]

        def kill(thread: Steps) -> None:
            if thread in self._threads:
                self._threads.remove(thread)

        def join(thread: Steps) -> Steps:
            while thread in self._threads:
                yield

        return {"_halt": halt, "_run": run, "_kill": kill, "_join": join, "p": _PoseLiteral()}

    def step(self) -> bool:
        """Advances the program by one cycle; raises `ScriptError` if it fails."""
        try:
            for thread in [*self._threads]:
                try:
                    next(thread)
                except StopIteration:
                    self._threads.remove(thread)
            next(self._main)
        except (StopIteration, _Halt):
            return False
        except ScriptError:
            raise
        except Exception as why:
            raise ScriptError(f"{self.name}: {type(why).__name__}: {why}") from why
        return True


class _PoseLiteral:
    """`p[x, y, z, rx, ry, rz]`."""

    def __getitem__(self, values: tuple[float, ...]) -> list[float]:
        return [float(value) for value in values]


_OPENS = re.compile(r"^(def|thread|while|if|elif|else|for)\b")
_WORDS = [
    (re.compile(r"\brun\s+(\w+)\s*\(\s*\)"), r"_run(\1)"),
    (re.compile(r"\bkill\s+(\w+)"), r"_kill(\1)"),
    (re.compile(r"\bjoin\s+(\w+)"), r"_join(\1)"),
    (re.compile(r"^halt$"), "_halt()"),
    (re.compile(r"^thread\b"), "def"),
    (
        re.compile(
            r"\b(async|await|class|del|except|from|import|in|is|lambda|pass|raise|try|with|yield)\b(?=[^\"]*(?:\"[^\"]*\"[^\"]*)*$)"
        ),
        r"\1_",
    ),
    (re.compile(r"^global\s+(\w+)\s*=(?!=)"), r"\1 ="),
]


def _statements(text: str) -> list[str]:
    """Returns the statements of a program, one per line, without comments. A value may be on the line after its `=`."""
    text = "\n".join(re.sub(r'^((?:[^"#]|"[^"]*")*)#.*$', r"\1", line).rstrip() for line in text.splitlines())
    text = re.sub(r"(?<![=!<>])=\s*\n\s*", "= ", text)
    text = re.sub(r"(\S)[ \t]+(global|local)\b", r"\1\n\2", text)
    return [line.strip() for line in text.splitlines() if line.strip()]


def _translated(text: str, lasting: set[str]) -> tuple[ast.Module, str]:
    """Translates a program into a module of generators; returns the module and the name of the program's generator."""
    lines: list[str] = []
    depth, locals_of, functions = 0, [], set()
    for line in _statements(text):
        if line == "end":
            depth -= 1
            continue
        for pattern, word in _WORDS:
            line = pattern.sub(word, line)
        line = re.sub(r"^(if|elif|while)\s*(.*?):?$", r"\1 \2:", line)
        if line.startswith("local "):
            line = line.removeprefix("local ").strip()
            locals_of.append(line.split("=", 1)[0].strip())
            line = line if "=" in line else f"{line} = 0"
        indent = depth - 1 if line.startswith(("elif", "else")) else depth
        lines.append("  " * indent + line)
        if _OPENS.match(line):
            if not line.startswith(("elif", "else")):
                depth += 1
            lines.append("  " * depth + "pass")
        if line.startswith("def "):
            functions.add(line[4:].split("(", 1)[0].strip())
    try:
        module = ast.parse("\n".join(lines))
    except SyntaxError as why:
        raise ScriptError(f"line {why.lineno} of the program: {why.msg}") from why
    program = next((node for node in module.body if isinstance(node, ast.FunctionDef)), None)
    if program is None:
        raise ScriptError("the program has no 'def'")
    made = _Generators(functions | lasting | {"_join"}, set(locals_of)).visit(module)
    return ast.fix_missing_locations(made), program.name


class _Generators(ast.NodeTransformer):
    """Turns each function into a generator, each call that may take time into a `yield from`, and each variable that is not local into a
    global one."""

    def __init__(self, lasting: set[str], local: set[str]) -> None:
        self._lasting, self._local = lasting, local

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.FunctionDef:
        self.generic_visit(node)
        parameters = {argument.arg for argument in node.args.args}
        stored = {n.id for n in ast.walk(node) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
        inner = {n.name for n in ast.walk(node) if isinstance(n, ast.FunctionDef) and n is not node}
        shared = sorted((stored | inner) - self._local - parameters)
        never = ast.If(ast.Constant(False), [ast.Expr(ast.Yield(None))], [])
        node.body = [*([ast.Global(shared)] if shared else []), never, *node.body]
        return node

    def visit_Call(self, node: ast.Call) -> ast.expr:
        self.generic_visit(node)
        if isinstance(node.func, ast.Name) and node.func.id in self._lasting:
            return ast.YieldFrom(node)
        return node
