"""A simulation of one's own is asked what it leaves out."""

from __future__ import annotations

import math
import random
import threading
import time
from typing import Any

import pytest

import fdi

RATE_HZ = 200.0


def pendulum(numbers: dict[str, float], command: list[float], load: Any, drive: Any) -> dict[str, Any]:
    """A pendulum under a position controller, as anybody would write it."""
    angle, speed, step_s = command[0], 0.0, 1 / RATE_HZ
    angles, torques = [], []
    for sample, wanted in enumerate(command):
        torque = drive(sample, 8.0 * (wanted - angle) - 0.4 * speed)
        angles.append(angle)
        torques.append(torque)
        own = numbers["drag"] * speed + numbers["weight"] * math.sin(angle)
        speed += step_s * (torque - own - load(sample, angle, speed)) / numbers["inertia"]
        angle += step_s * speed
    return {"angle": angles, "torque": torques}


def machine(command: list[float], seed: int, friction: float = 0.0, late: int = 0) -> dict[str, Any]:
    """The machine itself, with what the model does not know."""
    asked: list[float] = []

    def drive(sample: int, wanted: float) -> float:
        asked.append(wanted)
        return asked[max(0, sample - late)]

    def load(sample: int, angle: float, speed: float) -> float:
        # what stops the machine within a sample at most
        return max(-friction, min(friction, 0.5 * 0.02 * RATE_HZ * speed))

    numbers = {"inertia": 0.02, "drag": 0.02, "weight": 0.5}
    signals = pendulum(numbers, command, load, drive)
    noise = random.Random(seed)
    angle = [value + noise.gauss(0.0, 5e-4) for value in signals["angle"]]
    torque = [value + noise.gauss(0.0, 0.02) for value in signals["torque"]]
    return {"command": command, "angle": angle, "torque": torque}


def command(phase: float) -> list[float]:
    times = [n / RATE_HZ for n in range(1200)]
    return [0.8 * math.sin(1.3 * t + phase) + 0.3 * math.sin((4 + phase) * t) for t in times]


MODEL = fdi.OwnModel(
    pendulum,
    numbers={"inertia": 0.02, "drag": 0.02, "weight": fdi.Number(0.5, tolerance=0.02)},
    signals=["angle", "torque"],
    rate_hz=RATE_HZ,
)


def told(seed: int, **hidden: Any) -> fdi.Document:
    first, second, held = (machine(command(p), seed + n, **hidden) for n, p in enumerate((0.0, 1.0, 2.0)))
    return fdi.explain([first, second], holdout=[held], model=MODEL)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_model_that_is_right_is_adequate(seed: int) -> None:
    answer = told(seed)
    assert answer.verdict == "adequate"
    assert answer.causes == []


def test_hidden_friction_is_named_with_its_gain_held_out() -> None:
    begin = time.monotonic()
    answer = told(3, friction=0.05)
    assert time.monotonic() - begin < 60
    # the machine's friction and that of the catalogue differ where the machine comes to rest
    assert answer.verdict.startswith("named"), answer.sentence
    assert [cause["name"] for cause in answer.causes] == ["dry friction"]
    (size,) = answer.causes[0]["sizes"]
    assert size["key"] == "friction_n_m"
    assert abs(size["value"] - 0.05) < 0.003
    assert answer.holdout_gain_ratio > 0.2


def test_a_hidden_delay_is_named_with_its_gain_held_out() -> None:
    answer = told(4, late=2)
    assert answer.verdict == "named", answer.sentence
    (cause,) = answer.causes
    assert (cause["name"], cause["symbol"], cause["port"]) == ("drive delay", "E21", "drive")
    assert abs(cause["sizes"][0]["value"] - 2 / RATE_HZ) < 1e-3
    assert answer.holdout_gain_ratio > 0.2


def test_the_same_twice() -> None:
    assert told(5, friction=0.02).to_json() == told(5, friction=0.02).to_json()


def test_numbers_are_calibrated() -> None:
    train = [machine(command(0.5), 6), machine(command(1.5), 7)]
    wrong = fdi.OwnModel(
        pendulum,
        numbers={"inertia": 0.017, "drag": 0.03, "weight": 0.6},
        signals=["angle", "torque"],
        rate_hz=RATE_HZ,
    )
    numbers = {number["key"]: number for number in fdi.calibrate(train, model=wrong).numbers}
    for key, truth in {"inertia": 0.02, "drag": 0.02, "weight": 0.5}.items():
        number = numbers[key]
        assert abs(number["value"] - truth) < 4 * number["std"], number


def test_a_test_is_proposed() -> None:
    train = [machine([0.001 * n for n in range(800)], 8, friction=0.05)]
    commands = {"creep": [0.001 * n for n in range(800)], "there and back": command(0.3)}
    answer = fdi.propose(train, model=MODEL, commands=commands)
    assert answer.tests[0]["name"] == "there and back", answer.tests


def test_what_is_wrong_is_named() -> None:
    one = machine(command(0.0), 1)
    with pytest.raises(fdi.FdiError, match="train 0: no column `torque`: it has command, angle") as caught:
        fdi.explain({"command": one["command"], "angle": one["angle"]}, model=MODEL)
    assert caught.value.column == "torque"
    short = {**one, "angle": one["angle"][:-1]}
    with pytest.raises(fdi.FdiError, match="`angle` has 1199 samples, expected 1200"):
        fdi.explain(short, model=MODEL)

    def broken(numbers: dict[str, float], command: list[float], load: Any) -> dict[str, Any]:
        return {"angle": [1 / (numbers["drag"] - 0.02)]}

    failing = fdi.OwnModel(broken, numbers={"drag": 0.02}, signals="angle", rate_hz=RATE_HZ)
    with pytest.raises(fdi.FdiError, match="the model failed: ZeroDivisionError") as failed:
        fdi.explain(one, model=failing)
    assert isinstance(failed.value.__cause__, ZeroDivisionError)
    with pytest.raises(fdi.FdiError, match="`unit` has no meaning"):
        fdi.explain(one, model=MODEL, unit="unit.toml")


def test_ctrl_c_ends_it_within_a_second() -> None:
    import _thread
    import signal

    # whoever runs tests in the background has it ignored
    signal.signal(signal.SIGINT, signal.default_int_handler)
    train = [machine(command(0.0), 1, friction=0.05)]
    threading.Timer(0.3, _thread.interrupt_main).start()
    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        for _ in range(100):
            fdi.explain(train, model=MODEL)
    assert time.monotonic() - begin < 1.5
