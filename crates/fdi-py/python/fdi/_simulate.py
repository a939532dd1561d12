"""Simulated recordings."""

from __future__ import annotations

import logging
import os
from collections.abc import Mapping
from typing import Union

from . import _fdi
from ._recording import Recording
from ._words import everywhere, level_words, words

_LOG = logging.getLogger("fdi")


def simulate(
    *,
    model: Union[str, os.PathLike[str]] = "ema-48",
    command: Union[str, os.PathLike[str]] = "chirp",
    faults: Mapping[str, float] | None = None,
    fidelity: str = "high",
    noise_a: float = 0.0,
    adc_bits: int | None = None,
    adc_range_a: float | None = None,
    rate_hz: float | None = None,
    start_angle_rad: float = 0.0,
    load_n_m: float | None = None,
    seed: int = 0,
) -> Recording:
    """Simulates a recording as a bench would make it: the options are those of ``fdi simulate``.

    ``faults`` are levels such as ``{"k1": 0.02}``. What is to be said of the simulation goes to the
    logger ``fdi``.
    """
    options = {
        "model": os.fspath(model),
        "command": os.fspath(command),
        "faults": ",".join(level_words("faults", faults)),
        "noise_a": noise_a,
        "adc_bits": adc_bits,
        "adc_range_a": adc_range_a,
        "rate_hz": rate_hz,
        "start_angle_rad": start_angle_rad,
        "load_n_m": load_n_m,
        "fidelity": fidelity,
    }
    # an axis has one model, which it is an error to name
    if fidelity == "high":
        del options["fidelity"]
    recording, notices = _fdi.simulated([*words(options), *everywhere(seed, None, stable=True)])
    for notice in notices:
        _LOG.info("%s", notice)
    return Recording._of(recording)
