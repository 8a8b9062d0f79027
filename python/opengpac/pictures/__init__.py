# SPDX-License-Identifier: Apache-2.0
"""Pictures of definitions as SVG. `flow.py` draws `graph.svg()`, `states.py` draws `verb.svg()`; a notebook shows them automatically."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from ..storage import files


class PictureOwner:
    """Object that has a picture."""

    def svg(self) -> str:
        """Returns the picture as SVG text, light or dark according to the reader's preference; equal definitions give identical texts."""
        raise NotImplementedError

    def save_svg(self, path: str | os.PathLike[str]) -> Path:
        """Writes the picture to the file at `path` atomically; returns the path. Raises `FileFailed` if it cannot be written."""
        file = Path(path).expanduser().absolute()
        files.write(file, self.svg(), "the picture")
        return file

    def _repr_svg_(self) -> Any:
        return self.svg()
