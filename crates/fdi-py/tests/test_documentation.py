"""Blocks of the documentation run."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path

import pytest

NOTEBOOK = "docs/guide/from-recordings-to-a-decision.ipynb"
PAGES = ["README.md", "crates/fdi-py/README.md", "docs/guide/a-model-of-your-own.md"]


@pytest.mark.parametrize("page", PAGES)
def test_every_block_runs(page: str, root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (root / page).read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert blocks
    monkeypatch.chdir(root)
    shared: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, page, "exec"), shared)  # noqa: S102
    assert os.getcwd() == str(root)


def test_the_notebook_runs_from_recordings_to_a_decision(
    root: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    notebook = json.loads((root / NOTEBOOK).read_text(encoding="utf-8"))
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    # what is shown comes from a run, so that none is kept that the program no longer gives
    assert cells and all(cell["outputs"] == [] for cell in cells)
    shared: dict[str, object] = {}
    for number, cell in enumerate(cells):
        exec(compile("".join(cell["source"]), f"cell {number}", "exec"), shared)  # noqa: S102
    assert capsys.readouterr().out == "inspect: A-1, A-3\n"
