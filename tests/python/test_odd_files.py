# SPDX-License-Identifier: Apache-2.0
"""Damaged and odd files of arms: each loads, or is refused with a sentence that names the file and the damaged place.

40 files are tried, different ones each day; `OPENGPAC_ODD_FILES` sets their number, `OPENGPAC_SEED` the first seed.
"""

from __future__ import annotations

import datetime
import math
import os
import random
import re
import warnings
from collections.abc import Callable
from importlib import metadata
from pathlib import Path

import pytest

import opengpac as gpac
from opengpac.robots.catalogue import ARMS

COUNT = int(os.environ.get("OPENGPAC_ODD_FILES", "40"))
FIRST = int(os.environ.get("OPENGPAC_SEED", datetime.date.today().toordinal() * 1000))


def installed(package: str, folder: str) -> Path:
    """Returns a folder of an installed package."""
    return Path(str(metadata.distribution(package).locate_file(folder)))


OURS, MUJOCO = Path(gpac.robots.__file__).parent, installed("gymnasium", "gymnasium/envs/mujoco/assets")
MAKERS = installed("example-robot-data", "cmeel.prefix/share/example-robot-data/robots")
URDF = [ARMS[name].file() for name in ("ur3e", "iiwa14", "kr16", "puma560", "z1", "xarm7")]
MJCF = [
    *(OURS / name for name in ("ur5e.xml", "two_joint.xml")),
    *(MUJOCO / name for name in ("pusher_v5.xml", "reacher.xml", "inverted_double_pendulum.xml")),
]
SRDF = {
    MAKERS / "panda_description/srdf/panda.srdf": MAKERS / "panda_description/urdf/panda.urdf",
    MAKERS / "xarm_description/srdf/xarm7.srdf": MAKERS / "xarm_description/urdf/xarm7.urdf",
    MAKERS / "z1_description/srdf/z1.srdf": MAKERS / "z1_description/urdf/z1.urdf",
}
"""SRDF files, with the URDF files of their robots."""
VALUES = ["", "nan", "inf", "1e999", "fast", "-1", "0 0", "1 2 3 4 5 6 7", "ä", "0", "99999999999", "a/b.c"]


def turned(chance: random.Random, content: bytes) -> bytes:
    """Changes some bytes."""
    changed = bytearray(content)
    for _ in range(chance.randint(1, 5)):
        changed[chance.randrange(len(changed))] = chance.randrange(256)
    return bytes(changed)


def cut(chance: random.Random, content: bytes) -> bytes:
    """Cuts the end off."""
    return content[: chance.randrange(len(content))]


def twice(chance: random.Random, content: bytes) -> bytes:
    """Repeats a line."""
    lines = content.splitlines(keepends=True)
    at = chance.randrange(len(lines))
    return b"".join([*lines[:at], lines[at], *lines[at:]])


def without(chance: random.Random, content: bytes) -> bytes:
    """Removes a line."""
    lines = content.splitlines(keepends=True)
    del lines[chance.randrange(len(lines))]
    return b"".join(lines)


def nonsense(chance: random.Random, content: bytes) -> bytes:
    """Changes the value of an attribute."""
    found = chance.choice([*re.finditer(rb'="([^"]*)"', content)])
    return content[: found.start(1)] + chance.choice(VALUES).encode() + content[found.end(1) :]


def nested(chance: random.Random, content: bytes) -> bytes:
    """Nests elements deeply."""
    depth, at = chance.choice([50, 500, 5000]), content.rindex(b"</")
    return content[:at] + b"<link>" * depth + b"</link>" * depth + content[at:]


NUMBER = rb"[-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?"
READ = {
    ".urdf": (
        rb"<(?:origin|axis|mass|inertia|box|cylinder|sphere|mesh|dynamics|mimic)\b[^<>]*>",
        rb"xyz|rpy|value|ixx|iyy|izz|ixy|ixz|iyz|size|radius|length|scale|damping|friction|multiplier|offset",
    ),
    ".xml": (
        rb"<(?:body|joint|geom|site|inertial|motor|general|position|key|option|default)\b[^<>]*>",
        rb"pos|quat|size|fromto|axis|range|damping|armature|frictionloss|mass|diaginertia|gear|ctrlrange|forcerange|qpos|timestep|gravity",
    ),
    ".srdf": (rb"<joint\b[^<>]*>", rb"value"),
}
"""Elements and attributes with numbers that are read, by kind of file."""
BEYOND = ["nan", "inf", "-inf", "1e30", "-1e30"]
"""Numbers that no physical quantity has."""


def beyond(chance: random.Random, content: bytes) -> bytes:
    """Sets a number beyond any physical value."""
    seen = re.sub(rb"<!--.*?-->", lambda comment: b" " * len(comment[0]), content, flags=re.DOTALL)
    tags, words = READ[".srdf" if b"<group" in seen else ".urdf" if b"<robot" in seen else ".xml"]
    values = [
        (tag.start() + value.start(1), tag.start() + value.end(1))
        for tag in re.finditer(tags, seen)
        for value in re.finditer(rb"\b(?:" + words + rb')="\s*((?:' + NUMBER + rb'\s*)+)"', tag[0])
    ]
    first, last = chance.choice(values)
    numbers = content[first:last].split()
    numbers[chance.randrange(len(numbers))] = chance.choice(BEYOND).encode()
    return content[:first] + b" ".join(numbers) + content[last:]


def hung(chance: random.Random, content: bytes) -> bytes:
    """Attaches a joint of a URDF file to other links: sometimes to itself, to two joints or in a cycle."""
    ends = [*re.finditer(rb'<(?:parent|child)\s+link="([^"]*)"', content)] or [*re.finditer(rb'<joint\b[^<>]*\bname="([^"]*)"', content)]
    changed, other = chance.choice(ends), chance.choice(ends)
    return content[: changed.start(1)] + other[1] + content[changed.end(1) :]


def led(chance: random.Random, content: bytes) -> bytes:
    """Makes a joint of a URDF file follow another one, itself, or one that does not exist."""
    names = re.findall(rb'<joint\b[^<>]*\bname="([^"]*)"', content)
    ends = [*re.finditer(rb"<child\b[^<>]*/>", content)]
    if not names or not ends:
        return hung(chance, content)
    at = chance.choice(ends).end()
    return content[:at] + b'<mimic joint="' + chance.choice([*names, b"nobody"]) + b'"/>' + content[at:]


SPELLINGS = ["0x1F", "1_000", "1,5", "1.2.3", "1e", "--1", "１２", "½", "1d3", "1.0f", "pi", "${pi}", "$(arg x)", "2m", "None"]
CODECS = ["utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-8-sig", "latin-1", "cp1252", "gb18030", "shift_jis", "utf-7", "cp037"]


def spelled(chance: random.Random, content: bytes) -> bytes:
    """Writes a number in a notation of programming languages that XML does not have."""
    found = chance.choice([*re.finditer(rb'="\s*(' + NUMBER + rb")[\s\"]", content)])
    return content[: found.start(1)] + chance.choice(SPELLINGS).encode() + content[found.end(1) :]


def referring(chance: random.Random, content: bytes) -> bytes:
    """Inserts a reference to an entity: an undeclared one, one of another file, or one that expands without limit."""
    found = chance.choice([*re.finditer(rb'="([^"]*)"', content)])
    named = chance.choice([b"nobody", b"outside", b"grown", b"#0", b"#x110000", b"amp"])
    changed = content[: found.start(1)] + b"&" + named + b";" + content[found.end(1) :]
    growing = b"".join(b'<!ENTITY g%d "%s">' % (n + 1, b"&g%d;" % n * 10) for n in range(10))
    inner = b'<!ENTITY outside SYSTEM "file:///etc/hostname"><!ENTITY g0 "0 ">' + growing + b'<!ENTITY grown "&g10;">'
    root = next(re.finditer(rb"<(\w+)", changed))
    return changed[: root.start()] + b"<!DOCTYPE " + root[1] + b" [" + inner + b"]>" + changed[root.start() :]


def encoded(chance: random.Random, content: bytes) -> bytes:
    """Changes the encoding of the text, with a declaration that is right, wrong or missing."""
    text = re.sub(r"<\?xml[^>]*\?>", "", content.decode()).lstrip()
    codec = chance.choice(CODECS)
    said = chance.choice([codec, codec, "", "utf-8", "utf-16", "nothing", "rot13", "idna", "ascii"])
    head = f'<?xml version="1.0" encoding="{said}"?>\n' if said else ""
    return (head + re.sub(r'name="(\w)', r'name="ä\1', text, count=1)).encode(codec, errors="replace")


def longer(chance: random.Random, content: bytes) -> bytes:
    """Makes an attribute a megabyte long: a name, or a number with that many digits."""
    found = chance.choice([*re.finditer(rb'="([^"]*)"', content)])
    filling = chance.choice([b"a", b"0", b"9", b"1 ", b"-", "ä".encode()])
    return content[: found.start(1)] + filling * 1_000_000 + content[found.end(1) :]


def many(chance: random.Random, content: bytes) -> bytes:
    """Repeats an element some thousand times."""
    found = chance.choice([*re.finditer(rb"<(\w+)\b[^<>]*/>", content)])
    return content[: found.end()] + found[0] * chance.choice([2, 100, 3000]) + content[found.end() :]


def moved(chance: random.Random, content: bytes) -> bytes:
    """Moves an element."""
    found = [*re.finditer(rb"<(\w+)\b[^<>]*/>", content)]
    taken, place = chance.choice(found), chance.choice(found)
    (first, last), at = taken.span(), place.end()
    if at <= first:
        return content[:at] + taken[0] + content[at:first] + content[last:]
    return content[:first] + content[last:at] + taken[0] + content[at:]


def renamed(chance: random.Random, content: bytes) -> bytes:
    """Renames an element or attribute, or removes or repeats an attribute."""
    found = chance.choice([*re.finditer(rb'\s(\w+)="[^"]*"', content)])
    tag = chance.choice([*re.finditer(rb"<(\w+)\b[^<>]*/>", content)])
    changes = [
        (found, b""),
        (found, found[0] + found[0]),
        (found, b" " + found[1].upper() + found[0][1 + len(found[1]) :]),
        (tag, tag[0].replace(tag[1], tag[1] + b"s", 1)),
        (tag, tag[0].replace(tag[1], b"xacro:" + tag[1], 1)),
        (tag, b"<!-- " + tag[0] + b" -->"),
        (tag, b"<![CDATA[" + tag[0] + b"]]>"),
        (tag, tag[0] + b"\0"),
        (tag, tag[0] + b"stray text ]]> & more"),
    ]
    change, new = chance.choice(changes)
    return content[: change.start()] + new + content[change.end() :]


DAMAGES: list[Callable[[random.Random, bytes], bytes]] = [
    turned,
    cut,
    twice,
    without,
    nonsense,
    nonsense,
    nested,
    beyond,
    beyond,
    hung,
    led,
    spelled,
    referring,
    encoded,
    longer,
    many,
    moved,
    renamed,
]


SYNTAX = re.compile(r"not XML|not valid XML|XML [Pp]arse|XML_ERROR|UTF-8")
"""Pattern of errors of the XML itself, reported where they are noticed: at the damage or after it."""


def lines_changed(original: list[str], content: list[str]) -> set[int]:
    """Returns the lines of a damaged file that differ from the original, counted from 1; for a missing line its neighbours."""
    if len(original) == len(content):
        return {number for number, pair in enumerate(zip(original, content, strict=True), 1) if pair[0] != pair[1]}
    same = next(
        (at for at, pair in enumerate(zip(original, content, strict=False)) if pair[0] != pair[1]), min(len(original), len(content))
    )
    behind = 0
    while behind < min(len(original), len(content)) - same and original[-1 - behind] == content[-1 - behind]:
        behind += 1
    return {*range(same, len(content) - behind + 2)}


def names_near(lines: list[str], changed: set[int]) -> set[str]:
    """Returns the values and names of attributes in these lines, and the name of the element around them."""
    found: set[str] = set()
    for number in changed:
        for tag, value in re.findall(r"""([\w:]+)\s*=\s*["']([^"'<>]+)""", " ".join(lines[max(0, number - 1) : number])):
            found.update((value, tag))
        above = re.findall(r"""\bname\s*=\s*["']([^"']+)""", "\n".join(lines[max(0, number - 40) : number]))
        found.update(above[-2:])
    return found


def names_the_place(said: str, original: str, content: str) -> bool:
    """Returns whether a sentence names a damaged line, or a name in or around one."""
    before, after = original.split("\n"), content.split("\n")
    changed = lines_changed(before, after)
    told = {int(number) for number in re.findall(r":(\d+):|[Ll]ine (?:number=)?(\d+)", said) for number in number if number}
    # An unterminated comment is reported at its beginning.
    if "unclosed token" in said and any(number <= max(changed) for number in told):
        return True
    if told & changed or (SYNTAX.search(said) and any(number >= min(changed) for number in told)):
        return True
    tags = {tag for number in changed for tag in re.findall(r"<(\w+)", " ".join(after[max(0, number - 1) : number]))}
    if any(f"element '{tag}'" in said for tag in tags):
        return True
    names = names_near(before, changed) | names_near(after, changed)
    return any(re.search(rf"(?<![\w.]){re.escape(name)}(?![\w.])", said) for name in names if len(name) > 1)


@pytest.mark.parametrize("number", range(COUNT))
def test_an_odd_file_loads_or_says_what_and_where(number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # where MuJoCo writes its log of warnings
    chance = random.Random(FIRST + number)
    original, damage = chance.choice(chance.choice([URDF, MJCF, [*SRDF]])), chance.choice(DAMAGES)
    file, whole = tmp_path / f"odd{original.suffix}", original.read_bytes()
    content = damage(chance, whole)
    file.write_bytes(content)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            if original in SRDF:
                arm = gpac.robots.load(SRDF[original], clock="virtual", name="odd", srdf=file)
            else:
                arm = gpac.robots.load(file, clock="virtual", name="odd")
        except gpac.Error as error:
            said = str(error)
            told = f"{damage.__name__} of {original.name}, seed {FIRST + number}: {said}"
            assert file.name in said, told
            sentence = said.replace(f"at {__file__}", "").replace(str(file), "").replace(str(tmp_path), "")
            assert names_the_place(sentence, *(text.decode(errors="replace") for text in (whole, content))), told
            return
        texts = [text.decode(errors="replace") for text in (whole, content)]
        told = f"{damage.__name__} of {original.name}, seed {FIRST + number}: {arm.notes}"
        assert damage is not beyond or any(names_the_place(note, *texts) for note in arm.notes), told
        with arm.system:
            arm.system.advance("10 ms")
            assert all(map(math.isfinite, arm.values("home")))
