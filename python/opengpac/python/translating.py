# SPDX-License-Identifier: Apache-2.0
"""Translates the LLVM text of a compiled body to C, so that the C compiler inlines it into the block's entry and keeps values in
registers.

Each instruction becomes one statement, and each basic block a label; integers are unsigned, as wide as LLVM's. Unsupported code
raises `Untranslatable`; the body is then added to the module as assembly, and called.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Iterator, Mapping, Sequence

HEAD = """\
typedef double __attribute__((may_alias)) og_double;
typedef float __attribute__((may_alias)) og_float;
typedef uint8_t __attribute__((may_alias)) og_u8;
typedef uint16_t __attribute__((may_alias)) og_u16;
typedef uint32_t __attribute__((may_alias)) og_u32;
typedef uint64_t __attribute__((may_alias)) og_u64;
typedef char *__attribute__((may_alias)) og_pointer;
typedef unsigned __int128 og_u128;
static inline uint64_t og_bits(double x) { uint64_t bits; __builtin_memcpy(&bits, &x, 8); return bits; }
static inline double og_number(uint64_t bits) { double x; __builtin_memcpy(&x, &bits, 8); return x; }
static inline uint32_t og_bits32(float x) { uint32_t bits; __builtin_memcpy(&bits, &x, 4); return bits; }
static inline float og_number32(uint32_t bits) { float x; __builtin_memcpy(&x, &bits, 4); return x; }
"""
"""C definitions that the translated functions of a file need."""

_TYPE = r"double|float|ptr|i\d+"
_VALUE = r'%"[^"]+"|%[\w.$-]+|-?[\w.+-]+'
_TYPED = re.compile(rf"(?<![\w.$%\"-])({_TYPE})(?: (?:noundef|nonnull|signext|zeroext|nofpclass\(\w+\)|range\([^)]*\)))* ({_VALUE})")
_ASSIGNED = re.compile(rf"(?:({_VALUE}) = )?(?:(?:tail|musttail|notail) )?(\w+) ?(.*)")
_FLAGS = re.compile(r"^(?:(?:nsw|nuw|exact|disjoint|nneg|samesign|inbounds|nusw|volatile|nnan|ninf|nsz|arcp|contract|afn|reassoc|fast) )+")
_BINARY = {"add": "+", "sub": "-", "mul": "*", "and": "&", "or": "|", "xor": "^", "shl": "<<", "lshr": ">>", "udiv": "/", "urem": "%"}
_SIGNED = {"sdiv": "/", "srem": "%", "ashr": ">>"}
_FLOATS = {"fadd": "+", "fsub": "-", "fmul": "*", "fdiv": "/"}
_ORDERED = {"eq": "==", "ne": "!=", "gt": ">", "ge": ">=", "lt": "<", "le": "<="}
_NOT = {"gt": "<=", "ge": "<", "lt": ">=", "le": ">"}
_SIZES = {"double": 8, "float": 4, "ptr": 8, "i8": 1, "i16": 2, "i32": 4, "i64": 8}
"""Sizes of types in memory, in bytes."""
_IGNORED = ("llvm.lifetime", "llvm.assume", "llvm.experimental.noalias", "llvm.dbg")
_SAME = {"fabs", "sqrt", "floor", "ceil", "trunc", "rint", "nearbyint", "round", "pow", "exp", "exp2", "log", "log2", "log10", "sin", "cos",
    "tan", "copysign", "fma", "ldexp"}  # fmt: skip
_RENAMED = {"minnum": "fmin", "maxnum": "fmax"}


class Untranslatable(Exception):
    """Raised if the LLVM text contains unsupported code."""


def translated(text: str, symbol: str) -> str:
    """Translates the function of that name in the LLVM text to a static C function."""
    found = re.search(rf"^define [^\n]*@{symbol}\((.*)\)[^\n]*\{{\n(.*?)^\}}", text, re.M | re.S)
    if found is None:
        raise Untranslatable(f"symbol '{symbol}' is missing")
    return _Function(symbol, found[1], found[2]).text()


def _width(kind: str) -> int:
    return int(kind[1:])


def _c_type(kind: str) -> str:
    if kind in ("double", "float"):
        return kind
    if kind == "ptr":
        return "char *"
    width = _width(kind)
    if width > 128:
        raise Untranslatable(f"an integer of {width} bits")
    return next(f"uint{n}_t" for n in (8, 16, 32, 64) if width <= n) if width <= 64 else "og_u128"


def _cell_type(kind: str) -> str:
    """Returns the C type for memory accesses."""
    if kind not in _SIZES:
        raise Untranslatable(f"{kind} in memory")
    return {"double": "og_double", "float": "og_float", "ptr": "og_pointer"}.get(kind, f"og_u{kind[1:]}")


def _size(kind: str) -> int:
    array = re.fullmatch(r"\[(\d+) x (.*)\]", kind)
    if array:
        return int(array[1]) * _size(array[2])
    if kind not in _SIZES:
        raise Untranslatable(f"a size of {kind}")
    return _SIZES[kind]


def _cut(kind: str, text: str) -> str:
    """Returns the expression as an unsigned value, truncated to its type."""
    width = _width(kind)
    if width in (8, 16, 32, 64, 128):
        return f"({_c_type(kind)})({text})"
    mask = f"0x{(1 << width) - 1:x}u" if width <= 64 else f"(((og_u128)1 << {width}) - 1)"
    return f"({_c_type(kind)})(({text}) & {mask})"


def _signed(kind: str, text: str) -> str:
    width, whole = _width(kind), 64 if _width(kind) <= 64 else 128
    signed, unsigned = ("int64_t", "uint64_t") if whole == 64 else ("__int128", "og_u128")
    return f"(({signed})(({unsigned}){text} << {whole - width}) >> {whole - width})"


def _wide(kind: str, text: str) -> str:
    return f"({'uint64_t' if _width(kind) <= 64 else 'og_u128'}){text}"


class _Function:
    def __init__(self, symbol: str, arguments: str, body: str) -> None:
        self._symbol = symbol
        self._names: dict[str, str] = {}
        self._types: dict[str, str] = {}
        self._labels: dict[str, str] = {}
        self._statements: list[str] = []
        self._arguments: list[tuple[str, str]] = []
        for one in re.split(r",\s*(?![^(]*\))", arguments):
            kind, _, rest = one.strip().partition(" ")
            self._arguments.append((kind, self._named(rest.split()[-1], kind)))
        self._blocks = [*_blocks(body)]
        self._incoming: dict[str, list[tuple[str, str]]] = {}
        """Values that a basic block passes to each phi of its successors, as pairs of the phi's C name and the value. The list of a
        block's entry is complete before its end is translated."""

    def text(self) -> str:
        for label, lines in self._blocks:
            for line in lines:
                self._collect_phi(label, line)
        for label, lines in self._blocks:
            self._statements.append(f"{self._label(label)}:;")
            for line in lines:
                self._translate(label, line)
        own = {name for _, name in self._arguments}
        variables = [f"    {_c_type(kind)} {name};" for name, kind in self._types.items() if name not in own]
        arguments = ", ".join(f"{_c_type(kind)} {name}".replace("* ", "*") for kind, name in self._arguments)
        return "\n".join([
            f"__attribute__((always_inline)) static inline int32_t {self._symbol}({arguments}) {{",
            *variables, *(f"    {statement}" for statement in self._statements), "}", "",
        ])  # fmt: skip

    def _named(self, name: str, kind: str) -> str:
        """Returns the C name of a value, and registers it with its type."""
        c = self._names.setdefault(name, f"v{len(self._names)}")
        self._types[c] = kind
        return c

    def _label(self, label: str) -> str:
        return self._labels.setdefault(label.lstrip("%").strip('"'), f"at{len(self._labels)}")

    def _value(self, kind: str, text: str) -> str:
        if text.startswith("%"):
            return self._names.setdefault(text, f"v{len(self._names)}")
        if text in ("undef", "poison", "zeroinitializer", "null", "false"):
            return "0"
        if text == "true":
            return "1"
        if kind in ("double", "float"):
            return _number(kind, text)
        if kind == "ptr" or not re.fullmatch(r"-?\d+", text):
            raise Untranslatable(f"the constant {text}")
        number = int(text) & ((1 << _width(kind)) - 1)
        if number >> 64:
            return f"(((og_u128){number >> 64}u << 64) | {number & (1 << 64) - 1}u)"
        return f"({_c_type(kind)}){number}u" if number < 1 << 32 else f"{number}ull"

    def _collect_phi(self, label: str, line: str) -> None:
        found = re.fullmatch(rf"({_VALUE}) = phi (?:\w+ )*?({_TYPE}) (\[.*\])", line)
        if found is None:
            if " = phi " in line:
                raise Untranslatable(line)
            return
        name = self._named(found[1], found[2])
        self._types[f"{name}_next"] = found[2]
        for value, block in re.findall(rf'\[ ({_VALUE}), (%"[^"]+"|%[\w.$-]+) \]', found[3]):
            self._incoming.setdefault(self._label(block), []).append((name, self._value(found[2], value)))

    def _translate(self, label: str, line: str) -> None:
        found = _ASSIGNED.fullmatch(line)
        if found is None:
            raise Untranslatable(line)
        target, word, rest = found[1], found[2], _FLAGS.sub("", found[3])
        if word in ("br", "switch", "ret", "unreachable"):
            self._end(label, word, rest)
        elif word == "store":
            (kind, value), (_, place) = self._two(rest, line)
            self._statements.append(f"*({_cell_type(kind)} *)({place}) = {value};")
        elif word == "call":
            self._call(target, rest, line)
        elif word == "phi":
            name = self._names[target]
            self._statements.append(f"{name} = {name}_next;")
        elif word == "alloca":
            self._alloca(target, rest)
        else:
            kind, text = self._expression(word, rest, line)
            self._statements.append(f"{self._named(target, kind)} = {text};")

    def _expression(self, word: str, rest: str, line: str) -> tuple[str, str]:
        """Returns the type and the C text of an instruction's result."""
        if word in _BINARY or word in _SIGNED or word in _FLOATS or word == "frem":
            kind, a, b = self._pair(rest, line)
            return kind, self._arithmetic(word, kind, a, b)
        if word in ("icmp", "fcmp"):
            predicate, _, rest = rest.partition(" ")
            kind, a, b = self._pair(_FLAGS.sub("", rest), line)
            return "i1", _compared(predicate, kind, a, b) if word == "icmp" else _ordered(predicate, a, b)
        if word == "select":
            (_, condition), (kind, a), (_, b) = self._typed(rest, 3, line)
            return kind, f"{condition} ? {a} : {b}"
        if word == "load":
            kind, _, rest = rest.partition(", ")
            return kind, f"*(const {_cell_type(kind)} *)({self._typed(rest, 1, line)[0][1]})"
        if word == "getelementptr":
            return "ptr", self._element(rest, line)
        if word in ("fneg", "freeze"):
            kind, a = self._typed(rest, 1, line)[0]
            return kind, f"-{a}" if word == "fneg" else a
        converted = re.fullmatch(rf"({_TYPE}) ({_VALUE}) to ({_TYPE})", rest)
        if converted is None:
            raise Untranslatable(line)
        return converted[3], _converted(word, converted[1], self._value(converted[1], converted[2]), converted[3])

    def _arithmetic(self, word: str, kind: str, a: str, b: str) -> str:
        if word == "frem":
            return f"__builtin_fmod{'' if kind == 'double' else 'f'}({a}, {b})"
        if word in _FLOATS:
            return f"{a} {_FLOATS[word]} {b}"
        if word == "ashr":
            return _cut(kind, f"{_signed(kind, a)} >> {b}")
        if word in _SIGNED:
            return _cut(kind, f"{_signed(kind, a)} {_SIGNED[word]} {_signed(kind, b)}")
        return _cut(kind, f"{_wide(kind, a)} {_BINARY[word]} {_wide(kind, b)}")

    def _pair(self, rest: str, line: str) -> tuple[str, str, str]:
        found = re.fullmatch(rf"({_TYPE}) ({_VALUE}), ({_VALUE})", rest)
        if found is None:
            raise Untranslatable(line)
        return found[1], self._value(found[1], found[2]), self._value(found[1], found[3])

    def _typed(self, rest: str, count: int, line: str) -> list[tuple[str, str]]:
        found = [(kind, self._value(kind, value)) for kind, value in _TYPED.findall(rest)]
        if len(found) < count:
            raise Untranslatable(line)
        return found

    def _two(self, rest: str, line: str) -> list[tuple[str, str]]:
        return self._typed(rest, 2, line)[:2]

    def _element(self, rest: str, line: str) -> str:
        kind, _, rest = rest.partition(", ") if not rest.startswith("[") else _array_first(rest)
        (_, base), *indices = self._typed(rest, 2, line)
        text = f"{base}"
        for index, (index_kind, value) in enumerate(indices):
            if index:
                inner = re.fullmatch(r"\[\d+ x (.*)\]", kind)
                if inner is None:
                    raise Untranslatable(line)
                kind = inner[1]
            text += f" + (int64_t){_signed(index_kind, value)} * {_size(kind)}"
        return text

    def _alloca(self, target: str, rest: str) -> None:
        kind = re.split(r", (?:align|i\d+)", rest)[0]
        if re.search(r", i\d+ (?!1\b)", rest):
            raise Untranslatable(rest)
        name = self._named(target, "ptr")
        self._statements.append(f"char {name}_room[{_size(kind)}] __attribute__((aligned(16))); {name} = {name}_room;")

    def _call(self, target: str | None, rest: str, line: str) -> None:
        found = re.search(rf"({_TYPE}|void) @([\w.]+)\((.*)\)", rest)
        if found is None:
            raise Untranslatable(line)
        kind, name, given = found.groups()
        if name.startswith(_IGNORED):
            return
        arguments = self._typed(given, 0, line) if given else []
        text = _called(name, kind, arguments)
        self._statements.append(f"{self._named(target, kind)} = {text};" if target else f"{text};")

    def _end(self, label: str, word: str, rest: str) -> None:
        given = self._incoming.get(self._label(label), [])
        self._statements.extend(f"{name}_next = {value};" for name, value in given)
        labels = [self._label(name) for name in re.findall(r'label (%"[^"]+"|%[\w.$-]+)', rest)]
        if word == "unreachable":
            self._statements.append("__builtin_unreachable();")
        elif word == "ret":
            self._statements.append(f"return (int32_t){self._typed(rest, 1, rest)[0][1]};")
        elif word == "switch":
            (_, value), *cases = self._typed(rest, 1, rest)
            self._statements.append(f"switch ({value}) {{")
            self._statements.extend(f"case {case}: goto {to};" for (_, case), to in zip(cases, labels[1:], strict=True))
            self._statements.append(f"default: goto {labels[0]}; }}")
        elif len(labels) == 1:
            self._statements.append(f"goto {labels[0]};")
        else:
            self._statements.append(f"if ({self._typed(rest, 1, rest)[0][1]}) goto {labels[0]}; else goto {labels[1]};")


def _blocks(body: str) -> Iterator[tuple[str, Sequence[str]]]:
    """Yields the label and the instructions of each basic block, without comments and metadata."""
    # The first block has no label: its number is that of the first unnamed value.
    label, lines = "0", []
    for line in re.sub(r"\[\n(.*?)\]", lambda found: "[ " + " ".join(found[1].split()) + " ]", body, flags=re.S).splitlines():
        code = line.partition(":")[0] + ":" if line.startswith('"') else line.partition("; ")[0].rstrip()
        line = re.sub(r" #\d+$", "", re.sub(r"(, ![\w.]+ !\d+)+$", "", code))
        if not line.strip():
            continue
        if not line.startswith(" "):
            if lines or label:
                yield label, lines
            label, lines = line.partition(":")[0], []
        else:
            lines.append(line.strip())
    yield label, lines


def _array_first(rest: str) -> tuple[str, str, str]:
    """Returns the parts of an array type, and the text after the comma that follows it."""
    depth = 0
    for at, letter in enumerate(rest):
        depth += (letter == "[") - (letter == "]")
        if depth == 0:
            return rest[: at + 1], ", ", rest[at + 3 :]
    raise Untranslatable(rest)


def _number(kind: str, text: str) -> str:
    """Returns a bit-exact constant."""
    if text.startswith("0x"):
        bits = int(text, 16)
        value = struct.unpack("<d", struct.pack("<Q", bits))[0]
        if value != value or value in (float("inf"), float("-inf")):
            return f"({kind})og_number(0x{bits:x}ull)"
    else:
        value = float(text)
    return f"({kind}){value.hex()}" if kind == "float" else value.hex()


def _compared(predicate: str, kind: str, a: str, b: str) -> str:
    if predicate in ("eq", "ne"):
        return f"{a} {_ORDERED[predicate]} {b}"
    if predicate[0] == "s":
        return f"{_signed(kind, a)} {_ORDERED[predicate[1:]]} {_signed(kind, b)}"
    return f"{a} {_ORDERED[predicate[1:]]} {b}"


def _ordered(predicate: str, a: str, b: str) -> str:
    """Returns a comparison of floats. Predicates with the letter o (ordered) are false if an operand is NaN; predicates with u
    (unordered) are true."""
    if predicate in ("ord", "uno"):
        return f"{'!' if predicate == 'ord' else ''}__builtin_isunordered({a}, {b})"
    if predicate in ("oeq", "une"):
        return f"{a} {_ORDERED[predicate[1:]]} {b}"
    if predicate in ("one", "ueq"):
        return f"{'!' if predicate == 'ueq' else ''}__builtin_islessgreater({a}, {b})"
    if predicate[1:] not in _NOT:
        raise Untranslatable(f"fcmp {predicate}")
    return f"{a} {_ORDERED[predicate[1:]]} {b}" if predicate[0] == "o" else f"!({a} {_NOT[predicate[1:]]} {b})"


def _converted(word: str, kind: str, value: str, to: str) -> str:
    if word in ("zext", "trunc"):
        return _cut(to, value)
    if word == "sext":
        return _cut(to, _signed(kind, value))
    if word in ("sitofp", "fpext", "fptrunc", "uitofp"):
        return f"({to}){_signed(kind, value) if word == 'sitofp' else value}"
    if word in ("fptosi", "fptoui"):
        return _cut(to, f"({'int64_t' if word == 'fptosi' else 'uint64_t'}){value}")
    bits = {("double", "i64"): "og_bits", ("i64", "double"): "og_number", ("float", "i32"): "og_bits32", ("i32", "float"): "og_number32"}
    if word == "bitcast" and (kind, to) in bits:
        return f"{bits[kind, to]}({value})"
    raise Untranslatable(f"{word} {kind} to {to}")


def _called(name: str, kind: str, arguments: Sequence[tuple[str, str]]) -> str:
    """Returns a call to a libm function or an LLVM intrinsic."""
    values = [value for _, value in arguments]
    if not name.startswith("llvm."):
        if any(of not in ("double", "float") and not of.startswith("i") for of, _ in arguments):
            raise Untranslatable(f"a call of {name}")
        return f"__builtin_{name}({', '.join(_plain(of, value) for of, value in arguments)})"
    word = name.split(".")[1]
    base = _RENAMED.get(word, word)
    if base in _SAME or word in _RENAMED:
        return f"__builtin_{base}{'f' if kind == 'float' else ''}({', '.join(_plain(of, value) for of, value in arguments)})"
    if word == "fmuladd":
        return f"{values[0]} * {values[1]} + {values[2]}"
    if word in _WHOLE:
        return _WHOLE[word](kind, values)
    raise Untranslatable(f"a call of {name}")


def _plain(kind: str, value: str) -> str:
    return f"(int){value}" if kind == "i32" else f"(int64_t){value}" if kind == "i64" else value


_WHOLE: Mapping[str, Callable[[str, Sequence[str]], str]] = {
    "smax": lambda k, v: f"{_signed(k, v[0])} > {_signed(k, v[1])} ? {v[0]} : {v[1]}",
    "smin": lambda k, v: f"{_signed(k, v[0])} < {_signed(k, v[1])} ? {v[0]} : {v[1]}",
    "umax": lambda k, v: f"{v[0]} > {v[1]} ? {v[0]} : {v[1]}",
    "umin": lambda k, v: f"{v[0]} < {v[1]} ? {v[0]} : {v[1]}",
    "abs": lambda k, v: _cut(k, f"{_signed(k, v[0])} < 0 ? -{_wide(k, v[0])} : {_wide(k, v[0])}"),
}
"""LLVM's integer intrinsics."""
