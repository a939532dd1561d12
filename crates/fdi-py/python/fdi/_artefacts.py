"""Bundles and units: files that travel with a program, pickled as their content."""

from __future__ import annotations

import json
import logging
import os
from collections.abc import Iterable
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _fdi, _kept
from ._error import FdiError
from ._words import column_words, everywhere, words

if TYPE_CHECKING:
    from ._words import Columns

_LOG = logging.getLogger("fdi")


def run(name: str, given: list[str]) -> tuple[int, bytes]:
    """Runs a command; what it says goes to the log, what it fails of is an error."""
    status, product, messages = _fdi.command(name, given)
    for line in messages.splitlines():
        if line.strip():
            _LOG.info("%s", line)
    if status == 2:
        raise FdiError(messages.strip().removeprefix("error: ") or f"`{name}` failed")
    return status, product


class _Artefact:
    """Content of a file."""

    _ENDING = ""

    def __init__(self, content: bytes) -> None:
        self._content = content

    @classmethod
    def _read(cls, path: str | os.PathLike[str]) -> bytes:
        try:
            return Path(path).read_bytes()
        except OSError as error:
            raise FdiError(str(error.strerror), file=os.fspath(path)) from error

    @property
    def path(self) -> Path:
        """A file with the content, which goes with this process."""
        return _kept.file_of(self._content, self._ENDING)

    def __fspath__(self) -> str:
        """The place of such a file, so that an artefact stands wherever a path may."""
        return os.fspath(self.path)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the content into a file."""
        Path(path).write_bytes(self._content)

    def __reduce__(self) -> tuple[Any, ...]:
        return (_restored, (type(self), self._content))


def _restored(kind: type[_Artefact], content: bytes) -> _Artefact:
    """An artefact that was looked at where it came from."""
    made = kind.__new__(kind)
    made._content = content
    return made


class Bundle(_Artefact):
    """What is learnt offline of an actuator in a test.

    ``Bundle.load(path)`` reads one; the ones that come with the package need no ``Bundle``.
    """

    _ENDING = ".fdib"

    def __init__(self, content: bytes) -> None:
        super().__init__(content)
        # content that is no bundle is told here
        _ = self.summary

    @cached_property
    def summary(self) -> dict[str, Any]:
        """What `fdi bundle show` says of it."""
        given = ["show", os.fspath(self), *everywhere(0, 1, stable=True)]
        told: dict[str, Any] = json.loads(run("bundle", given)[1])
        return told

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Bundle:
        """Reads the file of a bundle."""
        return cls(cls._read(path))

    @classmethod
    def build(
        cls, datasets: Iterable[str | os.PathLike[str]], *, seed: int = 0, jobs: int | None = None
    ) -> Bundle:
        """Learns a bundle from datasets that `fdi dataset` made."""
        made = _kept.folder() / f"built-{os.getpid()}.fdib"
        given = ["build", *words({"dataset": datasets, "output": made})]
        run("bundle", [*given, *everywhere(seed, jobs, stable=True)])
        return cls.load(made)

    def __repr__(self) -> str:
        told = self.summary
        return f"<fdi.Bundle of {told.get('model')!r} in {told.get('command')!r}>"


class Unit(_Artefact):
    """A machine of a type that was learnt from recordings of it as new."""

    _ENDING = ".fdi-unit"

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Unit:
        """Reads the file of a unit."""
        return cls(cls._read(path))

    @classmethod
    def learn(
        cls,
        recordings: Iterable[str | os.PathLike[str]],
        *,
        bundle: Bundle | None = None,
        columns: Columns | None = None,
        seed: int = 0,
        jobs: int | None = None,
    ) -> Unit:
        """Learns a unit from recordings of it as new."""
        made = _kept.folder() / f"learnt-{os.getpid()}{cls._ENDING}"
        options = {
            "bundle": bundle,
            "map": column_words(columns),
            "output": made,
        }
        given = ["learn", *words(options), *everywhere(seed, jobs, stable=True)]
        run("unit", [*given, "--", *(os.fspath(one) for one in recordings)])
        return cls.load(made)

    def summary(self, *, bundle: Bundle | None = None) -> dict[str, Any]:
        """What is known of the unit."""
        given = ["show", os.fspath(self)]
        given += words({"bundle": bundle})
        told: dict[str, Any] = json.loads(run("unit", [*given, *everywhere(0, 1, stable=True)])[1])
        return told
