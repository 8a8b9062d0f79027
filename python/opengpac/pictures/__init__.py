# SPDX-License-Identifier: Apache-2.0
"""Pictures of definitions as SVG: `graph.svg()` in `flow.py`, `verb.svg()` in `states.py`; a notebook shows them by itself."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from ..storage import files


class PictureOwner:
    """Object that has a picture."""

    def svg(self) -> str:
        """Its picture as SVG text, light and dark by the reader's preference; the same definition gives the same text."""
        raise NotImplementedError

    def save_svg(self, path: str | os.PathLike[str]) -> Path:
        """Writes its picture to a file, whole or not at all; gives the path. `FileFailed` where it cannot be written."""
        file = Path(path).expanduser().absolute()
        files.write(file, self.svg(), "the picture")
        return file

    def _repr_svg_(self) -> Any:
        return self.svg()
