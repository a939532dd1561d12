"""The interpreter stays free, hears Ctrl-C, and never meets a panic."""

from __future__ import annotations

import logging
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import fdi
from fdi import _fdi


@pytest.mark.parametrize("here", [True, False])
def test_a_panic_is_an_error(here: bool) -> None:
    with pytest.raises(fdi.FdiError, match="internal error, please report it: asked for"):
        _fdi._panic(here)


def test_a_thread_ticks_while_rust_works() -> None:
    ticks, done = 0, threading.Event()

    def tick() -> None:
        nonlocal ticks
        while not done.is_set():
            ticks += 1
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    _fdi._busy(500)
    done.set()
    thread.join()
    assert ticks >= 100


def test_ctrl_c_ends_a_batch_within_a_second(recordings: Path) -> None:
    program = f"""
import signal, threading, time, os, fdi
# a shell that starts this in the background has it ignored
signal.signal(signal.SIGINT, signal.default_int_handler)
files = [{str(recordings / "r12.csv.gz")!r}] * 400
fdi.diagnose(files[0])
threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
start = time.monotonic()
try:
    fdi.diagnose(files)
except KeyboardInterrupt:
    print("interrupted", time.monotonic() - start - 0.5)
"""
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    word, late = done.stdout.split()
    assert word == "interrupted" and float(late) < 1.0, done.stderr


def test_errors_pickle_and_tell_what_helps() -> None:
    with pytest.raises(fdi.FdiError) as told:
        fdi.diagnose("recordings", method="magic")
    assert "method" in str(told.value)
    with pytest.raises(fdi.FdiError) as told:
        fdi.Recording({"t": [0.0, 1.0], "current_a": [0.0, 1.0]})
    assert told.value.remedy is not None and "columns" in told.value.remedy
    again = pickle.loads(pickle.dumps(told.value))
    assert (str(again), again.column, again.remedy) == (
        str(told.value),
        told.value.column,
        told.value.remedy,
    )


def test_progress_and_messages(recordings: Path, caplog: pytest.LogCaptureFixture) -> None:
    heard: list[tuple[str, int, int]] = []
    files = [recordings / "r23.csv.gz", recordings / "r24.csv.gz"]
    fdi.diagnose(files, tolerance="none", progress=lambda *told: heard.append(told))
    assert heard == [(str(file), place + 1, 2) for place, file in enumerate(files)]
    with caplog.at_level(logging.INFO, logger="fdi"), pytest.raises(fdi.FdiError):
        fdi.Bundle(b"no bundle")


def test_what_a_callback_raises_comes_through(recordings: Path) -> None:
    def refuse(name: str, done: int, total: int) -> None:
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        fdi.diagnose(recordings / "r23.csv.gz", tolerance="none", progress=refuse)


def test_a_fork_or_two_diagnose_as_well(recordings: Path) -> None:
    import multiprocessing

    file = recordings / "r23.csv.gz"
    want = fdi.diagnose(file, tolerance="none", stable=True).to_json()
    for method in ["fork", "spawn"]:
        with multiprocessing.get_context(method).Pool(2) as pool:
            got = pool.map(_document, [str(file)] * 2)
        assert got == [want, want]
    assert os.getpid() and signal.SIGINT


def _document(file: str) -> str:
    return fdi.diagnose(file, tolerance="none", stable=True, jobs=1).to_json()
