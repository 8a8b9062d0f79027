# SPDX-License-Identifier: Apache-2.0
"""Makes the release wheel from the one that maturin built: moves debug information into a separate file, and adds the C headers.

    python packaging/wheel.py FROM.whl FOLDER [--at-most MB]

A missing part (the studio's page, links between hosts) is an error: users who install a wheel have no Node and no Rust to build it.
"""

from __future__ import annotations

import argparse
import base64
import csv
import hashlib
import io
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

HERE = Path(__file__).parent
EXTENSION = "opengpac/_native.abi3.so"
HEADERS = Path("crates/block/include")
PAGE = "opengpac/studio_page/index.html"


def made(source: Path, folder: Path) -> Path:
    """Returns the wheel in the folder; writes NAME.debug with the debug information of its extension beside it."""
    with tempfile.TemporaryDirectory() as name:
        inside = Path(name)
        with zipfile.ZipFile(source) as wheel:
            wheel.extractall(inside)
        extension = inside / EXTENSION
        subprocess.run([HERE / "split-debug", extension], check=True)
        folder.mkdir(parents=True, exist_ok=True)
        debug = extension.with_name(extension.name + ".debug")
        shutil.move(debug, folder / f"{source.name.removesuffix('.whl')}.debug")
        complete(inside, extension)
        shutil.copytree(HERE.parent / HEADERS, inside / "opengpac/include")
        return packed(inside, folder / source.name)


def complete(inside: Path, extension: Path) -> None:
    """Exits with an error if the wheel lacks a part. The extension is read, not loaded: it may be for another processor."""
    if not (inside / PAGE).is_file():
        sys.exit("the page of the studio is not in the wheel; build it with make page")
    if b"zenoh" not in extension.read_bytes():
        sys.exit("the wheel lacks links between hosts; build it with --features hosts")


def packed(inside: Path, wheel: Path) -> Path:
    """Writes the files as a wheel, with their digests; the same files give the same bytes."""
    files = sorted(path for path in inside.rglob("*") if path.is_file())
    record = next(path for path in files if path.match("*.dist-info/RECORD"))
    rows = io.StringIO()
    lines = csv.writer(rows, lineterminator="\n")
    for path in files:
        if path != record:
            digest = base64.urlsafe_b64encode(hashlib.sha256(path.read_bytes()).digest()).rstrip(b"=").decode()
            lines.writerow([path.relative_to(inside).as_posix(), f"sha256={digest}", path.stat().st_size])
    lines.writerow([record.relative_to(inside).as_posix(), "", ""])
    record.write_text(rows.getvalue())
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as out:
        for path in files:
            entry = zipfile.ZipInfo(path.relative_to(inside).as_posix(), (1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (0o100755 if path.suffix == ".so" else 0o100644) << 16
            out.writestr(entry, path.read_bytes())
    return wheel


def main() -> None:
    """Runs the command."""
    given = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    given.add_argument("source", type=Path)
    given.add_argument("folder", type=Path)
    given.add_argument("--at-most", type=float, default=40.0, metavar="MB", help="maximum size of the wheel, MB (default: 40)")
    options = given.parse_args()
    wheel = made(options.source, options.folder)
    size = wheel.stat().st_size / 1e6
    print(f"{wheel}: {size:.1f} MB")
    if size > options.at_most:
        sys.exit(f"the wheel has {size:.1f} MB, more than {options.at_most:g}")


if __name__ == "__main__":
    main()
