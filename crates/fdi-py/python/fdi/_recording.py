"""Recordings in memory."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _fdi
from ._error import FdiError
from ._words import column_words

if TYPE_CHECKING:
    from ._words import Columns


class Recording:
    """A recording: named channels, each with its times, and metadata.

    ``recording["current_a"]`` are the values as a numpy array that shares the memory (or, without
    numpy, a sequence); ``recording.times("current_a")`` are the times in seconds.
    """

    _inner: _fdi.Recording

    def __init__(
        self,
        table: Any,
        *,
        name: str = "recording",
        columns: Columns | None = None,
        metadata: Mapping[str, Any] | None = None,
    ) -> None:
        table, nan_is_gap = plain_table(table)
        self._inner = _fdi.Recording.of_table(
            table, name, _dict(metadata), column_words(columns), nan_is_gap
        )

    @classmethod
    def read(cls, path: str | os.PathLike[str], *, columns: Columns | None = None) -> Recording:
        """Reads a file: CSV, CSV in gzip, Parquet, MATLAB, MDF 4 or TDMS."""
        return cls._of(_fdi.Recording.read(os.fspath(path), column_words(columns)))

    @classmethod
    def from_bytes(cls, name: str, content: bytes, *, columns: Columns | None = None) -> Recording:
        """Reads the content of a file; the ending of its name tells the format."""
        return cls._of(_fdi.Recording.of_bytes(name, content, column_words(columns)))

    @classmethod
    def _of(cls, inner: _fdi.Recording) -> Recording:
        made = cls.__new__(cls)
        made._inner = inner
        return made

    @property
    def name(self) -> str:
        """Name in answers."""
        return self._inner.name

    @property
    def channels(self) -> list[str]:
        """Names of the channels."""
        return self._inner.channels

    @property
    def metadata(self) -> dict[str, str]:
        """Metadata, as a file would state them."""
        lines = self._inner.metadata_toml.splitlines()
        pairs = (line.partition(" = ") for line in lines)
        # texts of TOML, as they are written here, are texts of JSON
        return {key: json.loads(value) if value[:1] == '"' else value for key, _, value in pairs}

    def __getitem__(self, channel: str) -> Any:
        return _array(self._inner.values(channel))

    def times(self, channel: str) -> Any:
        """Times of a channel, s."""
        return _array(self._inner.times(channel))

    def to_csv(
        self,
        path: str | os.PathLike[str] | None = None,
        *,
        time_decimals: int = 9,
        value_decimals: int = 9,
    ) -> str:
        """The recording as CSV, and in a file where one is named."""
        text = self._inner.to_csv(time_decimals, value_decimals)
        if path is not None:
            Path(path).write_text(text, encoding="utf-8")
        return text

    def __reduce__(self) -> tuple[Any, ...]:
        return (_restored, (self.name, self.metadata, self._inner.state()))

    def __repr__(self) -> str:
        return f"<fdi.Recording {self.name!r}: {', '.join(self.channels)}>"

    def _repr_html_(self) -> str:
        from html import escape

        rows = "".join(
            f"<tr><td>{escape(channel)}</td><td>{len(self._inner.values(channel))}</td></tr>"
            for channel in self.channels
        )
        head = "<tr><th>channel</th><th>samples</th></tr>"
        return f"<b>{escape(self.name)}</b><table>{head}{rows}</table>"


def _restored(
    name: str, metadata: dict[str, str], channels: list[tuple[str, bytes, bytes]]
) -> Recording:
    return Recording._of(_fdi.Recording.of_state(name, metadata, channels))


def _array(samples: _fdi.Samples) -> Any:
    try:
        import numpy
    except ImportError:
        return samples
    return numpy.asarray(samples)


def _dict(metadata: Mapping[str, Any] | None) -> dict[str, Any] | None:
    return None if metadata is None else dict(metadata)


def plain_table(table: Any) -> tuple[Any, bool]:
    """A table as the library takes it, and whether NaN means that there is no number."""
    if isinstance(table, Mapping):
        return dict(table), False
    if hasattr(table, "iloc") and hasattr(table, "columns"):
        # pandas hands over Arrow only with pyarrow; its columns are numpy's
        twice = [str(name) for name in table.columns[table.columns.duplicated()]]
        if twice:
            raise FdiError(f"column `{twice[0]}` is there more than once", column=twice[0])
        return {str(name): _pandas_cells(table[name]) for name in table.columns}, True
    if hasattr(table, "collect") and hasattr(table, "collect_schema"):
        return table.collect(), False
    return table, False


def _pandas_cells(column: Any) -> Any:
    kind = getattr(column.dtype, "kind", "O")
    if getattr(column.dtype, "tz", None) is not None:
        # points in time: where their clock stands moves none of them
        return column.dt.tz_convert("UTC").dt.tz_localize(None).to_numpy()
    if not hasattr(column.dtype, "itemsize") or not hasattr(column.dtype, "byteorder"):
        # a type of pandas' own: numbers with gaps become doubles, the rest objects
        return column.to_numpy(dtype="float64", na_value=float("nan")) if kind in "iufb" else list(column)
    return column.to_numpy()
