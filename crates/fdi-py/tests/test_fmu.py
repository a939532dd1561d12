"""An FMU is asked what it leaves out."""

from __future__ import annotations

import math
import random
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import pytest

import fdi

HERE = Path(__file__).parent / "fmu"
RATE_HZ = 200.0


@pytest.fixture(scope="module")
def pendulum(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The pendulum of this folder, compiled."""
    pytest.importorskip("fmpy")
    compiler = shutil.which("cc")
    if compiler is None or not sys.platform.startswith("linux"):
        pytest.skip("no C compiler on Linux to make an FMU with")
    folder = tmp_path_factory.mktemp("fmu")
    library = folder / "pendulum.so"
    source = HERE / "pendulum.c"
    subprocess.run([compiler, "-shared", "-fPIC", "-O2", source, "-lm", "-o", library], check=True)
    with zipfile.ZipFile(folder / "pendulum.fmu", "w") as archive:
        archive.write(HERE / "modelDescription.xml", "modelDescription.xml")
        archive.write(library, "binaries/linux64/pendulum.so")
    return folder / "pendulum.fmu"


def model(file: Path) -> fdi.OwnModel:
    return fdi.fmu(
        file,
        numbers=["inertia", "drag"],
        signals=["angle", "torque"],
        rate_hz=RATE_HZ,
        command="command",
        load="load",
        position="angle",
        speed="speed",
    )


def recorded(file: Path, seed: int, inertia: float = 0.02, friction: float = 0.0) -> dict[str, Any]:
    times = [n / RATE_HZ for n in range(800)]
    command = [0.8 * math.sin(1.3 * t + seed) + 0.3 * math.sin(5 * t) for t in times]

    def load(sample: int, angle: float, speed: float) -> float:
        return friction * math.tanh(speed / 0.02)

    made = model(file).run({"inertia": inertia, "drag": 0.02}, command, load)
    noise = random.Random(seed)
    angle = [value + noise.gauss(0.0, 5e-4) for value in made["angle"]]
    torque = [value + noise.gauss(0.0, 0.02) for value in made["torque"]]
    return {"command": command, "angle": angle, "torque": torque}


def test_an_fmu_that_is_right_is_adequate(pendulum: Path) -> None:
    answer = fdi.explain(recorded(pendulum, 1), model=model(pendulum))
    assert answer.verdict == "adequate", answer.sentence


def test_a_changed_number_is_named(pendulum: Path) -> None:
    changed = [recorded(pendulum, seed, inertia=0.023) for seed in (1, 2)]
    answer = fdi.explain(changed[:1], holdout=changed[1:], model=model(pendulum))
    assert answer.verdict == "named", answer.sentence
    (cause,) = answer.causes
    assert cause["name"] == "number inertia"
    assert abs(cause["sizes"][0]["value"] - 0.023) < 2e-4
    assert answer.holdout_gain_ratio > 0.2


def test_friction_at_its_port_is_named(pendulum: Path) -> None:
    rubbing = [recorded(pendulum, seed, friction=0.05) for seed in (3, 4)]
    answer = fdi.explain(rubbing[:1], holdout=rubbing[1:], model=model(pendulum))
    assert answer.verdict.startswith("named"), answer.sentence
    assert answer.causes[0]["name"] == "dry friction"
    assert abs(answer.causes[0]["sizes"][0]["value"] - 0.05) < 0.003


def test_what_is_wrong_is_named(pendulum: Path) -> None:
    with pytest.raises(fdi.FdiError, match="no variable `mass`"):
        fdi.fmu(pendulum, numbers=["mass"], signals=["angle"], rate_hz=RATE_HZ)
    with pytest.raises(fdi.FdiError, match="the port `load` needs `position`, `speed` too"):
        fdi.fmu(pendulum, numbers=[], signals=["angle"], rate_hz=RATE_HZ, load="load")
    with pytest.raises(fdi.FdiError, match="cannot be read as an FMU"):
        fdi.fmu(HERE / "pendulum.c", numbers=[], signals=["angle"], rate_hz=RATE_HZ)
