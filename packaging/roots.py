# SPDX-License-Identifier: Apache-2.0
"""Root file systems of distributions in which release artefacts are tried: created once by debootstrap, used through temporary copies."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

# Several checkouts may share the root file systems.
ROOTS = Path(os.environ.get("OPENGPAC_ROOTS", Path(__file__).parent.parent / "target" / "roots"))
QEMU = Path("/proc/sys/fs/binfmt_misc/qemu-aarch64")


@dataclass(frozen=True)
class Distribution:
    """Distribution: its name here, the suite and mirror for debootstrap, its processor, and its packages in addition to the base."""

    name: str
    suite: str
    mirror: str = "http://deb.debian.org/debian"
    components: str = "main"
    processor: str = "amd64"
    packages: tuple[str, ...] = ("ca-certificates", "python3", "python3-venv")

    @property
    def foreign(self) -> bool:
        """True if programs of the distribution run here only under emulation."""
        return self.processor != "amd64"

    def lacks(self) -> str | None:
        """Returns the tool that this machine lacks to create and enter the root file system, with the command that installs it; `None`
        if nothing is missing."""
        if os.geteuid() != 0:
            return "root, to make a root file system and enter it with chroot"
        if shutil.which("debootstrap") is None:
            return "debootstrap: apt-get install debootstrap"
        if self.foreign and not QEMU.exists():
            return "emulation of its processor: apt-get install qemu-user-static binfmt-support, and mount binfmt_misc"
        return None


DEBIAN_12 = Distribution("debian-12", "bookworm")
DEBIAN_13 = Distribution("debian-13", "trixie")
UBUNTU_24 = Distribution("ubuntu-24.04", "noble", mirror="http://archive.ubuntu.com/ubuntu", components="main,universe")
DEBIAN_12_ARM = Distribution("debian-12-arm64", "bookworm", processor="arm64")


class Root:
    """Temporary copy of a distribution's root file system, removed at the end of its `with` block; `run` runs commands in it as root."""

    def __init__(self, base: Path, folder: Path):
        self._base, self._folder = base, folder
        for name in ("upper", "work", "merged"):
            (folder / name).mkdir()
        self.files = folder / "upper"

    def brings(self, *paths: Path, to: str = "tmp") -> None:
        """Copies files into a folder of the root file system."""
        place = self.files / to
        place.mkdir(parents=True, exist_ok=True)
        if to == "tmp":
            place.chmod(0o1777)
        for path in paths:
            shutil.copy(path, place)

    def run(self, command: str, *, seconds: float = 1200, environment: Sequence[str] = ()) -> subprocess.CompletedProcess[str]:
        """Runs a shell command in the root file system, in its own namespaces, so that everything it started ends with it."""
        inside = f"""
            set -e
            mount -t overlay root -o lowerdir={self._base},upperdir={self.files},workdir={self._folder}/work {self._folder}/merged
            cd {self._folder}/merged
            mount -t proc proc proc
            mkdir -p dev/shm
            mount -t tmpfs shm dev/shm
            exec chroot . /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root {" ".join(environment)} /bin/sh -c "$0"
        """
        words = ["unshare", "--mount", "--pid", "--fork", "--kill-child", "sh", "-c", inside, command]
        return subprocess.run(words, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=seconds)


@contextmanager
def copy_of(distribution: Distribution) -> Iterator[Root]:
    """Yields a fresh copy of the distribution's root file system."""
    base = made(distribution)
    with tempfile.TemporaryDirectory(prefix=f"{distribution.name}-", dir=ROOTS) as folder:
        yield Root(base, Path(folder))


def made(distribution: Distribution) -> Path:
    """Returns the folder of the pristine root file system, and creates it if necessary; an unfinished one is started over."""
    finished = ROOTS / distribution.name
    if finished.exists():
        return finished
    ROOTS.mkdir(parents=True, exist_ok=True)
    begun = ROOTS / f"{distribution.name}.begun"
    shutil.rmtree(begun, ignore_errors=True)
    scripts = Path("/usr/share/debootstrap/scripts")
    # An Ubuntu newer than this debootstrap uses the script of the others; its keys are missing here, and nothing of it leaves this
    # folder.
    script = [] if (scripts / distribution.suite).exists() else [str(scripts / "gutsy")]
    unchecked = ["--no-check-gpg"] if "ubuntu" in distribution.mirror else []
    words = ["debootstrap", "--variant=minbase", f"--arch={distribution.processor}", f"--components={distribution.components}", *unchecked]
    words.append(f"--include={','.join(distribution.packages)}")
    print(f"{distribution.name}: debootstrap makes it once, which takes a few minutes", file=sys.stderr)
    ended = subprocess.run([*words, distribution.suite, str(begun), distribution.mirror, *script], text=True, capture_output=True)
    if ended.returncode != 0:
        sys.exit(f"{distribution.name} could not be made; check the network\n{ended.stdout[-600:]}{ended.stderr[-600:]}")
    begun.rename(finished)
    return finished
