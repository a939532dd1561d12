"""What the tests share: the recordings of the repository, and the command line beside them."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="session")
def root() -> Path:
    """The root of the repository."""
    return ROOT


@pytest.fixture(scope="session")
def recordings() -> Path:
    """The committed recordings."""
    return ROOT / "fixtures" / "recordings"


@pytest.fixture(scope="session")
def cli() -> list[str]:
    """The program `fdi`, which `FREEDOM_PROGRAM` names."""
    program = os.environ.get("FREEDOM_PROGRAM")
    if program is None:
        pytest.skip("FREEDOM_PROGRAM does not name the program `fdi`")
    return [program]


def product(command: list[str]) -> bytes:
    """What a command writes."""
    return subprocess.run(command, check=True, capture_output=True, cwd=ROOT).stdout
