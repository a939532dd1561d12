"""Arguments as words of the command line, whose parser checks them."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import Any, Union

from ._error import FdiError

#: Which columns are which channels: ``{"current_a": "i_motor"}``, with a factor
#: ``{"current_a": ("i_motor", 0.001)}``.
Columns = Mapping[str, Union[str, tuple[str, float]]]


def column_words(columns: Columns | None) -> list[str]:
    """Columns as the command line maps them."""
    return [
        f"{channel}={column}" if isinstance(column, str) else f"{channel}={_scaled(channel, column)}"
        for channel, column in _pairs("columns", columns)
    ]


def _pairs(name: str, given: Any) -> Iterable[tuple[Any, Any]]:
    if given is None:
        return []
    if not isinstance(given, Mapping):
        raise FdiError(f"`{name}` is {given!r}, expected names with what belongs to them: {{...}}")
    return given.items()


def _scaled(channel: Any, column: Any) -> str:
    try:
        name, factor = column
        return f"{name}*{float(factor)!r}"
    except (TypeError, ValueError):
        told = f"`columns` has {column!r} for `{channel}`, expected a name, or a name and a factor"
        raise FdiError(told) from None


def level_words(name: str, levels: Mapping[str, float] | None) -> list[str]:
    """Levels of faults as the command line takes them."""
    pairs = _pairs(name, levels)
    try:
        return [f"{fault}={float(level)!r}" for fault, level in pairs]
    except (TypeError, ValueError):
        raise FdiError(f"`{name}` is {levels!r}, expected levels such as {{'k1': 0.1}}") from None


def words(options: Mapping[str, Any]) -> list[str]:
    """Options as words: ``None`` and ``False`` are left out, sequences are repeated."""
    made: list[str] = []
    for name, value in options.items():
        option = "--" + name.replace("_", "-")
        if value is None or value is False:
            continue
        if value is True:
            made.append(option)
        elif isinstance(value, (str, os.PathLike)) or not isinstance(value, Iterable):
            made.append(f"{option}={_word(value)}")
        else:
            made.extend(f"{option}={_word(one)}" for one in value)
    return made


def _word(value: Any) -> str:
    if isinstance(value, float):
        # numbers of numpy are floats that say more of themselves
        return repr(float(value))
    return os.fspath(value) if isinstance(value, os.PathLike) else str(value)


def everywhere(seed: int, jobs: int | None, *, stable: bool, form: str = "json") -> list[str]:
    """Options of all commands; each is given, so that no variable of the environment counts."""
    threads = os.cpu_count() or 1
    return words(
        {"seed": seed, "jobs": jobs or threads, "stable": stable, "output_format": form, "color": "never"}
    )
