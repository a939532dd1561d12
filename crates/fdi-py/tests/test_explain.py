"""What a model misses: documents of the command line, of files and of memory."""

from __future__ import annotations

import pickle
import subprocess
from pathlib import Path
from typing import Any

import pytest

import fdi

Recordings = dict[str, fdi.Recording]


@pytest.fixture(scope="module")
def model(root: Path) -> Path:
    return root / "fixtures" / "models" / "axis.toml"


@pytest.fixture(scope="module")
def recorded(root: Path, model: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Recordings of an axis with more friction than its data sheet says."""
    folder = tmp_path_factory.mktemp("axis")
    text = model.read_text().replace("kinetic-friction-n-m = 0.035", "kinetic-friction-n-m = 0.040")
    (folder / "real.toml").write_text(text)
    files = {}
    for seed, name in enumerate(["ramps", "stairs"]):
        command = root / "fixtures" / "commands" / f"axis-{name}.csv"
        read = fdi.simulate(model=folder / "real.toml", command=command, noise_a=0.02, seed=seed)
        files[name] = folder / f"{name}.csv"
        read.to_csv(files[name], value_decimals=24)
    return files


def _cli(cli: list[str], *words: str) -> str:
    command = [*cli, *words, "--stable", "--output-format", "json"]
    return subprocess.run(command, capture_output=True, check=True).stdout.decode()


def test_calibrated_numbers_are_the_command_lines(
    cli: list[str], model: Path, recorded: dict[str, Path], tmp_path: Path
) -> None:
    given: dict[str, Any] = {"model": model, "stable": True}
    found = fdi.calibrate(recorded["ramps"], holdout=[recorded["stairs"]], **given)
    words = ["--model", str(model), "--train", str(recorded["ramps"])]
    extended = tmp_path / "cli.toml"
    words += ["--holdout", str(recorded["stairs"]), "--output", str(extended)]
    assert found.to_json() == _cli(cli, "calibrate", *words)
    assert found.extended == extended.read_text()
    found.save(tmp_path / "here.toml")
    assert (tmp_path / "here.toml").read_text() == found.extended
    again = pickle.loads(pickle.dumps(found))
    assert again.to_json() == found.to_json() and again["parameters"] == found.parameters
    # recordings in memory are those of the files
    memory = {name: fdi.Recording.read(file) for name, file in recorded.items()}
    of_memory = fdi.calibrate(memory["ramps"], holdout=memory["stairs"], **given)
    assert of_memory.parameters == found.parameters
    # an anti-test: other recordings have other numbers
    other = fdi.calibrate(recorded["stairs"], **given)
    assert other.parameters != found.parameters
    with pytest.raises(AttributeError, match="has no `verdict`"):
        found.verdict


def test_an_explanation_is_the_command_lines(
    cli: list[str], model: Path, recorded: dict[str, Path], tmp_path: Path
) -> None:
    files = {"train": recorded["ramps"], "holdout": recorded["stairs"]}
    without = [f"E{number:02}" for number in range(3, 60)]
    known = {effect["id"] for effect in _effects()}
    without = [effect for effect in without if effect in known]
    page = tmp_path / "page.html"
    found = fdi.explain(**files, model=model, without=without, stable=True, report=page)
    words = [word for name, file in files.items() for word in (f"--{name}", str(file))]
    words += ["--model", str(model), "--without", *without, "--output", str(tmp_path / "cli.toml")]
    assert found.to_json() == _cli(cli, "explain", *words)
    assert found.extended == (tmp_path / "cli.toml").read_text()
    assert found.sentence in found._repr_html_() or "&" in found._repr_html_()
    assert page.read_text().startswith("<!")


def _effects() -> list[dict[str, Any]]:
    import json

    from fdi._artefacts import run
    from fdi._words import everywhere

    listed: list[dict[str, Any]] = json.loads(run("effects", everywhere(0, 1, stable=True))[1])["effects"]
    return listed


def test_proposals_and_errors(model: Path, recorded: dict[str, Path], tmp_path: Path) -> None:
    with pytest.raises(fdi.FdiError, match="none.csv"):
        fdi.propose(tmp_path / "none.csv", model=model)
    with pytest.raises(fdi.FdiError, match="model"):
        fdi.explain(recorded["ramps"], model=tmp_path / "none.toml")
    with pytest.raises(fdi.FdiError, match="without"):
        fdi.explain(recorded["ramps"], model=model, without=["E99"])
