"""Tables of every kind, in and out; what is wrong with one is said with the column's name."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fdi

OPTIONS: dict[str, Any] = {"tolerance": "none", "stable": True}


@pytest.fixture(scope="module")
def recording() -> fdi.Recording:
    return fdi.simulate(faults={"k1": 0.02}, noise_a=0.02, seed=1)


@pytest.fixture(scope="module")
def columns(recording: fdi.Recording) -> dict[str, Any]:
    names = recording.channels
    return {"time_s": recording.times(names[0]), **{name: recording[name] for name in names}}


@pytest.fixture(scope="module")
def metadata(recording: fdi.Recording) -> dict[str, Any]:
    return dict(recording.metadata)


@pytest.fixture(scope="module")
def expected(columns: dict[str, Any], metadata: dict[str, Any]) -> dict[str, Any]:
    return _faults(fdi.diagnose(columns, metadata=metadata, **OPTIONS)[0])


def _faults(answer: dict[str, Any]) -> dict[str, Any]:
    assert "faults" in answer, answer
    return {fault["id"]: (fault["value"], fault["std"]) for fault in answer["faults"]}


def test_arrays_are_not_copied(columns: dict[str, Any]) -> None:
    recording = fdi.Recording(columns)
    for name in recording.channels:
        place = columns[name].__array_interface__["data"][0]
        assert recording[name].__array_interface__["data"][0] == place
        times = columns["time_s"].__array_interface__["data"][0]
        assert recording.times(name).__array_interface__["data"][0] == times


def test_arrow_columns_are_not_copied(columns: dict[str, Any]) -> None:
    pa = pytest.importorskip("pyarrow")
    table = pa.table(columns)
    recording = fdi.Recording(table)
    for name in recording.channels:
        place = table[name].chunk(0).buffers()[1].address
        assert recording[name].__array_interface__["data"][0] == place


def test_an_array_outlives_its_name() -> None:
    values = np.linspace(0.0, 1.0, 1000)
    recording = fdi.Recording({"time_s": np.arange(1000) / 1e4, "current_a": values})
    copy = values.copy()
    del values
    junk = [np.zeros(1000) for _ in range(100)]
    assert np.array_equal(recording["current_a"], copy) and len(junk) == 100


@pytest.mark.parametrize("library", ["pandas", "polars", "pyarrow", "duckdb"])
def test_frames_give_one_answer(
    library: str, columns: dict[str, Any], metadata: dict[str, Any], expected: dict[str, Any]
) -> None:
    frame = _frame(library, columns)
    answer = fdi.diagnose(frame, metadata=metadata, **OPTIONS)[0]
    assert _faults(answer) == expected


def _frame(library: str, columns: dict[str, Any]) -> Any:
    module = pytest.importorskip(library)
    if library == "pandas":
        return module.DataFrame(columns)
    if library == "polars":
        return module.DataFrame(columns)
    if library == "pyarrow":
        return module.table(columns)
    table = pytest.importorskip("pyarrow").table(columns)
    return module.from_arrow(table).order("time_s")


@pytest.mark.parametrize("library", ["pandas", "polars", "pyarrow"])
def test_long_tables_are_grouped(
    library: str, columns: dict[str, Any], metadata: dict[str, Any], expected: dict[str, Any]
) -> None:
    twice = {name: np.concatenate([values, values]) for name, values in columns.items()}
    count = len(columns["time_s"])
    twice["who"] = np.repeat(np.array(["a", "b"], dtype=object), count)
    shuffled = np.argsort(np.tile(np.arange(count), 2), kind="stable")
    mixed = {name: values[shuffled] for name, values in twice.items()}
    for table in [twice, mixed]:
        frame = _frame(library, table)
        answers = fdi.diagnose(frame, group="who", metadata=metadata, **OPTIONS)
        assert [answer["recording"] for answer in answers] == ["a", "b"]
        assert all(_faults(answer) == expected for answer in answers)


@pytest.mark.parametrize("library", ["pandas", "polars", "pyarrow"])
def test_lists_are_a_recording_a_row(
    library: str, columns: dict[str, Any], metadata: dict[str, Any], expected: dict[str, Any]
) -> None:
    rows: dict[str, Any] = {name: [values.tolist()] * 2 for name, values in columns.items()}
    rows["recording"] = ["first", "second"]
    rows["start_angle_rad"] = [float(metadata.get("start-angle-rad", 0.0))] * 2
    module = pytest.importorskip(library)
    make = module.table if library == "pyarrow" else module.DataFrame
    rest = {key: value for key, value in metadata.items() if key != "start-angle-rad"}
    answers = fdi.diagnose(make(rows), metadata=rest, **OPTIONS)
    assert [answer["recording"] for answer in answers] == ["first", "second"]
    assert all(_faults(answer) == expected for answer in answers)


def test_what_comes_out_goes_everywhere(recordings: Path) -> None:
    table = fdi.diagnose([recordings / "r23.csv.gz", "none.csv"], **OPTIONS)
    names = list(table.to_dict())
    polars = pytest.importorskip("polars")
    assert polars.DataFrame(table).columns == names
    assert list(table.to_pandas().columns) == names
    pa = pytest.importorskip("pyarrow")
    arrow = pa.table(table)
    assert arrow.column_names == names and arrow["status"].to_pylist() == ["ok", "failed"]
    assert arrow.to_pydict() == table.to_dict()
    duckdb = pytest.importorskip("duckdb")
    assert duckdb.sql("select count(*) from arrow where status = 'failed'").fetchall() == [(1,)]
    parquet = pytest.importorskip("pyarrow.parquet")
    assert parquet.read_table(pa.BufferReader(table.to_parquet())).to_pydict() == table.to_dict()


def test_polars_needs_no_pyarrow(tmp_path: Path) -> None:
    pytest.importorskip("polars")
    (tmp_path / "pyarrow.py").write_text("raise ImportError('not here')\n")
    program = """
import numpy as np, polars, fdi
frame = polars.DataFrame({"t": np.arange(2000) / 1e4, "i": np.sin(np.arange(2000) / 50.0)})
table = fdi.diagnose(frame, columns={"time_s": "t", "current_a": "i"}, tolerance="none")
print(polars.DataFrame(table)["status"].to_list(), fdi.diagnose({"path": ["x.csv"]})[0]["error"])
"""
    command = [sys.executable, "-c", program]
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    environment = {"PYTHONPATH": path, "PATH": ""}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert "no such file" in done.stdout, done.stderr


@pytest.mark.parametrize("change", ["float32", "strided", "list", "object", "reversed", "int-time"])
def test_other_numbers_are_converted(change: str) -> None:
    times, values = np.arange(100) / 1e4, np.sin(np.arange(100) / 7.0)
    table: dict[str, Any] = {"time_s": times, "current_a": values}
    wide = np.zeros((100, 2))
    wide[:, 1] = values
    table["current_a"] = {
        "float32": values.astype("f4"),
        "strided": wide[:, 1],
        "list": values.tolist(),
        "object": values.astype(object),
        "reversed": values[::-1].copy()[::-1],
        "int-time": values,
    }[change]
    read = fdi.Recording(table)["current_a"]
    assert np.array_equal(read, values.astype("f4").astype("f8") if change == "float32" else values)


def test_points_in_time_and_gaps() -> None:
    when = np.datetime64("2026-11-21T09:30:00") + np.arange(50) * np.timedelta64(100, "us")
    values = [None if place == 7 else float(place) for place in range(50)]
    read = fdi.Recording({"time_s": when, "current_a": values})
    assert len(read["current_a"]) == 49 and abs(read.times("current_a")[-1] - 49e-4) < 1e-12
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({"time_s": when, "current_a": [np.nan, *range(1, 50)]})
    assert len(fdi.Recording(frame)["current_a"]) == 49


def test_columns_are_renamed_and_multiplied() -> None:
    table = {"t": np.arange(50) / 10.0, "i": np.arange(50.0)}
    read = fdi.Recording(table, columns={"time_s": ("t", 1e-3), "current_a": "i"})
    assert np.array_equal(read.times("current_a"), np.arange(50) / 10.0 * 1e-3)


@pytest.mark.parametrize(
    ("table", "columns", "column", "words"),
    [
        ({"time_s": [0.0, 1.0], "current_a": [0.0, float("nan")]}, None, "current_a", "not finite"),
        ({"time_s": [0.0, 1.0], "current_a": ["a", "b"]}, None, "current_a", "text"),
        ({"time_s": [0.0, 1.0], "current_a": [0.0, "b"]}, None, "current_a", "str at row 1"),
        ({"time_s": [0.0, 1.0], "current_a": [1.0]}, None, "current_a", "no time axis"),
        ({"time_s": [0.0, 1.0], "i": [0.0, 1.0]}, {"current_a": "amps"}, "amps", "no column"),
        ({"time_s": [0.0, 1.0], "current_a": np.zeros((2, 2))}, None, "current_a", "dimensions"),
        ({"time_s": [0.0, 1.0], "current_a": np.zeros(2, "c16")}, None, "current_a", "complex"),
        ({"time_s": [1.0, 0.0], "current_a": [0.0, 1.0]}, None, "current_a", "does not increase"),
        ({"t": [0.0, 1.0], "current_a": [0.0, 1.0]}, None, "time_s", "time_s"),
    ],
)
def test_what_is_wrong_names_the_column(
    table: dict[str, Any], columns: Any, column: str, words: str
) -> None:
    with pytest.raises(fdi.FdiError) as told:
        fdi.Recording(table, columns=columns)
    assert told.value.column == column, str(told.value)
    assert words in str(told.value)
    assert isinstance(told.value, ValueError)


def test_no_row_is_lost_where_groups_are_none(
    columns: dict[str, Any], metadata: dict[str, Any]
) -> None:
    pl = pytest.importorskip("polars")
    frame = pl.DataFrame(columns)
    count = len(columns["time_s"])
    days = frame.with_columns(day=pl.lit(b"x"))
    with pytest.raises(fdi.FdiError, match="column `day` holds") as told:
        fdi.diagnose(days, group="day", metadata=metadata, **OPTIONS)
    assert told.value.column == "day"
    both = pl.concat([frame.with_columns(unit=pl.lit(name)) for name in ("a", None)])
    table = fdi.diagnose(both, group="unit", metadata=metadata, **OPTIONS)
    assert [answer["recording"] for answer in table.records] == ["a"]
    assert f"column `unit` is empty in {count} rows" in table.failed[0]["error"]


def test_lists_of_texts_are_no_phase_that_is_missing(
    columns: dict[str, Any], metadata: dict[str, Any]
) -> None:
    pl = pytest.importorskip("polars")
    frame = pl.DataFrame({name: [list(values)] for name, values in columns.items()})
    wrong = frame.with_columns(pl.col("phase_b_current_a").cast(pl.List(pl.String)))
    with pytest.raises(fdi.FdiError, match="expected lists of numbers") as told:
        fdi.diagnose(wrong, metadata=metadata, on_error="raise", **OPTIONS)
    assert told.value.column == "phase_b_current_a"


def test_lists_may_be_arrays(
    columns: dict[str, Any], metadata: dict[str, Any], expected: dict[str, Any]
) -> None:
    rows = {name: [values, values] for name, values in columns.items()}
    for table in (rows, pytest.importorskip("pandas").DataFrame(rows)):
        answers = fdi.diagnose(table, metadata=metadata, **OPTIONS)
        assert [_faults(answer) for answer in answers] == [expected, expected]


def test_a_mask_is_a_gap(columns: dict[str, Any], metadata: dict[str, Any]) -> None:
    is_masked = np.arange(len(columns["time_s"])) < 500
    phase = np.ma.masked_array(np.where(is_masked, 99.0, columns["phase_b_current_a"]), is_masked)
    masked = {**columns, "phase_b_current_a": phase}
    with pytest.raises(fdi.FdiError) as told:
        fdi.diagnose(masked, metadata=metadata, on_error="raise", **OPTIONS)
    assert told.value.column == "phase_b_current_a"


def test_a_time_that_is_no_number_is_told_as_the_time(columns: dict[str, Any]) -> None:
    times = np.array(columns["time_s"])
    times[7] = np.nan
    pandas = pytest.importorskip("pandas")
    for table in ({**columns, "time_s": times}, pandas.DataFrame({**columns, "time_s": times})):
        with pytest.raises(fdi.FdiError, match="at row 7") as told:
            fdi.diagnose(table, on_error="raise", **OPTIONS)
        assert told.value.column == "time_s"


def test_columns_that_are_no_channels_are_nobodys_concern(
    columns: dict[str, Any], metadata: dict[str, Any], expected: dict[str, Any]
) -> None:
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(columns)
    frame["note"] = [pandas.Timestamp("2026-01-01").date()] * len(frame)
    frame["mixed"] = [1, "a"] * (len(frame) // 2)
    frame["time_s"] = pandas.Timestamp("2026-01-01", tz="Europe/Rome") + pandas.to_timedelta(
        frame["time_s"], unit="s"
    )
    answer = fdi.diagnose(frame, metadata=metadata, **OPTIONS)[0]
    # times went through whole nanoseconds
    assert _faults(answer)["k1"] == pytest.approx(expected["k1"], rel=1e-3)


def test_numbers_of_numpy_are_numbers(columns: dict[str, Any], metadata: dict[str, Any]) -> None:
    scaled = {**columns, "phase_b_current_a": columns["phase_b_current_a"] * 1e3}
    plain = {"noise_a": 0.02, "decide": True, "watch": {"k1": 0.1}}
    numpy = {"noise_a": np.float64(0.02), "decide": True, "watch": {"k1": np.float32(0.125)}}
    factor = {"phase_b_current_a": ("phase_b_current_a", np.float64(1e-3))}
    want = fdi.diagnose(columns, metadata=metadata, **plain, **OPTIONS)[0]
    found = fdi.diagnose(scaled, metadata=metadata, columns=factor, **numpy, **OPTIONS)
    assert found[0]["verdict"] == want["verdict"]
    assert found[0]["fit"]["noise_a"] == 0.02


@pytest.mark.parametrize(
    "options",
    [{"watch": "k1=0.1"}, {"act": [1]}, {"columns": "abc"}, {"columns": {"current_a": 5}}, {"on_error": "no"}],
)
def test_arguments_of_another_form_are_told(columns: dict[str, Any], options: dict[str, Any]) -> None:
    with pytest.raises(fdi.FdiError):
        fdi.diagnose(columns, **{"decide": True, **options}, **OPTIONS)
    with pytest.raises(fdi.FdiError):
        fdi.diagnose({1: columns["time_s"]}, **OPTIONS)


def test_metadata_survive_a_pickle(columns: dict[str, Any]) -> None:
    stated = {"command": "chirp", "actuator-id": 'pump "A"\\1\n'}
    recording = fdi.Recording(columns, metadata=stated)
    again = pickle.loads(pickle.dumps(recording))
    assert again.metadata == recording.metadata == stated
