"""Arguments as words of the command line, whose parser checks them."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import Any, Union

#: Which columns are which channels: ``{"current_a": "i_motor"}``, with a factor
#: ``{"current_a": ("i_motor", 0.001)}``.
Columns = Mapping[str, Union[str, tuple[str, float]]]


def column_words(columns: Columns | None) -> list[str]:
    """Columns as the command line maps them."""
    return [
        f"{channel}={column}" if isinstance(column, str) else f"{channel}={column[0]}*{column[1]!r}"
        for channel, column in (columns or {}).items()
    ]


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
        return repr(value)
    return os.fspath(value) if isinstance(value, os.PathLike) else str(value)


def everywhere(seed: int, jobs: int | None, *, stable: bool, form: str = "json") -> list[str]:
    """Options of all commands; each is given, so that no variable of the environment counts."""
    threads = os.cpu_count() or 1
    return words(
        {"seed": seed, "jobs": jobs or threads, "stable": stable, "output_format": form, "color": "never"}
    )
