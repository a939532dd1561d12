"""Files that travel with work to other machines."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import Union

from . import _kept
from ._error import FdiError


class Carried:
    """A file, or the files of a folder, by their content."""

    def __init__(self, name: str, files: dict[str, bytes]) -> None:
        self._name = name
        self._files = files

    @classmethod
    def of(cls, path: Union[str, os.PathLike[str]]) -> Carried:
        """What is there now."""
        place = Path(path)
        try:
            if not place.is_dir():
                return cls(place.name, {"": place.read_bytes()})
            files = sorted(one for one in place.iterdir() if one.is_file())
            return cls(place.name, {one.name: one.read_bytes() for one in files})
        except OSError as error:
            raise FdiError(str(error.strerror), file=os.fspath(path)) from error

    @property
    def path(self) -> Path:
        """The same on this machine; it goes with this process."""
        told = hashlib.sha256()
        for name, content in self._files.items():
            told.update(f"{name}\0{len(content)}\0".encode())
            told.update(content)
        folder = _kept.folder() / told.hexdigest()
        place = folder / self._name
        if not folder.exists():
            part = folder.with_suffix(".part")
            for name, content in self._files.items():
                file = part / self._name / name
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_bytes(content)
            part.replace(folder)
        return place
