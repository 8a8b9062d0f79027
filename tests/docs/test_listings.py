# SPDX-License-Identifier: Apache-2.0
"""Every listing of the README and the pages in docs/ runs and prints what the page says."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from listings import PAGES, ROOT, Listing, Program, assert_prints, listings

from daemons import Daemon
from opengpac import _native
from opengpac.system import system


@pytest.fixture(autouse=True)
def virtual(monkeypatch: pytest.MonkeyPatch) -> None:
    """Gives every system that a listing creates the virtual clock."""
    made = system.System.__init__

    def make(self: system.System, name: str, clock: str = "monotonic", **options: object) -> None:
        made(self, name, "virtual", **options)  # type: ignore[arg-type]

    monkeypatch.setattr(system.System, "__init__", make)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Returns the folder that the listings run in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def command(*words: str, folder: Path, fails: bool = False) -> str:
    """Returns the output of a command; `opengpac` and `pytest` are those of this Python."""
    paths = [str(Path(_native.__file__).parent.parent), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths)), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(words, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    assert fails or done.returncode == 0, f"{' '.join(words)} failed:\n{done.stdout}"
    return done.stdout


def build_rust(source: str, folder: Path) -> None:
    """Builds a listing as the code module of `examples/rust-module`; leaves `librust_module.so` in `target/release` of the folder."""
    example = ROOT / "examples" / "rust-module"
    crate = folder / "rust-module"
    (crate / "src").mkdir(parents=True)
    shutil.copy(example / "Cargo.lock", crate)
    manifest = (example / "Cargo.toml").read_text()
    (crate / "Cargo.toml").write_text(manifest.replace("../../crates/block", str(ROOT / "crates" / "block")))
    (crate / "src" / "lib.rs").write_text(source)
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "docs"
    command("cargo", "build", "--release", "--offline", "--quiet", "--target-dir", str(target), folder=crate)
    release = folder / "target" / "release"
    release.mkdir(parents=True, exist_ok=True)
    shutil.copy(target / "release" / "librust_module.so", release)


def run_commands(listing: Listing, folder: Path) -> None:
    """Runs the lines `$ opengpac …` of a console listing and compares their output."""
    for part in ("\n" + listing.text).split("\n$ ")[1:]:
        line, _, expected = part.partition("\n")
        words = line.split("#")[0].split()
        if words[0] == "opengpac":
            printed = command(sys.executable, "-m", "opengpac", *words[1:], folder=folder, fails=bool(expected.strip()))
            if expected.strip():
                assert_prints(listing, expected, printed)


def keep(listing: Listing, folder: Path) -> None:
    """Writes a file listing into the folder, and compares it with the repository's file of that path."""
    kept = ROOT / listing.words["file"]
    if kept.exists():
        text = re.sub("^(//|#) SPDX-License-Identifier: .*\n", "", kept.read_text())
        assert text == listing.text, f"{listing} is not {listing.words['file']}"
    (folder / listing.file).write_text(listing.text)


def run_listing(listing: Listing, program: Program, folder: Path) -> None:
    if "file" in listing.words:
        keep(listing, folder)
    if "prose" in listing.words:
        return
    if "output" in listing.words:
        program.check(listing)
    elif "run" in listing.words:
        run_commands(listing, folder)
    elif "pytest" in listing.words:
        options = ("-q", "-p", "no:cacheprovider", "-p", "opengpac.pytest_plugin", "-c", os.devnull, "--rootdir", ".", listing.file)
        command(sys.executable, "-m", "pytest", *options, folder=folder)
    elif listing.language == "python":
        program.run(listing)
    elif listing.language == "c":
        (folder / listing.file).write_text(listing.text)
        _native.build([listing.file], str(folder / listing.file) + ".so")
    elif listing.language == "rust":
        build_rust(listing.text, folder)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_listing_of_a_page_runs(page: Path, folder: Path) -> None:
    program, daemons = Program(), list[Daemon]()
    # A test that ran before in this process may have left a system open, which would be found by its name.
    program.close()
    try:
        for listing in listings(page):
            if "daemon" in listing.words:
                daemons.append(Daemon(folder))
            run_listing(listing, program, folder)
    finally:
        program.close()
        for daemon in daemons:
            daemon.stop()
