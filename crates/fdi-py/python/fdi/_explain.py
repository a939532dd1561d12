"""What a model misses: its causes, its numbers, the recording to take next."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union

from . import _kept
from ._artefacts import run
from ._error import FdiError
from ._own_model import Columns as Table
from ._own_model import OwnModel, of_own_model
from ._recording import Recording
from ._words import column_words, everywhere, words

if TYPE_CHECKING:
    from ._artefacts import Bundle, Unit
    from ._words import Columns

#: A recording: its file, or in memory; for a model of one's own a table.
OneRecording = Union[str, "os.PathLike[str]", Recording, Table]
#: Recordings.
Recordings = Union[OneRecording, Iterable[OneRecording]]


class Document(Mapping[str, Any]):
    """A JSON document of the command line: its fields by name, or as attributes.

    ``model`` of the document is the name of the model; ``extended`` is the text of a model file
    with what was found, where there is one.
    """

    def __init__(self, text: str, extended: str | None = None) -> None:
        self._text = text
        self._fields: dict[str, Any] = json.loads(text)
        self.extended = extended

    def __getitem__(self, name: str) -> Any:
        return self._fields[name]

    def __iter__(self) -> Any:
        return iter(self._fields)

    def __len__(self) -> int:
        return len(self._fields)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name not in self._fields:
            raise AttributeError(f"the document has no `{name}`: it has {', '.join(self._fields)}")
        return self._fields[name]

    def to_json(self, path: str | os.PathLike[str] | None = None) -> str:
        """The document, byte for byte as the command line writes it."""
        if path is not None:
            Path(path).write_text(self._text, encoding="utf-8")
        return self._text

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the model with what was found into a file."""
        if self.extended is None:
            raise FdiError("this document has no model with what was found")
        Path(path).write_text(self.extended, encoding="utf-8")

    def __reduce__(self) -> tuple[Any, ...]:
        return (Document, (self._text, self.extended))

    def __repr__(self) -> str:
        told = self._fields.get("sentence") or ", ".join(self._fields)
        return f"<fdi.Document: {told}>"

    def _repr_html_(self) -> str:
        told = self._fields.get("sentence")
        plain = {name: value for name, value in self._fields.items() if isinstance(value, (str, int, float))}
        rows = "".join(f"<tr><td>{escape(name)}</td><td>{escape(str(value))}</td></tr>" for name, value in plain.items())
        head = "" if told is None else f"<p>{escape(told)}</p>"
        return f"{head}<table>{rows}</table>"


def _files(recordings: Any) -> list[str]:
    if isinstance(recordings, (str, os.PathLike, Recording)) or hasattr(recordings, "keys"):
        return [_file(recordings, 0)]
    return [_file(one, place) for place, one in enumerate(recordings)]


def _file(one: Any, place: int) -> str:
    if isinstance(one, (str, os.PathLike)):
        return os.fspath(one)
    if not isinstance(one, Recording):
        message = f"recording {place} is a table, expected a file or a `fdi.Recording`"
        raise FdiError(message, remedy="make a `fdi.Recording` of it")
    # 24 decimals give every number of a recording back; nine are those of a time axis
    text = one.to_csv(value_decimals=24)
    return os.fspath(_kept.file_of(text.encode(), f"-{place}.csv"))


#: A model: its file, or a simulation of one's own.
Model = Union[str, "os.PathLike[str]", OwnModel]


def _run(
    task: str,
    model: Model | None,
    recordings: Mapping[str, Recordings],
    options: Mapping[str, Any],
    *,
    columns: Columns | None,
    seed: int,
    jobs: int | None,
    stable: bool,
    tests: Mapping[str, Any] | None = None,
    writes_model: bool = True,
) -> Document:
    """The document of a task; ``options`` are those that read model files."""
    if isinstance(model, OwnModel):
        given = {**options, "repeat": recordings["repeat"], "columns": columns}
        for option, value in given.items():
            if value not in (None, (), False):
                raise FdiError(f"`{option}` has no meaning for a model of your own")
        return Document(of_own_model(task, model, recordings["train"], recordings["holdout"], tests))
    asked = words({"model": model, **options, "map": column_words(columns)})
    asked += everywhere(seed, jobs, stable=stable)
    for option, several in recordings.items():
        files = _files(several)
        if files:
            asked += [f"--{option}", *files]
    if not writes_model:
        return Document(run(task, asked)[1].decode())
    place = _kept.folder() / f"{task}-{os.urandom(8).hex()}.toml"
    try:
        text = run(task, [*asked, "--output", os.fspath(place)])[1].decode()
        extended = place.read_text(encoding="utf-8") if place.exists() else None
    finally:
        place.unlink(missing_ok=True)
    return Document(text, extended)


def explain(
    train: Recordings,
    *,
    holdout: Recordings = (),
    repeat: Recordings = (),
    model: Model | None = None,
    command: str | os.PathLike[str] | None = None,
    inverse_dynamics: bool = False,
    fidelity: str | None = None,
    unit: Unit | str | os.PathLike[str] | None = None,
    bundle: Bundle | str | os.PathLike[str] | None = None,
    without: Iterable[str] = (),
    exact: Iterable[str] = (),
    report: str | os.PathLike[str] | None = None,
    columns: Columns | None = None,
    seed: int = 0,
    jobs: int | None = None,
    stable: bool = False,
) -> Document:
    """Says what a model misses in recordings, with its cause where it can tell.

    The options are those of ``fdi explain``. ``extended`` of the answer is the model with what was
    found, as the text of a model file. ``fidelity`` is ``"learnt"``, ``"ideal"``, ``"low"`` or
    ``"high"``; ``bundle`` knows the learnt error, by default the embedded one. ``model`` may be a
    simulation of your own; recordings are then tables with its columns.
    """
    options = {
        "command": command,
        "inverse_dynamics": inverse_dynamics,
        "fidelity": fidelity,
        "unit": unit,
        "bundle": bundle,
        "without": without,
        "exact": exact,
        "report": report,
    }
    recordings = {"train": train, "holdout": holdout, "repeat": repeat}
    return _run(
        "explain", model, recordings, options, columns=columns, seed=seed, jobs=jobs, stable=stable
    )


def calibrate(
    train: Recordings,
    *,
    model: Model,
    holdout: Recordings = (),
    repeat: Recordings = (),
    command: str | os.PathLike[str] | None = None,
    inverse_dynamics: bool = False,
    bundle: Bundle | str | os.PathLike[str] | None = None,
    columns: Columns | None = None,
    seed: int = 0,
    jobs: int | None = None,
    stable: bool = False,
) -> Document:
    """Finds the numbers of a machine from recordings of it as new; options of ``fdi calibrate``.

    ``model`` may be a simulation of your own.
    """
    options = {"command": command, "inverse_dynamics": inverse_dynamics, "bundle": bundle}
    recordings = {"train": train, "holdout": holdout, "repeat": repeat}
    return _run(
        "calibrate", model, recordings, options, columns=columns, seed=seed, jobs=jobs, stable=stable
    )


def propose(
    train: Recordings,
    *,
    holdout: Recordings = (),
    repeat: Recordings = (),
    model: Model | None = None,
    command: str | os.PathLike[str] | None = None,
    inverse_dynamics: bool = False,
    fidelity: str | None = None,
    without: Iterable[str] = (),
    exact: Iterable[str] = (),
    commands: Mapping[str, Any] | None = None,
    columns: Columns | None = None,
    seed: int = 0,
    jobs: int | None = None,
    stable: bool = False,
) -> Document:
    """Looks for the recording that tells open causes apart; options of ``fdi propose``.

    ``model`` may be a simulation of your own; ``commands`` are then the tests to choose from, by
    name.
    """
    if commands is not None and not isinstance(model, OwnModel):
        raise FdiError("`commands` are for a model of your own; `command` names a file")
    options = {
        "command": command,
        "inverse_dynamics": inverse_dynamics,
        "fidelity": fidelity,
        "without": without,
        "exact": exact,
    }
    recordings = {"train": train, "holdout": holdout, "repeat": repeat}
    return _run(
        "propose", model, recordings, options, columns=columns, seed=seed, jobs=jobs, stable=stable,
        tests=commands, writes_model=False,
    )
