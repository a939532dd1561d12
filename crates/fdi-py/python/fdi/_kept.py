"""Artefacts that travel as bytes, and stand in files where the library wants files."""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import tempfile
from pathlib import Path

_FOLDERS: dict[int, Path] = {}


def folder() -> Path:
    """A folder of this process that goes with it."""
    process = os.getpid()
    if process not in _FOLDERS:
        made = Path(tempfile.mkdtemp(prefix="fdi-"))
        _FOLDERS[process] = made
        atexit.register(_remove, process, made)
    return _FOLDERS[process]


def _remove(process: int, made: Path) -> None:
    # a process that was forked has its parent's list
    if process == os.getpid():
        shutil.rmtree(made, ignore_errors=True)


def file_of(content: bytes, ending: str) -> Path:
    """A file with this content."""
    path = folder() / (hashlib.sha256(content).hexdigest() + ending)
    if not path.exists():
        part = path.with_suffix(f".{os.getpid()}.part")
        part.write_bytes(content)
        part.replace(path)
    return path
