"""A co-simulation FMU in place of a model file, through FMPy."""

from __future__ import annotations

import os
import shutil
import weakref
from collections.abc import Iterable, Mapping
from typing import Any

from ._error import FdiError
from ._own_model import Number, OwnModel


def fmu(
    path: str | os.PathLike[str],
    *,
    numbers: Mapping[str, float | Number] | Iterable[str],
    signals: Iterable[str],
    rate_hz: float,
    command: str | None = None,
    load: str | None = None,
    position: str | None = None,
    speed: str | None = None,
    linear: bool = False,
) -> OwnModel:
    """A co-simulation FMU (2.0 or 3.0) as a model of one's own.

    ``numbers`` are names of its parameters or of start values that may be set, with what is known of
    them; of names alone the values are those of the file. ``signals`` are the variables that
    recordings hold, and ``command`` the input that they hold too, if there is one. ``load`` is the
    input for a torque, or force, against positive motion, and ``position`` and ``speed`` the variables by which
    causes there are told apart: with all three the model has the port ``load``.

    Inputs are held over each step of ``1/rate_hz``. Needs ``pip install fmpy``.
    """
    try:
        import fmpy
    except ImportError as error:
        message = "an FMU needs FMPy"
        raise FdiError(message, file=os.fspath(path), remedy="pip install fmpy") from error
    file = os.fspath(path)
    if isinstance(signals, str):
        signals = [signals]
    if isinstance(numbers, str):
        numbers = [numbers]
    if not float(rate_hz) > 0:
        raise FdiError(f"`rate_hz` is {rate_hz}, expected more than 0", file=file)
    unit = _Unit(fmpy, file)
    wanted = numbers if isinstance(numbers, Mapping) else {name: unit.start(name) for name in numbers}
    ports = {"load": load, "position": position, "speed": speed}
    given = [name for name, variable in ports.items() if variable is not None]
    if given and len(given) < 3:
        missing = ", ".join(f"`{name}`" for name in ports if name not in given)
        raise FdiError(f"the port `load` needs {missing} too", file=file)
    signals = list(signals)
    for name in [*wanted, *signals, *(v for v in (command, *ports.values()) if v is not None)]:
        unit.reference(name)
    step_s = 1.0 / float(rate_hz)

    def run(numbers: dict[str, float], command_values: list[float], port: Any) -> Mapping[str, Any]:
        made: dict[str, list[float]] = {name: [] for name in signals}
        with unit.started(numbers) as slave:
            for sample, value in enumerate(command_values):
                if command is not None:
                    slave.set(command, value)
                if load is not None and position is not None and speed is not None:
                    slave.set(load, port(sample, slave.get(position), slave.get(speed)))
                for name, values in made.items():
                    values.append(slave.get(name))
                slave.step(sample * step_s, step_s)
        return made

    def alone(numbers: dict[str, float], command: list[float]) -> Mapping[str, Any]:
        return run(numbers, command, None)

    def loaded(numbers: dict[str, float], command: list[float], load: Any) -> Mapping[str, Any]:
        return run(numbers, command, load)

    return OwnModel(
        alone if load is None else loaded,
        numbers=wanted,
        signals=signals,
        rate_hz=rate_hz,
        command=command,
        linear=linear,
        name=unit.name,
    )


class _Unit:
    """An unpacked FMU."""

    def __init__(self, fmpy: Any, file: str) -> None:
        try:
            self._description = fmpy.read_model_description(file)
            self._folder = fmpy.extract(file)
        except Exception as error:
            raise FdiError(f"cannot be read as an FMU: {error}", file=file) from error
        self._fmpy = fmpy
        self.file = file
        self.name = str(self._description.modelName)
        self._variables = {variable.name: variable for variable in self._description.modelVariables}
        weakref.finalize(self, shutil.rmtree, self._folder, ignore_errors=True)
        if self._description.coSimulation is None:
            raise FdiError("is an FMU for model exchange alone", file=file, remedy="export co-simulation")

    def reference(self, name: str) -> int:
        variable = self._variables.get(name)
        if variable is None:
            near = ", ".join(sorted(self._variables)[:20])
            raise FdiError(f"no variable `{name}`: it has {near}", file=self.file, column=name)
        return int(variable.valueReference)

    def start(self, name: str) -> float:
        self.reference(name)
        start = self._variables[name].start
        if start is None:
            message = f"variable `{name}` has no start value"
            raise FdiError(message, file=self.file, column=name, remedy="give its value")
        return float(start)

    def started(self, numbers: Mapping[str, float]) -> _Slave:
        return _Slave(self, numbers)

    def instance(self) -> Any:
        """A new instance."""
        from fmpy.fmi2 import FMU2Slave
        from fmpy.fmi3 import FMU3Slave

        description = self._description
        kind = FMU2Slave if description.fmiVersion.startswith("2") else FMU3Slave
        return kind(
            guid=description.guid,
            unzipDirectory=self._folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="fdi",
        )


class _Slave:
    """An instance of an FMU in one run."""

    def __init__(self, unit: _Unit, numbers: Mapping[str, float]) -> None:
        self._unit = unit
        self._numbers = numbers

    def __enter__(self) -> _Slave:
        self._slave = self._unit.instance()
        self._slave.instantiate()
        is_old = hasattr(self._slave, "setupExperiment")
        if is_old:
            self._slave.setupExperiment(startTime=0.0)
            self._slave.enterInitializationMode()
        else:
            self._slave.enterInitializationMode(startTime=0.0)
        self._get = self._slave.getReal if is_old else self._slave.getFloat64
        self._set = self._slave.setReal if is_old else self._slave.setFloat64
        for name, value in self._numbers.items():
            self.set(name, value)
        self._slave.exitInitializationMode()
        return self

    def __exit__(self, *_: object) -> None:
        self._slave.terminate()
        self._slave.freeInstance()

    def get(self, name: str) -> float:
        return float(self._get([self._unit.reference(name)])[0])

    def set(self, name: str, value: float) -> None:
        self._set([self._unit.reference(name)], [value])

    def step(self, time_s: float, step_s: float) -> None:
        self._slave.doStep(currentCommunicationPoint=time_s, communicationStepSize=step_s)
