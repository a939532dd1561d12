"""Engines: batches in and out, the same rows on Spark and Sail as from the command line."""

from __future__ import annotations

import importlib.util
import os
import pickle
import re
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fdi

OPTIONS: dict[str, Any] = {"tolerance": "none", "method": "emulator"}
NAMES = ["r01.csv.gz", "r04.csv.gz", "r12.csv.gz", "r23.csv.gz"]


@pytest.fixture(scope="module")
def fleet(recordings: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recordings, one of which cannot be read."""
    folder = tmp_path_factory.mktemp("fleet")
    for name in NAMES:
        shutil.copy(recordings / name, folder / name)
    (folder / "bad.csv").write_text("time_s,current_a\n0,x\n")
    return folder


def _want(fleet: Path) -> list[dict[str, Any]]:
    return _rows(fdi.diagnose(fleet, stable=True, jobs=1, **OPTIONS).to_arrow())


def _rows(table: Any) -> list[dict[str, Any]]:
    return sorted(table.to_pylist(), key=lambda row: row["recording"])


def _files(fleet: Path) -> dict[str, Any]:
    files = sorted(fleet.iterdir())
    return {"path": [f"file:{file}" for file in files], "content": [f.read_bytes() for f in files]}


def test_batches_give_a_row_a_recording(fleet: Path) -> None:
    pa = pytest.importorskip("pyarrow")
    batch = pa.RecordBatch.from_pydict(_files(fleet))
    source = iter([batch.slice(0, 2), batch.slice(2, 0), batch.slice(2)])
    made = list(fdi.batches(source, **OPTIONS))
    assert all(isinstance(one, pa.RecordBatch) for one in made)
    assert _rows(pa.Table.from_batches(made)) == _want(fleet)
    assert [row["status"] for row in _want(fleet)].count("failed") == 1


def test_batches_are_taken_as_they_come(fleet: Path) -> None:
    taken = 0

    def source() -> Iterator[dict[str, Any]]:
        nonlocal taken
        for name in NAMES:
            taken += 1
            yield {"path": [str(fleet / name)]}

    answers = fdi.batches(source(), **OPTIONS)
    assert taken == 0
    first = next(answers)
    assert taken == 1 and isinstance(first, fdi.Table) and first[0]["recording"] == str(fleet / NAMES[0])
    assert len(list(answers)) == len(NAMES) - 1
    # an anti-test: another seed is another answer where something is random
    random = {"method": "ei", "max_evaluations": 40, "tolerance": "none"}
    faults = [next(fdi.batches([{"path": [str(fleet / NAMES[2])]}], seed=seed, **random)) for seed in (0, 0, 1)]
    told = [table[0]["faults"] for table in faults]
    assert told[0] == told[1] != told[2]


def test_artefacts_travel_once(root: Path, tmp_path: Path) -> None:
    from fdi._carried import Carried

    bundle = fdi.Bundle.load(root / "crates/fdi-core/bundles/chirp.fdi-bundle")
    assert "summary" not in vars(pickle.loads(pickle.dumps(bundle)))
    (tmp_path / "units").mkdir()
    (tmp_path / "units" / "a.fdi-unit").write_bytes(b"1")
    for place in (tmp_path / "units", tmp_path / "units" / "a.fdi-unit"):
        carried = pickle.loads(pickle.dumps(Carried.of(place)))
        assert carried.path.name == place.name and carried.path == carried.path
    assert (Carried.of(tmp_path / "units").path / "a.fdi-unit").read_bytes() == b"1"
    with pytest.raises(fdi.FdiError) as told:
        Carried.of(tmp_path / "none")
    assert told.value.file == str(tmp_path / "none")


@pytest.fixture(scope="module")
def spark() -> Iterator[Any]:
    """A session of Spark, or of Sail where that is what is installed."""
    sql = pytest.importorskip("pyspark.sql", reason="pyspark is not installed")
    pytest.importorskip("pyarrow")
    os.environ["PYSPARK_PYTHON"] = sys.executable
    with_sail = importlib.util.find_spec("pysail") is not None
    if not with_sail and shutil.which("java"):
        builder = sql.SparkSession.builder.master("local[2,4]").config("spark.ui.enabled", "false")
        builder = builder.config("spark.sql.shuffle.partitions", "2")
        session = builder.getOrCreate()
        yield session
        session.stop()
        return
    sail = pytest.importorskip("pysail.spark", reason="neither Java nor pysail is installed")
    server = sail.SparkConnectServer()
    server.start()
    _, port = server.listening_address
    session = sql.SparkSession.builder.remote(f"sc://localhost:{port}").getOrCreate()
    yield session
    session.stop()
    server.stop()


def test_files_on_an_engine(spark: Any, fleet: Path, root: Path) -> None:
    files = spark.read.format("binaryFile").load(str(fleet))
    if "pysail" in sys.modules:
        # Sail names files of this machine without their first stroke
        from pyspark.sql.functions import concat, lit

        files = files.withColumn("path", concat(lit("/"), files["path"]))
    bundle = fdi.Bundle.load(root / "crates/fdi-core/bundles/chirp.fdi-bundle")
    frame = fdi.spark.diagnose(files.repartition(3), **OPTIONS)
    assert _rows(frame.toArrow()) == _want(fleet)
    named = fdi.spark.diagnose(files, bundle=bundle, **OPTIONS).toArrow()
    assert [row["k1"] for row in _rows(named)] == [row["k1"] for row in _want(fleet)]
    paths = spark.createDataFrame([(path,) for path in _files(fleet)["path"]], "path string")
    assert _rows(fdi.spark.diagnose(paths, **OPTIONS).toArrow()) == _want(fleet)


def test_lists_and_long_tables_on_an_engine(spark: Any, fleet: Path) -> None:
    lists, samples = [], []
    for name in NAMES:
        read = fdi.Recording.read(fleet / name)
        values = {channel: np.asarray(read[channel]).tolist() for channel in read.channels}
        if "phase_a_current_a" not in values:
            continue
        times = np.asarray(read.times(read.channels[0])).tolist()
        channels = [values[f"phase_{phase}_current_a"] for phase in "abc"]
        lists.append((name, times, *channels))
        samples += [(name, *row) for row in zip(times, *channels)]
    assert len(lists) >= 2
    names = ["recording", "time_s", *(f"phase_{phase}_current_a" for phase in "abc")]
    pa = pytest.importorskip("pyarrow")
    table = pa.table(dict(zip(names, zip(*lists))))
    options = {**OPTIONS, "method": "gls", "metadata": {"start_angle_rad": 0.0}}
    want = _rows(fdi.diagnose(table, stable=True, **options).to_arrow())
    assert [row["error"] for row in want] == [None] * len(lists)
    kind = "recording string, " + ", ".join(f"{name} array<double>" for name in names[1:])
    frame = spark.createDataFrame(lists, kind)
    assert _rows(fdi.spark.diagnose(frame, **options).toArrow()) == want
    long = spark.createDataFrame(samples[::-1], kind.replace("array<double>", "double"))
    made = fdi.spark.diagnose(long, group="recording", **options).toArrow()
    assert _rows(made) == want


def test_what_is_wrong_with_a_frame_is_said_at_once(spark: Any) -> None:
    frame = spark.createDataFrame([("a", 0.0)], "name string, time_s double")
    with pytest.raises(fdi.FdiError, match="neither a column `path`"):
        fdi.spark.diagnose(frame)
    with pytest.raises(fdi.FdiError, match="no column `unit_name` to group by"):
        fdi.spark.diagnose(frame, group="unit_name")
    with pytest.raises(fdi.FdiError, match="no column `t` with the time"):
        fdi.spark.diagnose(frame, group="name", columns={"time_s": "t"})
    with pytest.raises(fdi.FdiError, match="the engine decides"):
        fdi.spark.diagnose(frame, jobs=2)
    lists = spark.createDataFrame([([0.0],)], "current_a array<double>")
    with pytest.raises(fdi.FdiError, match="no column `recording`"):
        fdi.spark.diagnose(lists)
    paths = spark.createDataFrame([("a",)], "path string")
    with pytest.raises(fdi.FdiError, match="method"):
        fdi.spark.diagnose(paths, method="magic")


def test_the_guide_runs_on_an_engine(spark: Any, fleet: Path, root: Path, tmp_path: Path) -> None:
    text = (root / "docs/guide/a-fleet-on-a-cluster.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert len(blocks) == 3
    # the places of the guide, and those of this test
    for there, here in {
        "s3://fleet/2026": str(fleet),
        "ema.fdi-bundle": str(root / "crates/fdi-core/bundles/chirp.fdi-bundle"),
        "s3://fleet/diagnosis": str(tmp_path / "diagnosis"),
        '"*.csv.gz"': '"*.csv*"',
    }.items():
        assert there in blocks[0]
        blocks[0] = blocks[0].replace(there, here)
    given = {"spark": spark, "paths": [str(file) for file in fleet.iterdir()]}
    exec(compile(blocks[0], "guide", "exec"), given)  # noqa: S102
    parquet = pytest.importorskip("pyarrow.parquet")
    assert parquet.read_table(tmp_path / "diagnosis").num_rows == len(NAMES) + 1
    # the second begins a server of Sail, as this test does where Sail is installed
    exec(compile(blocks[2], "guide", "exec"), given)  # noqa: S102
    rows = _rows(fdi.spark.diagnose(given["files"], **OPTIONS).toArrow())
    assert rows == _want(fleet)
