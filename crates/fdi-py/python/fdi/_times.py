"""Points in time as seconds."""

from __future__ import annotations

from typing import Any


def seconds(times: Any) -> Any:
    """Seconds since the first point in time; differences in time as seconds."""
    import numpy as np

    kind = times.dtype.kind
    ticks = times.astype("datetime64[ns]" if kind == "M" else "timedelta64[ns]")
    first = ticks[0] if kind == "M" and len(ticks) else np.timedelta64(0, "ns")
    out = (ticks - first) / np.timedelta64(10**9, "ns")
    return np.ascontiguousarray(out, dtype="<f8")
