"""A fleet on Spark, on Sail and in parts, with workers and jobs killed meanwhile.

`cargo xtask fleet-check` runs it and keeps its page. What does not hold ends it with an error.
"""

from __future__ import annotations

import argparse
import contextlib
import gzip
import json
import os
import platform
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

#: Options of every run: the bundle's emulator, so that a large fleet is cheap.
OPTIONS = {"method": "emulator", "tolerance": "none"}
WORDS = ["--method", "emulator", "--tolerance", "none", "--stable", "--output-format", "parquet"]
SEED = 37
#: Bytes of one task, where Spark counts 4 MiB for each file that it opens: some 250 recordings.
A_TASK = "1g"
#: Java reads and writes, and little else: its second compiler costs more than it saves.
JAVA = "-XX:+UseSerialGC -XX:TieredStopAtLevel=1"
#: Part of the fleet that is diagnosed by itself too, which tells what a start takes.
SMALLER = 4
#: Different recordings; the fleet has each under many names.
DIFFERENT = 240
SHARDS = 8
#: Tasks whose worker is killed where 1 in 100 would be fewer.
LEAST_KILLED = 3
#: Most processor time a recording on Spark, in those of the command line.
MOST_RATIO = 1.15


def make(folder: Path, count: int, program: str) -> dict[str, int]:
    """Makes the fleet: simulated recordings of the fixtures' kind, 1 in 100 of which is unreadable."""
    chance = random.Random(SEED)
    source = folder / "different"
    fleet = folder / "fleet"
    smaller = folder / "smaller"
    for made in (source, fleet, smaller):
        shutil.rmtree(made, ignore_errors=True)
        made.mkdir(parents=True)
    for place in range(DIFFERENT):
        levels = {f"k{fault}": round(10 ** chance.uniform(-3, -1.3), 5) for fault in range(1, 7)}
        levels["k7"] = round(chance.random(), 3)
        faults = ",".join(f"{name}={level}" for name, level in levels.items())
        words = ["--faults", faults, "--noise-a", "0.02", "--adc-bits", "12", "--seed", str(place)]
        file = source / f"{place:03}.csv"
        subprocess.run([program, "simulate", *words, "-q", "-o", str(file)], check=True)
        packed = gzip.compress(file.read_bytes(), mtime=0)
        file.with_suffix(".csv.gz").write_bytes(packed)
    unreadable = set(chance.sample(range(count), count // 100))
    for place in range(count):
        name = fleet / f"a{place:06}.csv{'' if place in unreadable else '.gz'}"
        if place in unreadable:
            # cut, nothing but names, and no number; Spark leaves files without a byte out
            header = "time_s,phase_a_current_a\n"
            content = [f"{header}0,1\n0.1", header, f"{header}0,x\n"][place % 3]
            name.write_text(content)
        else:
            os.link(source / f"{place % DIFFERENT:03}.csv.gz", name)
        # the smaller fleet is the first part of it
        if place < count // SMALLER:
            os.link(name, smaller / name.name)
    return {"count": count, "unreadable": len(unreadable)}


def command(words: list[str], program: str) -> tuple[float, float]:
    """Runs the program; its processor time in seconds and its memory in MB."""
    process = subprocess.Popen([program, *words], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    # 2: some recordings could not be read
    if os.waitstatus_to_exitcode(status) not in (0, 2):
        raise SystemExit(f"fdi {' '.join(words)}: status {status}")
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def sorted_bytes(path: Path) -> bytes:
    """The table in the order of its recordings, as one batch of Arrow in bytes."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pq.read_table(path).replace_schema_metadata(None).sort_by("recording")
    columns = {name: table[name].combine_chunks() for name in table.column_names}
    batch = pa.RecordBatch.from_pydict(columns)
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, batch.schema) as writer:
        writer.write_batch(batch)
    return sink.getvalue().to_pybytes()


def check_rows(path: Path, want: Path, count: int, what: str) -> None:
    """Every recording exactly once, and the bytes of the command line."""
    import pyarrow.parquet as pq

    names = pq.read_table(path, columns=["recording"])["recording"].to_pylist()
    if len(names) != count or len(set(names)) != count:
        raise SystemExit(f"{what}: {len(names)} rows of {len(set(names))} recordings, not {count}")
    if sorted_bytes(path) != sorted_bytes(want):
        raise SystemExit(f"{what}: other bytes than those of the command line")


class Watched:
    """A frame whose work is measured, and killed at the first try of some tasks."""

    def __init__(self, frame: Any, killed: set[int], notes: Path, first: str) -> None:
        self._frame, self._killed, self._notes, self._first = frame, killed, notes, first

    def __getattr__(self, name: str) -> Any:
        return getattr(self._frame, name)

    def select(self, *columns: str) -> Watched:
        return Watched(self._frame.select(*columns), self._killed, self._notes, self._first)

    def mapInArrow(self, work: Any, schema: str) -> Any:  # noqa: N802
        killed, notes, first = self._killed, str(self._notes), self._first

        def watched(source: Iterator[Any]) -> Iterator[Any]:
            from pyspark import TaskContext

            import fdi

            task = TaskContext.get()
            number, attempt = task.partitionId(), task.attemptNumber()
            if attempt == 0 and number in killed:
                for made in work(source):
                    # half of its first rows are on their way
                    yield made.slice(0, max(1, made.num_rows // 2))
                    time.sleep(0.2)
                    lost = {"pid": os.getpid(), "process_s": time.process_time()}
                    Path(notes, f"killed-{number}.json").write_text(json.dumps(lost))
                    os.kill(os.getpid(), signal.SIGKILL)
            # a worker starts as the program does, with a recording: told apart, as there
            before = time.process_time()
            if not hasattr(fdi, "_has_begun"):
                fdi.diagnose(first, jobs=1, stable=True, **OPTIONS)
                setattr(fdi, "_has_begun", True)
            start = time.process_time()
            yield from work(source)
            used = time.process_time() - start
            memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
            told = {"cpu_s": used, "start_s": start - before, "memory_mb": memory, "attempt": attempt, "pid": os.getpid()}
            Path(notes, f"task-{number}.json").write_text(json.dumps(told))

        return self._frame.mapInArrow(watched, schema)


def used_s(pid: int) -> float:
    """Processor time of a process and all below it, ended ones too."""
    told = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    used = sum(map(int, told[11:15])) / os.sysconf("SC_CLK_TCK")
    children: list[str] = []
    for thread in Path(f"/proc/{pid}/task").iterdir():
        # threads and processes that have ended meanwhile; their parent has the time of the latter
        with contextlib.suppress(OSError):
            children += (thread / "children").read_text().split()
    for child in children:
        with contextlib.suppress(OSError):
            used += used_s(int(child))
    return used


def most_mb(pid: int) -> float:
    """Most memory that a running process had."""
    status = Path(f"/proc/{pid}/status").read_text()
    return int(status.partition("VmHWM:")[2].split()[0]) / 1024


def spark(folder: Path, fleet: str, first: str, kills: bool) -> None:
    """A fleet on Spark, perhaps with workers killed; its answer is a folder of Parquet."""
    from pyspark.sql import SparkSession

    import fdi

    os.environ["PYSPARK_PYTHON"] = sys.executable
    builder = SparkSession.builder.master("local[2,4]").config("spark.ui.enabled", "false")
    builder = builder.config("spark.driver.memory", "2g").config("spark.ui.showConsoleProgress", "false")
    builder = builder.config("spark.driver.extraJavaOptions", JAVA)
    session = builder.config("spark.sql.files.maxPartitionBytes", A_TASK).getOrCreate()
    session.sparkContext.setLogLevel("OFF")
    start = time.monotonic()
    files = session.read.format("binaryFile").load(str(folder / fleet))
    notes = folder / "notes"
    shutil.rmtree(notes, ignore_errors=True)
    notes.mkdir()
    tasks = files.rdd.getNumPartitions()
    some = min(tasks, max(LEAST_KILLED, tasks // 100)) if kills else 0
    killed = set(random.Random(SEED + 1).sample(range(tasks), some))
    out = folder / f"spark-{fleet}.parquet"
    watched = Watched(files, killed, notes, first)
    fdi.spark.diagnose(watched, **OPTIONS).write.mode("overwrite").parquet(str(out))
    took = time.monotonic() - start
    # all processes: this one, Java, the workers; their parent does not wait for those that end
    alive = used_s(os.getpid())
    dead = [json.loads(file.read_text()) for file in notes.glob("killed-*.json")]
    used = alive + sum(one["process_s"] for one in dead)
    java = next(int(child) for child in Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children").read_text().split())
    told = [json.loads(file.read_text()) for file in notes.glob("task-*.json")]
    left = {task["pid"] for task in told} - {one["pid"] for one in dead}
    if any(not Path(f"/proc/{pid}").exists() for pid in left):
        raise SystemExit("Spark: a worker ended whose processor time is not known")
    lost = len(dead)
    if lost != len(killed) or len(told) != tasks:
        raise SystemExit(f"Spark: {lost} workers killed of {len(killed)}, {len(told)} tasks of {tasks}")
    if not (out / "_SUCCESS").exists():
        raise SystemExit("Spark: the output was not committed")
    found = {
        "tasks": tasks,
        "killed": lost,
        "again": sum(task["attempt"] > 0 for task in told),
        "workers_s": sum(task["cpu_s"] for task in told),
        "starts_s": sum(task["start_s"] for task in told),
        "workers": len({task["pid"] for task in told}),
        "all_s": used,
        "killed_s": used - alive,
        "took_s": took,
        "worker_mb": max(task["memory_mb"] for task in told),
        "java_mb": most_mb(java),
    }
    (folder / f"spark-{fleet}.json").write_text(json.dumps(found))
    session.stop()


def sail(folder: Path) -> None:
    """The fleet on Sail; its answer is a file of Parquet."""
    from pysail.spark import SparkConnectServer
    from pyspark.sql import SparkSession

    import fdi

    server = SparkConnectServer()
    server.start()
    remote = f"sc://localhost:{server.listening_address[1]}"
    session = SparkSession.builder.remote(remote).getOrCreate()
    start, before = time.monotonic(), time.process_time()
    # its `binaryFile` reads a file twice where one of its parts begins in the middle of it
    paths = [(str(file),) for file in sorted((folder / "fleet").iterdir())]
    files = session.createDataFrame(paths, "path string").repartition(2 * (os.cpu_count() or 1))
    fdi.spark.diagnose(files, **OPTIONS).write.mode("overwrite").parquet(str(folder / "sail.parquet"))
    used = time.process_time() - before
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    told = {"all_s": used, "took_s": time.monotonic() - start, "memory_mb": memory}
    (folder / "sail.json").write_text(json.dumps(told))
    session.stop()
    server.stop()


def shards(folder: Path, count: int, program: str) -> dict[str, int]:
    """Eight parts, two of which are killed and repeated, merged."""
    parts = [str(folder / f"part-{part}.jsonl") for part in range(1, SHARDS + 1)]
    killed = {3, 6}

    def words(part: int) -> list[str]:
        shard = ["--shard", f"{part}/{SHARDS}", "--resume", parts[part - 1]]
        return ["diagnose", *WORDS, "--jobs", "1", "-q", "-o", os.devnull, *shard, str(folder / "fleet")]

    left = 0
    for part, path in enumerate(parts, 1):
        Path(path).unlink(missing_ok=True)
        if part not in killed:
            command(words(part), program)
            continue
        process = subprocess.Popen([program, *words(part)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while process.poll() is None and _lines(path) < count // SHARDS // 3:
            time.sleep(0.01)
        process.kill()
        if process.wait() != -signal.SIGKILL:
            raise SystemExit(f"part {part} ended before it was killed")
        left += _lines(path)
    for part in sorted(killed):
        refused = subprocess.run([program, "merge", *parts], capture_output=True, text=True, check=False)
        if refused.returncode != 2 or f"part {part} of {SHARDS}" not in refused.stderr:
            raise SystemExit(f"part {part} is not whole and was not refused: {refused.stderr}")
        command(words(part), program)
    subprocess.run(
        [program, "merge", *parts, "-q", "--output-format", "parquet", "-o", str(folder / "merged.parquet")],
        check=True,
    )
    return {"kept": left}


def _lines(path: str) -> int:
    try:
        return max(0, Path(path).read_bytes().count(b"\n") - 1)
    except OSError:
        return 0


def line(less: float, more: float, smaller: int, count: int) -> tuple[float, float]:
    """What no recording would take, and what those that the smaller fleet does not have take."""
    beyond = more - less
    return less - beyond * smaller / (count - smaller), beyond


def page(found: dict[str, Any]) -> str:
    """The page of the figures."""
    count, cli, on_spark, on_sail = found["count"], found["cli"], found["spark"], found["sail"]

    def ms(seconds: float) -> str:
        return f"{1e3 * seconds / count:.2f} ms"

    def ms_beyond(seconds: float) -> str:
        return f"{1e3 * seconds / (count - found['smaller']):.2f} ms"

    ratio = on_spark["workers_s"] / count / (cli["beyond_s"] / (count - found["smaller"]))
    whole = on_spark["beyond_s"] / cli["beyond_s"]
    verdict, of_all = ["met" if one <= MOST_RATIO else "**missed**" for one in (ratio, whole)]
    return f"""# A fleet on Spark, on Sail and in parts

Made by `cargo xtask fleet-check{'' if count == 20000 else f' {count}'}`; do not edit. Bytes and counts are deterministic, times and memory are not. Another number of
recordings can be asked for; without one it is 20 000.

## What ran

- {count} recordings by name: {DIFFERENT} simulated chirps of the committed recordings' kind (six levels log-uniform from 0.001 to 0.05, 20 mA of noise, 12 bits,
  seeds from 0), each under many names. {found['unreadable']} of the {count} are unreadable: cut, without a sample, or with a word for a number.
- Options: `{' '.join(WORDS[:5])}`. Seed of the fleet: {SEED}. Machine: {found['machine']}.
- Spark {found['versions']['pyspark']}, master `local[2,4]`, `binaryFile`, `spark.sql.files.maxPartitionBytes` of `{A_TASK}`, Java with `{JAVA}`:
  {on_spark['tasks']} tasks. In {on_spark['killed']} of them (1 in 100, at least {LEAST_KILLED}, drawn with seed {SEED + 1}) the worker killed itself with SIGKILL after half of its
  first rows had left it.
- A smaller fleet, {found['smaller']} of these recordings, with the command line and on Spark without kills: what a start takes.
- Sail {found['versions']['pysail']} on a table of the same paths, without kills.
- {SHARDS} parts with `--shard` and `--resume`, of which 2 were killed with SIGKILL after a third of their recordings and run again, then `fdi merge`.

## What came of it

| claim | figure | |
| --- | --- | --- |
| every recording exactly once on Spark | {count} rows, {count} names; {on_spark['again']} tasks done again | met |
| the table of Spark, sorted, is the command line's | the same bytes (Arrow, one batch) | met |
| the table of Sail, sorted, is the command line's | the same bytes (Arrow, one batch) | met |
| merged parts are the file of one run | the same bytes (Parquet); {found['shards']['kept']} answers of the killed runs were kept | met |
| a part whose run did not end is refused by its name | both, before they were run again | met |
| processor time of Spark's workers a recording, at most {MOST_RATIO} of the command line's | {ratio:.2f} | {verdict} |
| the same of all processes beyond their start, with Java's reading, moving and writing and with lost work | {whole:.2f} | {of_all} |

Spark's `binaryFile` leaves out files without a byte. A table of paths has a row for them; here no file is empty.
Sail's `binaryFile` reads a file twice where one of its partitions begins in the middle of that file, so that a table of paths is what it is given.

The check ends with an error where a count or a byte differs, so that no such line can stand here unmet.

| | processor time a recording | memory |
| --- | --- | --- |
| command line, one thread, beyond its start of {cli['start_s']:.2f} s | {ms_beyond(cli['beyond_s'])} | {cli['memory_mb']:.0f} MB |
| Spark's Python workers, beyond the starts of {on_spark['workers']} of {on_spark['starts_s']:.1f} s in all | {ms(on_spark['workers_s'])} | {on_spark['worker_mb']:.0f} MB each |
| Spark, all processes, beyond their start of {on_spark['start_s']:.0f} s | {ms_beyond(on_spark['beyond_s'])} ({whole:.2f} of the command line's) | {on_spark['java_mb']:.0f} MB Java |
| Sail, all in one process, with its start | {ms(on_sail['all_s'])} | {on_sail['memory_mb']:.0f} MB |

"Beyond the start" is the same of both: the line through the processor times of the two fleets, each diagnosed by processes of their own. Its slope is the time
a recording; its value at no recording is the start, which on Spark is that of Java, of its compiler and of the first workers. The kills are in the larger fleet
alone, so that lost work and new workers count in the slope. The command line ran on each fleet just before Spark did.
The workers that were killed ({on_spark['killed_s']:.0f} s in all) wrote down their processor time themselves, as the process that began them does not wait for them.

Processor time of a worker is that of its process from the first row in to the last row out, tasks that were lost left out.
Before its first task a worker diagnoses one recording, which is counted as its start. What is left counts what Python and Arrow cost.
"""


def check(arguments: argparse.Namespace) -> None:
    """Runs all."""
    from importlib.metadata import version

    folder, count, program = arguments.folder, arguments.recordings, arguments.program
    folder.mkdir(parents=True, exist_ok=True)
    found: dict[str, Any] = make(folder, count, program)
    fleet, want = folder / "fleet", folder / "cli.parquet"
    first = str(next(file for file in sorted(fleet.iterdir()) if file.stat().st_size > 1000))
    smaller = found["smaller"] = len(list((folder / "smaller").iterdir()))
    times: dict[str, float] = {}
    on_spark: dict[str, dict[str, Any]] = {}
    memory = 0.0
    for name in ("smaller", "fleet"):
        product = want if name == "fleet" else folder / "cli-smaller.parquet"
        words = ["diagnose", *WORDS, "--jobs", "1", "-q", "-o", str(product), str(folder / name)]
        times[name], memory = command(words, program)
        words = [sys.executable, __file__, "--folder", str(folder), "--on-spark", name, "--first", first]
        with Path(folder, f"spark-{name}.log").open("w") as log:
            subprocess.run(words, check=True, stderr=log)
        on_spark[name] = json.loads((folder / f"spark-{name}.json").read_text())
    check_rows(folder / "spark-fleet.parquet", want, count, "Spark")
    check_rows(folder / "spark-smaller.parquet", folder / "cli-smaller.parquet", smaller, "Spark, smaller")
    start_s, beyond_s = line(times["smaller"], times["fleet"], smaller, count)
    found["cli"] = {"start_s": start_s, "beyond_s": beyond_s, "memory_mb": memory, "times": times}
    found["spark"] = on_spark["fleet"]
    start_s, beyond_s = line(on_spark["smaller"]["all_s"], on_spark["fleet"]["all_s"], smaller, count)
    found["spark"].update(start_s=start_s, beyond_s=beyond_s, smaller=on_spark["smaller"])
    found["shards"] = shards(folder, count, program)
    if (folder / "merged.parquet").read_bytes() != want.read_bytes():
        raise SystemExit("merged parts: other bytes than those of one run")
    run = [arguments.sail, __file__, "--folder", str(folder), "--on-sail"]
    subprocess.run(run, check=True, stderr=subprocess.DEVNULL)
    check_rows(folder / "sail.parquet", want, count, "Sail")
    found["sail"] = json.loads((folder / "sail.json").read_text())
    of_sail = "from importlib.metadata import version; print(version('pysail'))"
    pysail = subprocess.run([arguments.sail, "-c", of_sail], check=True, capture_output=True, text=True)
    found["versions"] = {"pyspark": version("pyspark"), "pysail": pysail.stdout.strip()}
    found["machine"] = f"{platform.machine()}, {os.cpu_count()} processors, {platform.system()}"
    (folder / "found.json").write_text(json.dumps(found, indent=1))
    (folder / "page.md").write_text(page(found), encoding="utf-8")


def main() -> None:
    """Reads the arguments."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, required=True)
    parser.add_argument("--recordings", type=int, default=20000)
    parser.add_argument("--program")
    parser.add_argument("--sail")
    parser.add_argument("--on-sail", action="store_true")
    parser.add_argument("--on-spark")
    parser.add_argument("--first")
    arguments = parser.parse_args()
    if arguments.on_sail:
        sail(arguments.folder)
    elif arguments.on_spark:
        spark(arguments.folder, arguments.on_spark, arguments.first, kills=arguments.on_spark == "fleet")
    else:
        check(arguments)


if __name__ == "__main__":
    main()
