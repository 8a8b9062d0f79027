# SPDX-License-Identifier: Apache-2.0
"""Makes a Debian package from a wheel: the command, the daemon as a systemd service, and real-time privileges.

    python packaging/deb.py WHEEL FOLDER [--python 3.11]

The package has its own environment in /opt/opengpac, with its dependencies in the versions of constraints.txt, so that it installs
without a network and disturbs nothing. It is for one processor, that of the wheel, and for one Python: 3.11 for Debian 12, 3.12 for
Ubuntu 24.04, 3.13 for Debian 13.
"""

from __future__ import annotations

import argparse
import compileall
import hashlib
import os
import py_compile
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
PARTS = HERE / "debian"
ENVIRONMENT = Path("opt/opengpac")
PROCESSORS = {"x86_64": "amd64", "aarch64": "arm64"}

COMMAND = """\
#!/opt/opengpac/bin/python3
import sys

from opengpac.cli import main

sys.exit(main())
"""

# Installation path and mode of each file.
PLACES = {
    "opengpac@.service": ("usr/lib/systemd/system/opengpac@.service", 0o644),
    "70-opengpac.rules": ("usr/lib/udev/rules.d/70-opengpac.rules", 0o644),
    "limits.conf": ("etc/security/limits.d/opengpac.conf", 0o644),
    "default": ("etc/default/opengpac", 0o644),
    "README.Debian": ("usr/share/doc/opengpac/README.Debian", 0o644),
    "postinst": ("DEBIAN/postinst", 0o755),
    "prerm": ("DEBIAN/prerm", 0o755),
    "postrm": ("DEBIAN/postrm", 0o755),
}


def made(wheel: Path, folder: Path, python: str) -> Path:
    """Writes opengpac_VERSION_PROCESSOR.deb into the folder, and returns its path."""
    version, platform = wheel.name.split("-")[1], wheel.stem.split("-")[-1]
    machine = next((name for name in PROCESSORS if platform.split(".")[0].endswith(name)), None)
    if machine is None:
        sys.exit(f"{wheel.name}: packages exist only for {' and '.join(PROCESSORS)}")
    name = f"opengpac_{version}_{PROCESSORS[machine]}"
    with tempfile.TemporaryDirectory() as temporary:
        root = Path(temporary) / name
        install(wheel, root / ENVIRONMENT, machine, python)
        for part, (place, mode) in PLACES.items():
            write(root / place, (PARTS / part).read_bytes(), mode)
        write(root / "usr/share/doc/opengpac/copyright", copyright_text().encode(), 0o644)
        (root / "usr/bin").mkdir(parents=True)
        (root / "usr/bin/opengpac").symlink_to("/opt/opengpac/bin/opengpac")
        describe(root, version, PROCESSORS[machine], python)
        folder.mkdir(parents=True, exist_ok=True)
        package = folder / f"{name}.deb"
        subprocess.run(["dpkg-deb", "--root-owner-group", "-Zxz", "--build", root, package], check=True, stdout=subprocess.DEVNULL)
        return package


def install(wheel: Path, environment: Path, machine: str, python: str) -> None:
    """Installs the wheel and its dependencies into a new environment, for that processor and that Python."""
    packages = environment / "lib" / f"python{python}" / "site-packages"
    platforms = [f"--platform=manylinux{name}_{machine}" for name in ("_2_28", "_2_27", "_2_17", "2014")]
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--root-user-action=ignore"]
    chosen = ["--implementation=cp", f"--python-version={python}", "--only-binary=:all:", *platforms]
    target = ["--target", str(packages), "--no-compile"]
    ended = subprocess.run([*pip, *chosen, *target, "-c", str(HERE / "constraints.txt"), f"{wheel}[mujoco]"])
    if ended.returncode != 0:
        sys.exit(f"the dependencies of {wheel.name} cannot be installed for Python {python} on {machine}")
    # The dependencies' commands contain the path of the Python that installed them.
    shutil.rmtree(packages / "bin", ignore_errors=True)
    if sys.version_info[:2] == tuple(map(int, python.split("."))):
        compileall.compile_dir(
            packages, stripdir=str(packages), prependdir=f"/{ENVIRONMENT}/lib/python{python}/site-packages", quiet=2,
            invalidation_mode=py_compile.PycInvalidationMode.UNCHECKED_HASH,
        )  # fmt: skip
    write(environment / "pyvenv.cfg", f"home = /usr/bin\ninclude-system-site-packages = false\nversion = {python}\n".encode(), 0o644)
    write(environment / "bin/opengpac", COMMAND.encode(), 0o755)
    (environment / "bin/python3").symlink_to(f"/usr/bin/python{python}")
    (environment / "bin/python").symlink_to("python3")


def describe(root: Path, version: str, processor: str, python: str) -> None:
    """Writes dpkg's metadata of the package: its description, the digests of its files, and the list of its configuration files."""
    files = sorted(path for path in root.rglob("*") if path.is_file() and not path.is_symlink() and "DEBIAN" not in path.parts)
    major, minor = python.split(".")
    control = f"""\
Package: opengpac
Version: {version}
Section: science
Priority: optional
Architecture: {processor}
Maintainer: OpenGPAC <opengpac@users.noreply.github.com>
Depends: adduser, libc6 (>= 2.28), python3 (>= {python}), python3 (<< {major}.{int(minor) + 1})
Recommends: gcc, libc6-dev
Installed-Size: {sum(path.stat().st_size for path in files) // 1024}
Description: real-time automation controller, configured from Python
 Control programs for robots and machines: function blocks run in real time,
 are wired, commanded and changed from Python while the machine moves. With the
 daemon as a service of systemd, its guard, and a page for operators.
"""
    write(root / "DEBIAN/control", control.encode(), 0o644)
    kept = sorted(f"/{place}" for place, _ in PLACES.values() if place.startswith("etc/"))
    write(root / "DEBIAN/conffiles", "".join(f"{place}\n" for place in kept).encode(), 0o644)
    sums = (f"{hashlib.md5(path.read_bytes()).hexdigest()}  {path.relative_to(root)}\n" for path in files)
    write(root / "DEBIAN/md5sums", "".join(sums).encode(), 0o644)


def copyright_text() -> str:
    """Returns the licence file that Debian requires."""
    return (
        "Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/\n\n"
        "Files: *\nCopyright: the authors of OpenGPAC\nLicense: Apache-2.0\n"
        " The licence is in /usr/share/common-licenses/Apache-2.0. The licences of what the package brings along\n"
        " lie in the folders *.dist-info below /opt/opengpac.\n"
    )


def write(path: Path, content: bytes, mode: int) -> None:
    """Writes a file with the given mode, and creates its parent folders."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    os.chmod(path, mode)


def main() -> None:
    """Runs the command."""
    given = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    given.add_argument("wheel", type=Path)
    given.add_argument("folder", type=Path)
    given.add_argument("--python", default="3.11", metavar="VERSION", help="the Python of the distribution (default: 3.11, Debian 12)")
    options = given.parse_args()
    package = made(options.wheel.resolve(), options.folder, options.python)
    print(f"{package}: {package.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
