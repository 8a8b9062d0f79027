# SPDX-License-Identifier: Apache-2.0
"""Builds the documentation site into one archive, which the package contains: `python packaging/docs_site.py ARCHIVE`.

A Sphinx warning (a broken link, anchor or page) is an error. The same pages give the same bytes.
"""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

TOP = Path(__file__).parent.parent
OUT = TOP / "out" / "docs"
LEFT_OUT = ("_sources/", ".buildinfo", "objects.inv", "genindex.html")


def main(archive: Path) -> int:
    """Runs the command; returns Sphinx's exit code."""
    words = ["-W", "--keep-going", "-q", "-b", "html", "-d", str(TOP / "out" / "doctrees"), str(TOP / "docs"), str(OUT)]
    ended = subprocess.run([sys.executable, "-m", "sphinx", *words])
    if ended.returncode != 0:
        return ended.returncode
    files = {path.relative_to(OUT).as_posix(): path for path in sorted(OUT.rglob("*")) if path.is_file()}
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as out:
        for name, path in files.items():
            if not name.startswith(LEFT_OUT):
                out.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), path.read_bytes(), zipfile.ZIP_DEFLATED, 9)
    print(f"{OUT / 'index.html'}; {archive}: {archive.stat().st_size / 1e6:.1f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
