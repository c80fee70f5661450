"""Statuses as nodes publish them."""

from __future__ import annotations

from hri_sim.health.figures import OK, NodeStatus

ARM = "/humans/bodies/person1/arm"


def status(name: str = "/predictor", level: int = OK, message: str = "well", **values: object):
    """A status with a tick of 20 ms, and figures named by keywords (``tick_overruns=3``)."""
    base: dict[str, object] = {
        "period_ms": 20,
        "tick_ms_p50": "1.500",
        "tick_ms_p99": "4.250",
        "tick_hz": "50.0",
        "tick_overruns": 0,
        "compiled_late": "",
    }
    return NodeStatus(name, level, message, {k: str(v) for k, v in (base | values).items()})


def arm_input(hz: float = 250.0, age_s: float = 0.015, **others: float) -> dict[str, object]:
    """Figures of the arm's topic."""
    names = {"received": 1000, "received_hz": hz, "age_s": age_s, "latency_ms_p50": 16.0}
    names |= {"latency_ms_p99": 21.5, **others}
    return {f"{name} {ARM}": value for name, value in names.items()}
