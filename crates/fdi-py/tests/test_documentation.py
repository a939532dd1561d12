"""Blocks of the documentation run."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

PAGES = ["README.md", "crates/fdi-py/README.md"]


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
