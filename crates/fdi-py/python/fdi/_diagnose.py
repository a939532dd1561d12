"""The diagnosis of recordings from anywhere."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Literal, Union

from . import _fdi
from ._error import FdiError
from ._recording import Recording, plain_table
from ._table import Table
from ._words import column_words, everywhere, level_words, words

if TYPE_CHECKING:
    from ._artefacts import Bundle, Unit
    from ._words import Columns

#: Hears of each answer: the name of the recording, how many are done, of how many.
Progress = Callable[[str, int, int], None]
#: A place in the file system.
Place = Union[str, "os.PathLike[str]"]


@lru_cache(maxsize=8)
def _session(given: tuple[str, ...]) -> _fdi.Session:
    """What is read once a process: bundles, units, and what is learnt of them."""
    return _fdi.Session(list(given))


def _options(
    *,
    columns: Columns | None = None,
    bundle: Bundle | Place | None = None,
    unit: Unit | Place | None = None,
    reference: Iterable[Place] = (),
    method: str = "gls",
    fidelity: str = "low",
    encoding: str = "full",
    tolerance: str = "model",
    max_evaluations: int | None = None,
    noise_a: float | None = None,
    max_delay_s: float | None = None,
    free_start: bool = False,
    id_from: str | None = None,
    date_from: str | None = None,
    decide: bool = False,
    watch: Mapping[str, float] | None = None,
    act: Mapping[str, float] | None = None,
    gaps: str = "refuse",
    skip_lines: int = 0,
    seed: int = 0,
    jobs: int | None = None,
    stable: bool = False,
) -> list[str]:
    options = {
        "map": column_words(columns),
        "bundle": bundle,
        "unit": unit,
        "reference": reference,
        "method": method,
        "fidelity": fidelity,
        "encoding": encoding,
        "tolerance": tolerance,
        "max_evaluations": max_evaluations,
        "noise_a": noise_a,
        "max_delay_s": max_delay_s,
        "free_start": free_start,
        "id_from": id_from,
        "date_from": date_from,
        "decide": decide,
        "watch": level_words("watch", watch),
        "act": level_words("act", act),
        "gaps": gaps,
        "skip_lines": skip_lines,
    }
    return [*words(options), *everywhere(seed, jobs, stable=stable)]


def diagnose(
    source: Any,
    *,
    group: str | None = None,
    metadata: Mapping[str, Any] | None = None,
    name: str = "recording",
    on_error: Literal["row", "raise"] = "row",
    progress: bool | Progress = False,
    **options: Any,
) -> Table:
    """Diagnoses recordings.

    ``source`` is a file or a folder, several of them, a :class:`Recording` or several, or a table:
    a mapping from names to arrays, a frame of pandas or polars, a table of pyarrow, a relation of
    DuckDB, anything with ``__arrow_c_stream__``. A table is one recording; with columns that are
    lists, one recording a row; with ``group``, one for each value of that column; with a column
    ``path``, and perhaps ``content``, the files that it names or holds.

    ``columns`` says which columns are which channels, ``metadata`` what a file would state of itself
    (``{"start_angle_rad": 0.0}``). Numbers in doubles, one after another, are read where they lie;
    do not write into them meanwhile. The other ``options`` are those of ``fdi diagnose``: ``bundle``, ``unit``,
    ``reference``, ``method``, ``fidelity``, ``encoding``, ``tolerance``, ``max_evaluations``,
    ``noise_a``, ``max_delay_s``, ``free_start``, ``id_from``, ``date_from``, ``decide``, ``watch``
    and ``act`` (levels such as ``{"k1": 0.1}``), ``gaps`` and ``skip_lines`` (of files), ``seed``,
    ``jobs``, ``stable``.

    A recording that cannot be diagnosed is a row with its ``error``; with ``on_error="raise"`` it
    is an :class:`FdiError`.
    """
    if on_error not in ("row", "raise"):
        raise FdiError(f"`on_error` is {on_error!r}, expected 'row' or 'raise'")
    given = _options(**options)
    told = _told(progress)
    table = _answers(source, given, group, metadata, name, told)
    if on_error == "raise":
        for failure in table.failed:
            raise FdiError(failure["error"], file=failure["recording"])
    return table


def _answers(
    source: Any,
    given: list[str],
    group: str | None,
    metadata: Mapping[str, Any] | None,
    name: str,
    told: Progress | None,
) -> Table:
    # a session wants a path; of these there are none to be read
    session = _session((*given, "--", os.devnull))
    if isinstance(source, Recording):
        return Table(session.recordings([source._inner], told))
    if isinstance(source, (str, os.PathLike)):
        source = [source]
    if isinstance(source, (list, tuple)):
        if all(isinstance(one, Recording) for one in source):
            return Table(session.recordings([one._inner for one in source], told))
        if all(isinstance(one, (str, os.PathLike)) for one in source):
            return Table(session.paths([os.fspath(one) for one in source], told))
        kinds = ", ".join(sorted({type(one).__name__ for one in source}))
        raise FdiError(f"a list of {kinds}, expected paths or recordings")
    table, nan_is_gap = plain_table(source)
    named = None if metadata is None else dict(metadata)
    return Table(session.table(table, group, named, name, nan_is_gap, told))


def check(**options: Any) -> None:
    """Reads what the options name; what is wrong with them is an :class:`FdiError`."""
    _session((*_options(**{"jobs": 1, "stable": True, **options}), "--", os.devnull))


def _told(progress: bool | Progress) -> Progress | None:
    if callable(progress):
        return progress
    return _line if progress else None


def _line(name: str, done: int, total: int) -> None:
    """Progress in one line on standard error."""
    end = "\n" if done == total else ""
    print(f"\r{done} of {total} recordings", end=end, file=sys.stderr, flush=True)


def batches(source: Iterable[Any], **options: Any) -> Iterator[Any]:
    """Diagnoses record batches: the entry of engines.

    Each batch is a table as :func:`diagnose` takes them, of files (columns ``path`` and
    ``content``), paths, or recordings a row; what comes out for it is a batch with a row a
    recording. Batches of pyarrow give batches of pyarrow, others a :class:`Table`. Answers depend
    on the recording, the bundle, the unit and the seed alone; one thread works.
    """
    given = {"jobs": 1, "stable": True, **options}
    for batch in source:
        # engines have parts without a row
        if getattr(batch, "num_rows", 1) == 0:
            continue
        table = diagnose(batch, **given)
        if type(batch).__module__.split(".")[0] == "pyarrow":
            yield from table.to_arrow().to_batches()
        else:
            yield table


def fit_figure(recording: Recording, **options: Any) -> str | None:
    """Drawing of a recording beside the model with the levels found, as SVG."""
    if not isinstance(recording, Recording):
        raise FdiError(f"{recording!r} is no recording: read it with `fdi.Recording.read`")
    session = _session((*_options(**options), "--", os.devnull))
    return session.fit_figure(recording._inner)
