"""Drawings."""

from __future__ import annotations

import os
from pathlib import Path


class Figure(str):
    """A drawing as SVG; a notebook shows it."""

    def _repr_svg_(self) -> str:
        return str(self)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the drawing into a file."""
        Path(path).write_text(str(self), encoding="utf-8")
