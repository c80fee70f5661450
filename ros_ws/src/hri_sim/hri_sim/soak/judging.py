"""From the record of a soak to its figures, and to what of them meets what is wanted."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_sim.soak.contacts import STANDS, Contact, harmful_above
from hri_sim.soak.faults import CANCEL, GROUPS, KILL, PAUSE, UNREACHABLE
from hri_sim.soak.growth import Growth, latency_growth
from hri_sim.soak.load import MOST_SHARE, grown
from hri_sim.soak.log import DEATH, END, FAULT, REACH, SAMPLE, SoakRecord
from hri_sim.soak.lost import Lost, lost_messages
from hri_sim.soak.memory import memory_rows

FloatArray = NDArray[np.float64]

MOST_GROWTH = 0.05
REST_MS = 200.0
NAMED_MS = 1000.0
CHAIN = ("person", "predictor", "ptomp", "separation_monitor")
"""Nodes at whose death the robot must come to rest."""
LONG_S = 300.0
"""In a run of so long growth can be judged, whatever is killed in its first half [s]."""
ONE = "at least one"
LONG = f"a run of {LONG_S / 60.0:g} minutes"


@dataclass(frozen=True)
class Bar:
    """One thing that is wanted.

    Attributes:
        what: What it is about.
        measured: What was found.
        wanted: What is wanted.
        met: Whether it is met; none: there was nothing to judge.
        needs: Where there was not: what it takes.
    """

    what: str
    measured: str
    wanted: str
    met: bool | None
    needs: str = ""


def latencies(samples: Sequence[dict[str, Any]]) -> tuple[FloatArray, FloatArray]:
    """Times (N,) [s] and latencies (N,) [ms]; those of a sample are all of its time."""
    times = [s["s"] for s in samples for _ in s["latency_ms"]]
    values = [value for s in samples for value in s["latency_ms"]]
    return np.array(times, dtype=float), np.array(values, dtype=float)


def _by_thirds(times: FloatArray, values: FloatArray) -> list[dict[str, float | None]]:
    found = []
    edges = np.linspace(times.min(), times.max(), 4) if len(times) else np.zeros(4)
    for index in range(3):
        last = index == 2
        inside = (times >= edges[index]) & ((times < edges[index + 1]) | last)
        own = values[inside]
        found.append(
            {
                "p50": float(np.median(own)) if len(own) else None,
                "p99": float(np.percentile(own, 99)) if len(own) else None,
            }
        )
    return found


def file_figures(samples: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """How the bags grew: in total [MB], and a minute in each third of the run."""
    if len(samples) < 4:
        return {"total_mb": 0.0, "mb_per_minute": [None] * 3}
    times = np.array([s["s"] for s in samples], dtype=float)
    sizes = np.array([sum(s["bags"].values()) for s in samples], dtype=float) / 1e6
    edges = np.linspace(times[0], times[-1], 4)
    at = np.interp(edges, times, sizes)
    minutes = np.diff(edges) / 60.0
    return {
        "total_mb": float(sizes[-1]),
        "mb_per_minute": [float(rate) for rate in np.diff(at) / minutes],
    }


def rates(samples: Sequence[dict[str, Any]]) -> dict[str, float]:
    """Median of how often each node ticked [Hz]."""
    found: dict[str, list[float]] = defaultdict(list)
    for sample in samples:
        for label, figures in sample["figures"].items():
            if "tick_hz" in figures:
                found[label].append(figures["tick_hz"])
    return {label: float(np.median(values)) for label, values in found.items()}


def fault_rows(faults: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """What came of the faults: a row for each kind, and each node where it is about one."""
    groups: dict[tuple[str, str], list[dict[str, Any]]] = defaultdict(list)
    for fault in faults:
        groups[fault["fault"], fault["node"]].append(fault)
    rows = []
    for (kind, node), own in sorted(groups.items()):
        rests = [f for f in own if f["moving"] and must_stop(f)]
        rows.append(
            {
                "fault": kind,
                "node": node,
                "count": len(own),
                "moving": len(rests),
                "came_to_rest": sum(f["rest_ms"] is not None for f in rests),
                "rest_ms": _most(f["rest_ms"] for f in rests),
                "named_ms": _most(f["named_ms"] for f in own),
                "ready_s": _most(f["ready_s"] for f in own),
                "reached_s": _most(f["reached_s"] for f in own),
                "reached": sum(f["reached_s"] is not None for f in own),
                "as_wanted": sum(f["as_wanted"] is True for f in own)
                if kind in GROUPS["goals"]
                else None,
            }
        )
    return rows


def must_stop(fault: dict[str, Any]) -> bool:
    """Whether the robot must come to rest by a fault."""
    if fault["fault"] in (KILL, PAUSE):
        return fault["node"] in CHAIN
    return fault["fault"] in (CANCEL, UNREACHABLE)


def _most(values: Any) -> float | None:
    known = [value for value in values if value is not None]
    return float(max(known)) if known else None


def figures(
    record: SoakRecord, rng: np.random.Generator, contacts: Sequence[Contact] | None = None
) -> dict[str, Any]:
    """All figures of a soak.

    Args:
        record: What was noted.
        rng: Draws for intervals.
        contacts: Of robot and person, as the bags have them; none: there are no bags.
    """
    samples, faults, reaches = record.of(SAMPLE), record.of(FAULT), record.of(REACH)
    times, values = latencies(samples)
    growth = latency_growth(times, values, rng)
    calm = [r for r in reaches if not r["disturbed"]]
    return {
        **record.begin,
        "cut": record.cut,
        "seconds": round(float(samples[-1]["s"]), 1) if samples else 0.0,
        "memory": memory_rows(samples, faults),
        "latency": {
            "count": len(values),
            "thirds": _by_thirds(times, values),
            "growth": None if growth is None else asdict(growth),
        },
        "files": file_figures(samples),
        "rates_hz": rates(samples),
        "faults": fault_rows(faults),
        "reaches": {
            "count": len(reaches),
            "calm": len(calm),
            "calm_reached": sum(r["outcome"] == "reached" for r in calm),
            "not_reached": sorted(
                {f"{r['outcome']}: {r['reason']}" for r in calm if r["outcome"] != "reached"}
            ),
        },
        "contacts": None if contacts is None else [asdict(contact) for contact in contacts],
        "deaths": [d for d in record.of(DEATH) if not d["wanted"]],
        "end": record.of(END)[-1] if record.of(END) else None,
        "bars": [asdict(bar) for bar in bars(record, samples, faults, growth, calm, contacts)],
    }


def bars(
    record: SoakRecord,
    samples: Sequence[dict[str, Any]],
    faults: Sequence[dict[str, Any]],
    growth: Growth | None,
    calm: Sequence[dict[str, Any]],
    contacts: Sequence[Contact] | None,
) -> list[Bar]:
    """What is wanted, and whether it is met."""
    length_s = float(samples[-1]["s"] - samples[0]["s"]) if samples else 0.0
    rows = memory_rows(samples, faults)
    found = [
        _memory_bar(rows, length_s),
        _load_bar(rows, length_s),
        _latency_bar(growth, length_s),
    ]
    stopping = [f for f in faults if f["node"] and f["moving"] and must_stop(f)]
    found.append(
        _most_bar(
            "kill or standstill of mocap, predictor, planner, monitor: robot at rest",
            [f["rest_ms"] for f in stopping],
            REST_MS,
        )
    )
    kills = [f for f in faults if f["fault"] == KILL]
    found.append(_most_bar("a death is named", [f["named_ms"] for f in kills], NAMED_MS))
    back = sum(f["reached_s"] is not None for f in faults)
    found.append(_all_bar("a goal is reached after the fault", back, len(faults)))
    goals = [f for f in faults if f["fault"] in GROUPS["goals"]]
    right = sum(f["as_wanted"] is True for f in goals)
    found.append(_all_bar("goals that a fault is about end as they should", right, len(goals)))
    reached = sum(r["outcome"] == "reached" for r in calm)
    found.append(_all_bar("goals without a fault are reached", reached, len(calm)))
    deaths = sum(not d["wanted"] for d in record.of(DEATH))
    found.append(_none_bar("nodes that died by themselves", deaths))
    found.append(_contact_bar(record.begin.get("contact_speed", 0.0), contacts))
    if record.cut:
        return [*found, Bar("the end of the run", "the script was killed", "a whole record", False)]
    end = record.of(END)[-1]
    found.append(_none_bar("messages with numbers that are not finite", end["not_finite"]))
    found.append(_none_bar("processes left behind", len(end["orphans"])))
    found.append(_none_bar("files of shared memory left behind", len(end["shared_left"])))
    found.append(_lost_bar(lost_messages(samples, faults)))
    whole = sum(not bag["error"] for bag in end["bags"])
    found.append(_all_bar("bags can be read from begin to end", whole, len(end["bags"])))
    if end["broken"]:
        found.append(Bar("the run", end["broken"], "goes on to its end", False))
    return found


def _growth_untold(what: str, measured: str, wanted: str, length_s: float) -> Bar:
    """A bar of which nothing can be said: as is to be expected of a short run, and missed in a long one."""
    if length_s >= LONG_S:
        return Bar(what, measured, wanted, False)
    return Bar(what, measured, wanted, None, LONG)


def _memory_bar(rows: Sequence[dict[str, Any]], length_s: float) -> Bar:
    what, wanted = "growth of a process' memory", f"≤ {MOST_GROWTH:.0%}"
    judged = [row for row in rows if row["growth"] is not None]
    nodes = {row["node"] for row in rows}
    if not judged:
        return _growth_untold(what, "no process lived long enough", wanted, length_s)
    worst = max(judged, key=lambda row: row["growth"]["share"])
    share, minutes = worst["growth"]["share"], worst["growth"]["span_s"] / 60.0
    left_out = nodes - {row["node"] for row in judged}
    measured = (
        f"{share:+.1%} at most ({worst['node']}, in {minutes:.1f} min); "
        f"{len(nodes) - len(left_out)} of {len(nodes)} judged"
    )
    if left_out:
        measured += f", too short: {', '.join(sorted(left_out))}"
    return Bar(what, measured, wanted, share <= MOST_GROWTH)


def _load_bar(rows: Sequence[dict[str, Any]], length_s: float) -> Bar:
    what = "growth of the processor time that a process needs, first to last third"
    wanted = f"≤ {MOST_SHARE:.0%}"
    judged = [row for row in rows if row["load"] is not None]
    if not judged:
        return _growth_untold(what, "no process lived long enough", wanted, length_s)
    worst = max(judged, key=lambda row: grown(row["load"]))
    first, last = worst["load"]
    measured = (
        f"{grown(worst['load']):+.0%} at most ({worst['node']}, {first:.2f} to {last:.2f} cores)"
    )
    return Bar(what, measured, wanted, grown(worst["load"]) <= MOST_SHARE)


def _latency_bar(growth: Growth | None, length_s: float) -> Bar:
    what = "growth of the latency's median, first to last third"
    wanted = f"≤ {MOST_GROWTH:.0%}, or none that is certain"
    if growth is None:
        return _growth_untold(what, "too little to tell", wanted, length_s)
    measured = (
        f"{growth.share:+.1%} ({growth.low:+.1%} to {growth.high:+.1%}), "
        f"{growth.first:.1f} to {growth.last:.1f} ms"
    )
    return Bar(what, measured, wanted, growth.share <= MOST_GROWTH or growth.low <= 0.0)


def _contact_bar(contact_speed: float, contacts: Sequence[Contact] | None) -> Bar:
    limit = harmful_above(contact_speed)
    what = f"contacts in which the robot comes at the person with more than {limit:.2f} m/s"
    if contacts is None:
        return Bar(what, "no bag", "0", None, "a bag")
    speeds = [contact.approach for contact in contacts]
    fast = sum(speed > limit for speed in speeds)
    measured = f"{fast} of {len(speeds)} contacts"
    if speeds:
        coming = sum(speed > STANDS for speed in speeds)
        measured += f"; {coming} with more than {STANDS:.2f} m/s, at most {max(speeds):+.2f} m/s"
    return Bar(what, measured, "0", fast == 0)


def _most_bar(what: str, values: Sequence[float | None], limit_ms: float) -> Bar:
    wanted = f"≤ {limit_ms:.0f} ms"
    if not values:
        return Bar(what, "none came", wanted, None, ONE)
    kept = sum(value is not None and value <= limit_ms for value in values)
    most = _most(values)
    slowest = "–" if most is None else f"{most:.0f} ms"
    return Bar(what, f"{kept} of {len(values)}, slowest {slowest}", wanted, kept == len(values))


def _all_bar(what: str, count: int, of: int) -> Bar:
    if not of:
        return Bar(what, "none came", "all", None, ONE)
    return Bar(what, f"{count} of {of}", "all", count == of)


def _lost_bar(lost: Lost | None) -> Bar:
    what = "messages that the recorder lost while it ran"
    if lost is None:
        return Bar(what, "no recorder", "0", None, "a bag")
    measured = str(lost.running)
    if lost.standing:
        measured += f"; {lost.standing} while it stood still"
    return Bar(what, measured, "0", lost.running == 0)


def _none_bar(what: str, count: int) -> Bar:
    return Bar(what, str(count), "0", count == 0)


def missed(content: dict[str, Any]) -> bool:
    """Whether anything that is wanted is missed; what was not judged is neither missed nor met."""
    return any(bar["met"] is False for bar in content["bars"])


def verdict(content: dict[str, Any]) -> str:
    """How many of the judged bars are met, and which were not judged for want of what."""
    judged = [bar for bar in content["bars"] if bar["met"] is not None]
    others = [bar for bar in content["bars"] if bar["met"] is None]
    text = f"{sum(bar['met'] for bar in judged)} of {len(judged)} judged bars met"
    if not others:
        return text
    names = "; ".join(f"{bar['what']} (needs {bar['needs']})" for bar in others)
    return f"{text}; {len(others)} not judged: {names}"
