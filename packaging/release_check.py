# SPDX-License-Identifier: Apache-2.0
"""Builds all release artefacts and tries each in its users' environment: `make release-check`, about an hour; the table is
out/release.md.

    python packaging/release_check.py [--only NAME …]

A check that this machine cannot run (no emulation, no privileges, no container builder) is a line that names the missing part, never
a success.
"""

from __future__ import annotations

import argparse
import functools
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import venv
from collections.abc import Callable
from pathlib import Path

import deb
import roots

HERE = Path(__file__).parent
TOP = HERE.parent
DIST = TOP / "dist"
OUT = TOP / "out" / "release.md"
GLIBC = "2.28"
WHEEL_MB = 40
INSTALL_S = 60
INSTALLED = "dpkg -i /tmp/opengpac.deb; apt-get update -q && apt-get install -y -q --no-install-recommends -f && opengpac --help"


class NotTried(Exception):
    """Raised if this machine lacks something that a check needs."""


class Failed(Exception):
    """Raised if a check fails; contains the end of the output."""


def ran(*words: str | Path, folder: Path = TOP, seconds: float = 3600, environment: dict[str, str] | None = None) -> str:
    """Runs a command and returns its output; raises `Failed` if it exits with a status other than 0."""
    try:
        said = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        ended = subprocess.run([str(word) for word in words], cwd=folder, timeout=seconds, env=environment, **said)
    except subprocess.TimeoutExpired:
        raise Failed(f"{words[0]} … did not end within {seconds:g} s") from None
    if ended.returncode != 0:
        raise Failed(f"{' '.join(map(str, words))[:120]} … ended with {ended.returncode}: {ended.stdout[-1500:]}")
    return ended.stdout


def wheel_of(machine: str) -> Path:
    """Returns the newest wheel for a processor in dist/."""
    found = sorted(DIST.glob(f"opengpac-*_{machine}.whl"), key=lambda path: path.stat().st_mtime)
    if not found:
        raise NotTried(f"no wheel was built for {machine}")
    return found[-1]


def wheel(machine: str) -> str:
    """Builds the wheel for a processor; returns its size and the C library that it requires according to auditwheel."""
    ran("make", "wheel", f"MACHINE={machine}")
    made = wheel_of(machine)
    size = made.stat().st_size / 1e6
    if size > WHEEL_MB:
        raise Failed(f"{made.name} has {size:.1f} MB, more than {WHEEL_MB}")
    said = ran(sys.executable, "-m", "auditwheel", "show", made)
    tag = re.search(r'following platform tag:\s*"manylinux_(\d+)_(\d+)_', said)
    if tag is None or (int(tag[1]), int(tag[2])) > tuple(map(int, GLIBC.split("."))):
        raise Failed(f"{made.name} needs a newer C library than {GLIBC}: {said[-600:]}")
    return f"{size:.1f} MB, runs with glibc {tag[1]}.{tag[2]} and newer (auditwheel)"


def sources() -> str:
    """Builds the source distribution, and from it alone a wheel; moves an arm with that wheel."""
    shutil.rmtree(TOP / "target/sources", ignore_errors=True)
    ran(sys.executable, "-m", "maturin", "sdist", "--out", "target/sources")
    made = next((TOP / "target/sources").glob("*.tar.gz"))
    with tempfile.TemporaryDirectory(prefix="opengpac-sources-") as name:
        folder = Path(name)
        venv.create(folder / "new", with_pip=True)
        python = folder / "new/bin/python"
        begin = time.monotonic()
        ran(python, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", folder, made, folder=folder)
        minutes = (time.monotonic() - begin) / 60
        built = next(folder.glob("*.whl"))
        ran(python, HERE / "try_wheel.py", built)
    shutil.copy(made, DIST)
    return f"{made.stat().st_size / 1e6:.1f} MB, a wheel in {minutes:.1f} minutes, which moved the arm"


def installs(distribution: roots.Distribution) -> Callable[[], str]:
    """Returns a check that installs the wheel with pip in a fresh root file system without Rust, Node or a compiler, and moves an arm."""

    def tried() -> str:
        if why := distribution.lacks():
            raise NotTried(why)
        made = wheel_of("aarch64" if distribution.foreign else "x86_64")
        bound = "--virtual" if distribution.foreign else f"--at-most {INSTALL_S} --c"
        with roots.copy_of(distribution) as root:
            root.brings(made, HERE / "try_wheel.py", HERE / "constraints.txt")
            carry_network(root)
            bare = "! command -v gcc && ! command -v node && ldd --version | head -n 1"
            ended = root.run(f"{bare} && python3 /tmp/try_wheel.py /tmp/{made.name} {bound}", environment=index())
        if ended.returncode != 0:
            raise Failed(ended.stdout[-1500:])
        seconds = re.search(r"arrived ([\d.]+) s", ended.stdout)
        assert seconds is not None, ended.stdout
        how = "on the virtual clock, emulated" if distribution.foreign else "in real time"
        return f"{seconds[1]} s from pip install to the arm at its goal, {how} ({ended.stdout.splitlines()[0].split()[-1]})"

    return tried


@functools.cache
def debian_package(machine: str) -> Path:
    """Returns the Debian package for a processor, built from its wheel once per run."""
    return deb.made(wheel_of(machine), DIST, "3.11")


def package(machine: str) -> Callable[[], str]:
    """Returns a check that builds the Debian package for a processor and, on this processor, installs it, runs its daemon as its unit
    does, and purges it."""

    def tried() -> str:
        if shutil.which("dpkg-deb") is None:
            raise NotTried("dpkg-deb, which is part of Debian and its derivatives")
        made = debian_package(machine)
        told = f"{made.stat().st_size / 1e6:.1f} MB"
        if shutil.which("systemd-analyze"):
            ran("systemd-analyze", "verify", "--recursive-errors=no", unit_of(made))
        distribution = roots.DEBIAN_12 if machine == "x86_64" else roots.DEBIAN_12_ARM
        if why := distribution.lacks():
            raise NotTried(f"{told}; not installed: {why}")
        with roots.copy_of(distribution) as root:
            root.brings(HERE / "debian" / "try.sh")
            shutil.copy(made, root.files / "tmp/opengpac.deb")
            carry_network(root)
            ended = root.run("sh /tmp/try.sh" if machine == "x86_64" else INSTALLED, environment=index())
        if ended.returncode != 0:
            raise Failed(ended.stdout[-1500:])
        return told + (", installed, its daemon moved an arm, purged without a trace" if machine == "x86_64" else ", installed (emulated)")

    return tried


def unit_of(made: Path) -> Path:
    """Returns the unit of a package with a stand-in for the command, which is not installed on this machine."""
    folder = TOP / "target/unit"
    shutil.rmtree(folder, ignore_errors=True)
    ran("dpkg-deb", "-x", made, folder)
    text = (folder / "usr/lib/systemd/system/opengpac@.service").read_text()
    unit = folder / "opengpac@cell.service"
    unit.write_text(text.replace("/usr/bin/opengpac", "/bin/true"))
    return unit


def container() -> str:
    """Builds the container from its file, and moves an arm in it under the virtual clock."""
    if shutil.which("buildah") is None:
        raise NotTried("buildah: apt-get install buildah")
    if why := roots.DEBIAN_12.lacks():
        raise NotTried(why)
    made = debian_package("x86_64")
    base = roots.made(roots.DEBIAN_12)
    with tempfile.TemporaryDirectory(prefix="opengpac-container-", dir=TOP / "target") as name:
        folder = Path(name)
        stored = folder / "storage.conf"
        stored.write_text(f'[storage]\ndriver = "vfs"\ngraphroot = "{folder}/images"\nrunroot = "{folder}/run"\n')
        environment = {**os.environ, "BUILDAH_ISOLATION": "chroot", "CONTAINERS_STORAGE_CONF": str(stored)}

        def buildah(*words: str | Path) -> str:
            return ran("buildah", *words, environment=environment).strip().rpartition("\n")[2]

        begun = buildah("from", "scratch")
        ran("tar", "-C", base, "-cf", folder / "base.tar", ".")
        buildah("add", "--quiet", begun, folder / "base.tar", "/")
        buildah("commit", "--quiet", begun, "localhost/base")
        shutil.copy(made, folder / "opengpac.deb")
        buildah("bud", "--quiet", "--build-arg", "BASE=localhost/base", "--tag", "opengpac", "--file", HERE / "Containerfile", name)
        program = "import opengpac as gpac; gpac.System('cell', clock='virtual'); print(gpac.robots.load('ur5e').enable())"
        buildah("run", buildah("from", "localhost/opengpac"), "--", "/opt/opengpac/bin/python", "-c", program)
    return "built by buildah; an arm was enabled in it"


def carry_network(root: roots.Root) -> None:
    """Gives the root file system access to this machine's network."""
    root.brings(Path("/etc/resolv.conf"), to="etc")
    certificates = Path("/etc/ssl/certs/ca-certificates.crt")
    if certificates.exists():
        root.brings(certificates, to="etc/ssl/certs")


def index() -> list[str]:
    """Returns the environment variables that configure the index of pip and apt here."""
    known = [name for name in os.environ if name.startswith(("PIP_", "SSL_CERT")) or name.lower().endswith("_proxy")]
    return [f"{name}={os.environ[name]}" for name in known]


CHECKS: dict[str, Callable[[], str]] = {
    "wheel x86-64": lambda: wheel("x86_64"),
    "wheel aarch64": lambda: wheel("aarch64"),
    "source distribution": sources,
    "pip install in Debian 12": installs(roots.DEBIAN_12),
    "pip install in Debian 13": installs(roots.DEBIAN_13),
    "pip install in Ubuntu 24.04": installs(roots.UBUNTU_24),
    "pip install in Debian 12 on aarch64": installs(roots.DEBIAN_12_ARM),
    "package amd64": package("x86_64"),
    "package arm64": package("aarch64"),
    "container": container,
}


def main() -> None:
    """Runs the command."""
    given = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    given.add_argument("--only", nargs="+", choices=CHECKS, metavar="NAME", help=f"of: {', '.join(CHECKS)}")
    options = given.parse_args()
    rows: list[str] = []
    failed = False
    for name in options.only or CHECKS:
        begin = time.monotonic()
        try:
            verdict, told = "holds", CHECKS[name]()
        except NotTried as why:
            verdict, told = "not tried", str(why)
        except Failed as why:
            verdict, told, failed = "FAILS", str(why), True
        print(f"{name}: {verdict}, {told} [{time.monotonic() - begin:.0f} s]", flush=True)
        rows.append(f"| {name} | {verdict} | {' '.join(told.split())[:300]} |")
    OUT.parent.mkdir(exist_ok=True)
    OUT.write_text("\n".join(["| what | | |", "|---|---|---|", *rows, ""]))
    sys.exit(failed)


if __name__ == "__main__":
    main()
