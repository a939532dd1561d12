"""The jobs of the guide for Slurm and Kubernetes: each part as its script runs it, then the merge."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import textwrap
from collections.abc import Callable
from pathlib import Path

import pytest

GUIDE = "docs/guide/a-fleet-on-a-cluster.md"
PARTS = 8
#: What runs the script of a part: the script, the variables of its scheduler.
Run = Callable[[str, dict[str, str]], "subprocess.CompletedProcess[str]"]


@pytest.fixture
def place(recordings: Path, tmp_path: Path) -> Path:
    """A folder with recordings, one of which cannot be read."""
    fleet = tmp_path / "recordings"
    fleet.mkdir()
    for file in sorted(recordings.glob("r*.csv.gz"))[: 2 * PARTS]:
        shutil.copy(file, fleet)
    (fleet / "bad.csv").write_text("time_s,current_a\n0,x\n")
    (tmp_path / "parts").mkdir()
    return tmp_path


@pytest.fixture
def run(cli: list[str], place: Path) -> Run:
    """Runs a script of the guide in the folder, with the program on its path."""
    path = f"{Path(cli[0]).parent}{os.pathsep}{os.environ['PATH']}"

    def script(text: str, variables: dict[str, str]) -> subprocess.CompletedProcess[str]:
        environment = {**os.environ, "PATH": path, **variables}
        return subprocess.run(
            ["/bin/sh", "-c", text], env=environment, cwd=place, capture_output=True, text=True, check=False
        )

    return script


def _blocks(root: Path, kind: str) -> list[str]:
    text = (root / GUIDE).read_text(encoding="utf-8")
    return re.findall(rf"^```{kind}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def _check(run: Run, place: Path, script: str, variables: Callable[[int], dict[str, str]]) -> None:
    """All parts but one, a part cut short, its repetition: the file of one run."""
    merge = "fdi merge parts/*.jsonl --output-format parquet -o diagnosis.parquet"
    for part in range(PARTS):
        if part == 4:
            continue
        done = run(script, variables(part))
        assert done.returncode == 0, done.stderr
    assert f"part 5 of {PARTS}" in run(merge, {}).stderr
    assert run(script, variables(4)).returncode == 0
    # as a job leaves it that was killed: its last answer is half
    cut = place / "parts" / "part-5.jsonl"
    cut.write_bytes(cut.read_bytes()[:-100])
    refused = run(merge, {})
    assert refused.returncode == 2 and f"part 5 of {PARTS}" in refused.stderr
    again = run(script, variables(4))
    assert again.returncode == 0 and "taken over" in again.stderr
    assert run(merge, {}).returncode == 0
    one = "fdi diagnose --stable -q --output-format parquet -o one.parquet"
    where = re.search(r"/dev/null (\S*recordings)", script)
    assert where is not None
    run(f"{one} {where.group(1)}", {})
    assert (place / "diagnosis.parquet").read_bytes() == (place / "one.parquet").read_bytes()


def test_the_array_of_slurm(run: Run, place: Path, root: Path) -> None:
    script = next(block for block in _blocks(root, "sh") if "#SBATCH" in block)
    submit = next(block for block in _blocks(root, "sh") if "--wrap" in block)
    assert f"--array=1-{PARTS}\n" in script and "fdi merge parts/*.jsonl" in submit

    def variables(part: int) -> dict[str, str]:
        return {"SLURM_ARRAY_TASK_ID": str(part + 1), "SLURM_CPUS_PER_TASK": "1"}

    _check(run, place, script, variables)


def test_the_indexed_job_of_kubernetes(run: Run, place: Path, root: Path) -> None:
    (job,) = _blocks(root, "yaml")
    assert f"completions: {PARTS}\n" in job and "completionMode: Indexed\n" in job
    script = re.search(r"^ +- \|\n(.*?)^ +resources:", job, re.MULTILINE | re.DOTALL)
    assert script is not None
    here = textwrap.dedent(script.group(1)).replace("/fleet/", f"{place}/")
    _check(run, place, here, lambda part: {"JOB_COMPLETION_INDEX": str(part)})
