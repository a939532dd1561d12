"""The one error of this package."""

from __future__ import annotations

import re


class FdiError(ValueError):
    """Why something could not be done.

    ``file`` is the file or recording, ``column`` the column of it, ``remedy`` what helps, each where
    it is known.
    """

    file: str | None
    column: str | None
    remedy: str | None

    def __init__(
        self,
        message: str,
        *,
        file: str | None = None,
        column: str | None = None,
        remedy: str | None = None,
    ) -> None:
        told = message if file is None or message.startswith(file) else f"{file}: {message}"
        super().__init__(_in_python(told))
        self.file = file
        self.column = column if column is not None else _column_of(message)
        self.remedy = remedy if remedy is not None else _remedy_of(_in_python(message))

    def __reduce__(self) -> tuple[object, ...]:
        return (_again, (str(self), self.file, self.column, self.remedy))


def _again(
    message: str, file: str | None, column: str | None, remedy: str | None
) -> FdiError:
    error = FdiError(message, column=column, remedy=remedy)
    error.file = file
    return error


def _in_python(message: str) -> str:
    """Names arguments where the command line names its options."""
    message = re.sub(r"`--map (\w+)=COLUMN`", r'`columns={"\1": "COLUMN"}`', message)
    message = message.replace("`--map NAME=COLUMN`", '`columns={"NAME": "COLUMN"}`')
    message = message.replace("`--map`", "`columns`")
    return re.sub(r"`--([a-z][a-z-]*)`", lambda m: f"`{m[1].replace('-', '_')}`", message)


def _column_of(message: str) -> str | None:
    """The column that a message is about: the one that it names first."""
    named = re.search(r"(?:columns?|channel|of) `([^`]+)`", message)
    if named is None:
        named = re.match(r"`(\w+_(?:a|s|v|m|n|k|rad|frac|n_m|m_per_s|rad_per_s|state))`", message)
    return None if named is None else named[1]


def _remedy_of(message: str) -> str | None:
    """What a message says to do."""
    for form in (r"\((`?columns=[^)]*)\)", r"; (did you mean .*)$", r"(expected .*)$"):
        found = re.search(form, message)
        if found is not None:
            return found[1].strip()
    return None
