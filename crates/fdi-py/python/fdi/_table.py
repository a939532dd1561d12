"""Answers as a table."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from functools import cached_property
from html import escape
from pathlib import Path
from typing import Any

from . import _fdi
from ._error import FdiError
from ._figure import Figure

#: Colours of the verdicts.
_COLOURS = {
    "healthy": "#1b7f3b",
    "faulty": "#b3261e",
    "model-inadequate": "#8a5a00",
    "undetermined": "#555555",
}
#: Most rows that a notebook shows.
_SHOWN = 20


class Table:
    """Answers to recordings, a row each, in their order.

    It hands over Arrow (``__arrow_c_stream__``), so that ``polars.DataFrame(table)``,
    ``pyarrow.table(table)`` and DuckDB take it as it is. Names of columns are those of the CSV and
    the Parquet file that the command line writes.
    """

    _inner: _fdi.Answers

    def __init__(self, inner: _fdi.Answers) -> None:
        self._inner = inner

    def __len__(self) -> int:
        return len(self._inner)

    @cached_property
    def answers(self) -> list[dict[str, Any]]:
        """Every answer as in the JSON document; a failure has ``error`` and no ``verdict``."""
        return [json.loads(line) for line in self._inner.lines()]

    @property
    def records(self) -> list[dict[str, Any]]:
        """Answers to the recordings that could be diagnosed."""
        return [answer for answer in self.answers if "verdict" in answer]

    @property
    def failed(self) -> list[dict[str, Any]]:
        """Recordings that could not be diagnosed, and why."""
        return [answer for answer in self.answers if "verdict" not in answer]

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return iter(self.answers)

    def __getitem__(self, key: int | str) -> dict[str, Any]:
        """An answer by its place, by the name of its recording, or by the end of that name."""
        return self.answers[self._place(key)]

    def _place(self, key: int | str) -> int:
        if isinstance(key, int):
            return range(len(self))[key]
        names = [answer["recording"] for answer in self.answers]
        found = [place for place, name in enumerate(names) if name == key]
        if not found:
            found = [place for place, name in enumerate(names) if name.endswith(key)]
        if len(found) != 1:
            raise KeyError(f"{key!r}: {len(found)} recordings have this name")
        return found[0]

    @property
    def bundle(self) -> str:
        """SHA-256 of the bundle."""
        return self._inner.bundle

    @property
    def seed(self) -> int:
        """Seed of what is random."""
        return self._inner.seed

    def to_json(self, path: str | os.PathLike[str] | None = None) -> str:
        """The document that ``fdi diagnose --output-format json`` writes, byte for byte."""
        return self._written("json", path).decode()

    def to_jsonl(self, path: str | os.PathLike[str] | None = None) -> str:
        """One answer a line."""
        return self._written("jsonl", path).decode()

    def to_csv(self, path: str | os.PathLike[str] | None = None) -> str:
        """The table as CSV."""
        return self._written("csv", path).decode()

    def to_parquet(self, path: str | os.PathLike[str] | None = None) -> bytes:
        """The table as Parquet."""
        return self._written("parquet", path)

    def _written(self, form: str, path: str | os.PathLike[str] | None) -> bytes:
        product = self._inner.written(form)
        if path is not None:
            Path(path).write_bytes(product)
        return product

    def to_dict(self) -> dict[str, list[Any]]:
        """Names of the columns, and the cells of each."""
        return self._inner.columns()

    def to_pandas(self) -> Any:
        """A frame of pandas."""
        import pandas

        return pandas.DataFrame(self.to_dict())

    def to_polars(self) -> Any:
        """A frame of polars."""
        import polars

        return polars.DataFrame(self)

    def to_arrow(self) -> Any:
        """A table of pyarrow."""
        import pyarrow

        return pyarrow.table(self)

    def __arrow_c_stream__(self, requested_schema: object = None) -> object:
        return self._inner.__arrow_c_stream__(requested_schema)

    def figure(self, key: int | str) -> Figure:
        """Drawing of the levels of an answer with their intervals, as SVG."""
        drawn = self._inner.fault_figure(self._place(key))
        if drawn is None:
            raise FdiError("it could not be diagnosed, so that there is nothing to draw", file=str(key))
        return Figure(drawn)

    def to_html(
        self, path: str | os.PathLike[str] | None = None, *, warning_change: float = 0.02
    ) -> str:
        """The report: one page that any browser reads without a network."""
        page = self._inner.page(warning_change)
        if path is not None:
            Path(path).write_text(page, encoding="utf-8")
        return page

    def __reduce__(self) -> tuple[Any, ...]:
        return (_restored, (self.bundle, self.seed, self._inner.lines()))

    def _counts(self) -> str:
        counted: dict[str, int] = {}
        for answer in self.answers:
            word = answer.get("verdict", "failed")
            counted[word] = counted.get(word, 0) + 1
        return ", ".join(f"{count} {word}" for word, count in counted.items())

    def __repr__(self) -> str:
        noun = "recording" if len(self) == 1 else "recordings"
        return f"<fdi.Table of {len(self)} {noun}: {self._counts()}>"

    def _repr_html_(self) -> str:
        faults = [f"k{number}" for number in range(1, 8)]
        head = "".join(f"<th>{name}</th>" for name in ["recording", "verdict", *faults])
        rows = "".join(_row(answer) for answer in self.answers[:_SHOWN])
        more = len(self) - _SHOWN
        left = f"<p>and {more} more</p>" if more > 0 else ""
        told = f"<p>{escape(self._counts())}; * detected, – not determined</p>"
        return f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>{left}{told}"


def _row(answer: dict[str, Any]) -> str:
    name = escape(os.path.basename(answer["recording"]))
    if "verdict" not in answer:
        return f"<tr><td>{name}</td><td>failed</td><td colspan=7>{escape(answer['error'])}</td></tr>"
    verdict = answer["verdict"]
    cells = "".join(f"<td>{_level(fault)}</td>" for fault in answer["faults"])
    colour = _COLOURS.get(verdict, "inherit")
    return f'<tr><td>{name}</td><td style="color:{colour}">{verdict}</td>{cells}</tr>'


def _level(fault: dict[str, Any]) -> str:
    if fault.get("value") is None:
        return "–"
    mark = " *" if fault.get("detected") else ""
    std = "" if fault.get("std") is None else f" ± {fault['std']:.4f}"
    return f"{fault['value']:.4f}{std}{mark}"


def _restored(bundle: str, seed: int, lines: list[str]) -> Table:
    return Table(_fdi.Answers.of_lines(bundle, seed, lines))
