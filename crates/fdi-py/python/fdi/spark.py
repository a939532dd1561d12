"""Diagnoses on Apache Spark, and on Sail, which runs the same frames without Java.

>>> from fdi.spark import diagnose                                        # doctest: +SKIP
>>> files = spark.read.format("binaryFile").load("fleet")                 # doctest: +SKIP
>>> diagnose(files).write.parquet("diagnosis.parquet")                    # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

from . import _fdi
from ._artefacts import Bundle, Unit
from ._carried import Carried
from ._diagnose import batches, check
from ._diagnose import diagnose as diagnose_table
from ._error import FdiError

if TYPE_CHECKING:
    from ._diagnose import Place

#: Recordings of one batch that are in memory twice.
_AT_ONCE = 64
#: Options that an engine sets by itself.
_OF_THE_ENGINE = ("jobs", "stable", "progress", "on_error", "name")
#: Types of Spark's columns, by the kinds of ours.
_TYPES = {"text": "string", "number": "double", "count": "bigint", "truth": "boolean"}
#: How the recordings lie in the rows of a frame.
_Lie = Literal["files", "rows", "groups"]


def diagnose(
    frame: Any,
    *,
    group: str | None = None,
    metadata: Mapping[str, Any] | None = None,
    bundle: Bundle | Place | None = None,
    unit: Unit | Place | None = None,
    reference: Iterable[Place] = (),
    **options: Any,
) -> Any:
    """Diagnoses the recordings of a frame of Spark or Sail; the answer is a frame, a row a recording.

    The rows of ``frame`` are one of these:

    - files: columns ``path`` and ``content``, as ``spark.read.format("binaryFile")`` gives them, or
      ``path`` alone, where every worker sees the files;
    - recordings: columns that are lists of numbers, and ``recording``, the name of each;
    - samples, with ``group``: the column whose values tell recordings apart. Rows of a group are
      brought together and put in the order of their time.

    Names and types of the columns of the answer are those of :class:`fdi.Table`. A recording that
    cannot be read is a row with its ``error``. The other options are those of :func:`fdi.diagnose`;
    files that they name are read here and travel with the work. A row depends on the recording, the
    bundle, the unit and the seed alone, so that work that is done again gives the same bytes. Each
    task works on one thread, and each worker reads a bundle once.
    """
    for name in _OF_THE_ENGINE:
        if name in options:
            raise FdiError(f"`{name}` is no option here: the engine decides on it")
    carried = {
        "bundle": bundle if bundle is None or isinstance(bundle, Bundle) else Bundle.load(bundle),
        "unit": unit if unit is None or isinstance(unit, Unit) else Carried.of(unit),
        "reference": [Carried.of(one) for one in reference],
    }
    work = _Work(_lie(frame, group), group, metadata, carried, options)
    # what is wrong with the options is said here, not by a worker
    check(**work.options)
    if group is not None:
        work.time = _time(frame, options)

        # engines count the arguments, that of a method's object too
        def answer(table: Any) -> Any:
            return work.group(table)

        return frame.groupBy(group).applyInArrow(answer, schema())
    if work.lie == "files":
        held = ["path", "content"] if "content" in frame.columns else ["path"]
        frame = frame.select(*held)
    return frame.mapInArrow(work.parts, schema())


def schema() -> str:
    """The columns of the answer, as Spark spells them."""
    return ", ".join(f"{name} {_TYPES[kind]}" for name, kind in _fdi.table_columns())


def _lie(frame: Any, group: str | None) -> _Lie:
    types = {field.name: field.dataType.typeName() for field in frame.schema.fields}
    if group is not None:
        if group not in types:
            raise FdiError(f"no column `{group}` to group by; {_columns(types)}", column=group)
        return "groups"
    if "array" in types.values():
        if "recording" not in types:
            told = "no column `recording` with the name of each row's recording"
            raise FdiError(f"{told}; {_columns(types)}", column="recording")
        return "rows"
    if "path" in types:
        return "files"
    raise FdiError(
        f"no recordings: neither a column `path`, nor lists, nor a `group` is there; {_columns(types)}",
        remedy="group=COLUMN, where a row is a sample",
    )


def _columns(types: Mapping[str, str]) -> str:
    return "the columns are " + ", ".join(f"`{name}`" for name in types)


def _time(frame: Any, options: Mapping[str, Any]) -> str:
    """The column with the time of each sample: a frame has no order of its own."""
    mapped = (options.get("columns") or {}).get("time_s", "time_s")
    name = mapped if isinstance(mapped, str) else mapped[0]
    if name not in frame.columns:
        raise FdiError(
            f"no column `{name}` with the time of each sample",
            column=name,
            remedy='columns={"time_s": "COLUMN"}',
        )
    return str(name)


class _Work:
    """What a worker does in a task."""

    def __init__(
        self,
        lie: _Lie,
        group: str | None,
        metadata: Mapping[str, Any] | None,
        carried: Mapping[str, Any],
        options: Mapping[str, Any],
    ) -> None:
        self.lie = lie
        #: Column with the time of each sample of a group.
        self.time: str | None = None
        self._group = group
        self._metadata = None if metadata is None else dict(metadata)
        self._carried = dict(carried)
        self._options = dict(options)

    def __getstate__(self) -> dict[str, Any]:
        # files of this machine stay here
        return {name: value for name, value in vars(self).items() if name != "options"}

    @cached_property
    def options(self) -> dict[str, Any]:
        """Options with files of this machine for what travelled."""

        def here(one: Any) -> Any:
            return [here(each) for each in one] if isinstance(one, list) else one and one.path

        return {**self._options, **{name: here(one) for name, one in self._carried.items()}}

    def parts(self, source: Iterator[Any]) -> Iterator[Any]:
        """Answers to the recordings of batches."""
        yield from batches(_small(source), metadata=self._metadata, **self.options)

    def group(self, table: Any) -> Any:
        """The answer to the recording of a group; its rows come in any order."""
        given = {**self.options, "group": self._group, "metadata": self._metadata}
        return diagnose_table(table.sort_by(self.time), jobs=1, stable=True, **given).to_arrow()


def _small(source: Iterable[Any]) -> Iterator[Any]:
    """Batches cut up: a row may be a file of megabytes."""
    for batch in source:
        for start in range(0, batch.num_rows, _AT_ONCE):
            yield batch.slice(start, _AT_ONCE)


__all__ = ["diagnose", "schema"]
