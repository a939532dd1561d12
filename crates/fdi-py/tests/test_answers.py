"""Answers are those of the command line, wherever the recording comes from."""

from __future__ import annotations

import json
import pickle
import subprocess
from pathlib import Path

import numpy as np
import pytest

import fdi

NAMES = ["r01.csv.gz", "r04.csv.gz", "r12.csv.gz"]
OPTIONS = {"tolerance": "none", "stable": True}
WORDS = ["--tolerance", "none", "--stable"]


def _cli(cli: list[str], root: Path, *words: str) -> str:
    command = [*cli, "diagnose", *WORDS, *words]
    done = subprocess.run(command, capture_output=True, cwd=root, check=False)
    return done.stdout.decode()


def _files(recordings: Path) -> list[str]:
    return [str(recordings / name) for name in NAMES]


def _without_name(answer: dict[str, object]) -> dict[str, object]:
    return {key: value for key, value in answer.items() if key != "recording"}


def _columns(recording: fdi.Recording) -> dict[str, object]:
    names = recording.channels
    return {"time_s": recording.times(names[0]), **{name: recording[name] for name in names}}


def test_the_document_is_the_command_lines_bit_for_bit(
    cli: list[str], root: Path, recordings: Path
) -> None:
    files = _files(recordings)
    table = fdi.diagnose(files, **OPTIONS)
    assert table.to_json() == _cli(cli, root, "--output-format", "json", *files)
    assert table.to_csv() == _cli(cli, root, "--output-format", "csv", *files)


def test_within_tolerances_too(cli: list[str], root: Path, recordings: Path) -> None:
    file = str(recordings / "r12.csv.gz")
    command = [*cli, "diagnose", "--stable", "--output-format", "json", file]
    told = subprocess.run(command, capture_output=True, cwd=root, check=True).stdout.decode()
    assert fdi.diagnose(file, stable=True).to_json() == told


def test_decisions_are_the_command_lines(cli: list[str], root: Path, recordings: Path) -> None:
    files = _files(recordings)
    words = ["--decide", "--watch", "k1=0.05,k4=0.03", "--act", "k4=0.04", "--output-format", "json"]
    levels = {"watch": {"k1": 0.05, "k4": 0.03}, "act": {"k4": 0.04}}
    table = fdi.diagnose(files, decide=True, **levels, **OPTIONS)
    assert table.to_json() == _cli(cli, root, *words, *files)
    assert table["r12.csv.gz"]["action"]["severity"] == "act"
    assert table.to_dict()["action_severity"] == [one["action"]["severity"] for one in table]
    assert fdi.diagnose(files, **OPTIONS).to_dict()["action_severity"] == [None] * len(files)


def test_a_folder_and_what_cannot_be_read(
    cli: list[str], root: Path, recordings: Path, tmp_path: Path
) -> None:
    (tmp_path / "bad.csv").write_text("time_s,current_a\n0,x\n")
    (tmp_path / "good.csv.gz").write_bytes((recordings / "r23.csv.gz").read_bytes())
    table = fdi.diagnose(tmp_path, **OPTIONS)
    assert table.to_json() == _cli(cli, root, "--output-format", "json", str(tmp_path))
    assert [answer["recording"] for answer in table.failed] == [str(tmp_path / "bad.csv")]
    with pytest.raises(fdi.FdiError) as told:
        fdi.diagnose(tmp_path, on_error="raise", **OPTIONS)
    assert told.value.file == str(tmp_path / "bad.csv")
    assert told.value.column == "current_a"
    assert "line 2" in str(told.value)


@pytest.mark.parametrize("name", NAMES)
def test_arrays_give_the_answer_of_their_file(recordings: Path, name: str) -> None:
    file = fdi.diagnose(recordings / name, **OPTIONS)[0]
    recording = fdi.Recording.read(recordings / name)
    metadata = {key: value for key, value in recording.metadata.items()}
    of_arrays = fdi.diagnose(_columns(recording), metadata=metadata, **OPTIONS)[0]
    assert _without_name(of_arrays) == _without_name(file)
    in_memory = fdi.diagnose(recording, **OPTIONS)[0]
    assert in_memory == file
    # an anti-test: another recording has another answer
    changed = dict(_columns(recording))
    changed["phase_a_current_a"] = 1.01 * np.asarray(changed["phase_a_current_a"])
    other = fdi.diagnose(changed, metadata=metadata, **OPTIONS)[0]
    assert _without_name(other) != _without_name(file)


def test_bytes_of_files_give_the_answer_of_the_file(recordings: Path) -> None:
    file = recordings / "r12.csv.gz"
    table = {"path": [f"file:{file}"], "content": [file.read_bytes()]}
    assert fdi.diagnose(table, **OPTIONS)[0] == fdi.diagnose(file, **OPTIONS)[0]
    assert fdi.diagnose({"path": [str(file)]}, **OPTIONS)[0] == fdi.diagnose(file, **OPTIONS)[0]


def test_answers_do_not_depend_on_threads_but_on_the_seed(recordings: Path) -> None:
    files = _files(recordings)
    options = {**OPTIONS, "method": "two-step-ei"}
    one = fdi.diagnose(files, jobs=1, **options)
    assert one.to_json() == fdi.diagnose(files, jobs=3, **options).to_json()
    other = fdi.diagnose(files, seed=7, **options)
    assert [r["faults"] for r in other.records] != [r["faults"] for r in one.records]


def test_pickles_and_pages(recordings: Path, tmp_path: Path) -> None:
    table = fdi.diagnose(recordings / "r12.csv.gz", **OPTIONS)
    again = pickle.loads(pickle.dumps(table))
    assert again.to_json() == table.to_json()
    assert table.figure(0).startswith("<svg")
    assert "faulty" in table._repr_html_()
    page = table.to_html(tmp_path / "page.html")
    assert page.startswith("<!") and (tmp_path / "page.html").read_text() == page
    assert json.loads(table.to_json())["records"] == table.records


def test_simulated_recordings(cli: list[str], root: Path, tmp_path: Path) -> None:
    recording = fdi.simulate(faults={"k1": 0.02}, noise_a=0.02, adc_bits=12, seed=3)
    words = ["simulate", "--faults", "k1=0.02", "--noise-a", "0.02", "--adc-bits", "12"]
    file = tmp_path / "r.csv"
    subprocess.run([*cli, *words, "--seed", "3", "-o", str(file)], check=True, cwd=root)
    on_disk = fdi.Recording.read(file)
    assert on_disk.channels == recording.channels
    for channel in recording.channels:
        assert np.allclose(on_disk[channel], recording[channel], atol=1e-5)
    again = pickle.loads(pickle.dumps(recording))
    assert all(np.array_equal(again[name], recording[name]) for name in recording.channels)
    other = fdi.simulate(faults={"k1": 0.02}, noise_a=0.02, adc_bits=12, seed=4)
    assert not np.array_equal(other["phase_a_current_a"], recording["phase_a_current_a"])
    found = fdi.diagnose(recording, **OPTIONS)[0]["faults"][0]
    assert found["detected"] and abs(found["value"] - 0.02) < 5 * found["std"]


def test_bundles_travel(recordings: Path, root: Path, tmp_path: Path) -> None:
    bundle = fdi.Bundle.load(root / "crates/fdi-core/bundles/chirp.fdi-bundle")
    assert bundle.summary["command"] == "chirp"
    again = pickle.loads(pickle.dumps(bundle))
    assert again.summary == bundle.summary
    file = recordings / "r04.csv.gz"
    named = fdi.diagnose(file, bundle=again, **OPTIONS)
    assert named[0]["faults"] == fdi.diagnose(file, **OPTIONS)[0]["faults"]
    with pytest.raises(fdi.FdiError) as told:
        fdi.Bundle.load(tmp_path / "none.fdib")
    assert told.value.file == str(tmp_path / "none.fdib")
