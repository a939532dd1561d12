"""A simulation of one's own in place of a model file."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from math import inf
from typing import Any, Protocol

from . import _fdi
from ._error import FdiError

#: Ports that a callable declares by having parameters of these names.
PORTS = ("load", "drive", "sensor")


class Columns(Protocol):
    """A recording for a model of one's own: columns by name, as of a mapping or a frame."""

    def __getitem__(self, name: str, /) -> Any: ...


@dataclass(frozen=True)
class Number:
    """A number of a model.

    ``tolerance`` is the standard deviation of what is known of it beforehand; without one the value
    is taken for exact, and another value is a cause to be named. ``scale`` is the standard deviation
    of the change that is expected where it is wrong, by default half of the value.
    """

    value: float
    tolerance: float | None = None
    scale: float | None = None
    least: float = -inf
    most: float = inf


class OwnModel:
    """A simulation that you wrote, or one that you call.

    ``run(numbers, command, …)`` is given the numbers as a dictionary and the command as a list with
    one value each ``1/rate_hz`` seconds, and returns a mapping from the names of ``signals`` to
    sequences as long as the command. It has to give the same for the same.

    Causes enter where it asks, by the parameters that it has besides those two:

    ``load(sample, position, speed)``
        the torque, or force, against positive motion: add it to the machine's own load;
    ``drive(sample, asked)``
        what the drive makes of what the controller asks for;
    ``sensor(sample, position)``
        the position that the controller sees.

    ``samples`` count from zero. Ask once a sample, and hold the answer over the steps within it: a
    stage of an integrator may ask again, but dry friction then knows the last answer alone.

    ``command`` and ``load`` name the columns of recordings; without ``load`` no load is known, and
    without ``command`` the model is told zeros.
    ``linear`` says that positions are metres and torques newtons.
    """

    def __init__(
        self,
        run: Callable[..., Mapping[str, Any]],
        *,
        numbers: Mapping[str, float | Number],
        signals: Iterable[str],
        rate_hz: float,
        command: str | None = "command",
        load: str | None = None,
        linear: bool = False,
        name: str | None = None,
    ) -> None:
        if not callable(run):
            raise FdiError(f"a model has to be callable, and {type(run).__name__} is not")
        if isinstance(signals, str):
            signals = [signals]
        self.run = run
        try:
            self.numbers = {
                key: given if isinstance(given, Number) else Number(float(given))
                for key, given in numbers.items()
            }
            self.rate_hz = float(rate_hz)
        except (AttributeError, TypeError, ValueError) as error:
            message = f"`numbers` is a mapping from names to numbers, `rate_hz` a number: {error}"
            raise FdiError(message) from error
        self.signals = list(signals)
        self.command = command
        self.load = load
        self.linear = linear
        self.name = name or str(getattr(run, "__name__", type(run).__name__))
        self.ports = _ports(run)
        if not self.signals:
            raise FdiError("a model needs at least one signal to compare", remedy="name its signals")
        if not 0 < self.rate_hz < inf:
            raise FdiError(f"`rate_hz` is {rate_hz}, expected more than 0")
        if load is not None and "load" not in self.ports:
            raise FdiError(f"`load` names a column, and {self.name} has no parameter `load`")

    def __repr__(self) -> str:
        ports = ", ".join(self.ports) or "none"
        return f"<fdi.OwnModel {self.name}: numbers {', '.join(self.numbers)}; ports {ports}>"


def _ports(run: Callable[..., Any]) -> list[str]:
    """The ports that a callable declares."""
    try:
        names = list(inspect.signature(run).parameters)
    except (TypeError, ValueError):
        names = []
    return [port for port in PORTS if port in names[2:]]


def of_own_model(
    task: str,
    model: OwnModel,
    train: Any,
    holdout: Any = (),
    tests: Mapping[str, Any] | None = None,
) -> str:
    """The document of a task with a model of one's own."""
    numbers = [
        (key, n.value, n.tolerance, n.scale, n.least, n.most) for key, n in model.numbers.items()
    ]
    given = {
        "run": model.run,
        "name": model.name,
        "numbers": numbers,
        "signals": model.signals,
        "linear": model.linear,
        "rate_hz": model.rate_hz,
        "ports": model.ports,
    }
    records = {
        "train": _records(model, train, "train"),
        "holdout": _records(model, holdout, "holdout"),
        "tests": [(name, _values(command, name), []) for name, command in (tests or {}).items()],
    }
    return _fdi.of_own_model(task, given, records)


def _records(model: OwnModel, recordings: Any, role: str) -> list[Any]:
    if hasattr(recordings, "keys") or hasattr(recordings, "columns"):
        recordings = [recordings]
    if recordings is None or isinstance(recordings, (str, bytes)):
        message = f"`{role}` is no table: expected one or several with the columns of the model"
        raise FdiError(message)
    return [_record(model, one, f"{role} {place}") for place, one in enumerate(recordings)]


def _record(model: OwnModel, one: Columns, name: str) -> Any:
    signals = [_column(one, signal, name) for signal in model.signals]
    command = [0.0] * len(signals[0]) if model.command is None else _column(one, model.command, name)
    load = [] if model.load is None else _column(one, model.load, name)
    return (name, command, load), signals


def _column(one: Columns, column: str, name: str) -> list[float]:
    try:
        values = one[column]
    except (KeyError, IndexError, TypeError, ValueError) as error:
        has = ", ".join(map(str, getattr(one, "keys", lambda: [])()))
        found = f": it has {has}" if has else ""
        message = f"no column `{column}`{found}"
        raise FdiError(message, file=name, column=column) from error
    return _values(values, name, column)


def _values(values: Any, name: str, column: str = "command") -> list[float]:
    """Numbers of anything that has them."""
    for way in ("tolist", "to_list", "to_pylist"):
        if hasattr(values, way):
            values = getattr(values, way)()
            break
    try:
        return [float(value) for value in values]
    except (TypeError, ValueError) as error:
        message = f"`{column}` holds what is no number: {error}"
        raise FdiError(message, file=name, column=column) from error
