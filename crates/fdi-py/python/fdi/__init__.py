"""Diagnose electromechanical actuators from recordings of their stator current.

>>> import fdi
>>> table = fdi.diagnose("recordings/")          # doctest: +SKIP
>>> table["r04.csv.gz"]["verdict"]               # doctest: +SKIP
'faulty'

Answers are those of the command line ``fdi``, bit for bit. Messages go to the logger ``fdi``; every
failure is an :class:`FdiError`.
"""

from __future__ import annotations

from . import spark
from ._artefacts import Bundle, Unit
from ._diagnose import batches, diagnose, fit_figure
from ._error import FdiError
from ._explain import Document, calibrate, explain, propose
from ._fdi import __version__
from ._figure import Figure
from ._fmu import fmu
from ._own_model import Number, OwnModel
from ._recording import Recording
from ._simulate import simulate
from ._table import Table

__all__ = [
    "Bundle",
    "Document",
    "FdiError",
    "Figure",
    "Number",
    "OwnModel",
    "Recording",
    "Table",
    "Unit",
    "__version__",
    "batches",
    "calibrate",
    "diagnose",
    "explain",
    "fit_figure",
    "fmu",
    "propose",
    "simulate",
    "spark",
]
