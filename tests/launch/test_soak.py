"""A short soak with real processes: nodes die, are started again, and the report says what came of it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psutil
from launched import Launched

from hri_sim.soak.judging import must_stop, verdict
from hri_sim.soak.log import FAULT, LOG, SAMPLE, read_log

Launch = Callable[..., Launched]
TIMING = ("robot at rest", "latency", "named", "without a fault are reached")
"""What a machine that is busy with other things may miss: until when something is done or said, and goals
for which a prediction or a plan comes too late. That it is done and said at all depends on no machine."""
BUSY_MS = 500.0
"""On such a machine the robot rests within this; 200 ms are the bar of the report [ms]."""
LATE = ("lost_input", "blocked")
"""How such goals end: for want of what is new enough, or of time to plan a way around somebody."""


def records(folder: Path, kind: str) -> list[dict[str, Any]]:
    """Of one kind in the record of a soak."""
    return read_log(folder / LOG).of(kind)


def test_two_minutes_with_all_faults(launch: Launch) -> None:
    run = launch("--smoke", "--seed", "2", script="soak.py")
    code = run.end(300.0)
    assert "Traceback" not in run.text
    content = json.loads((run.out / "soak.json").read_text())
    missed = [bar["what"] for bar in content["bars"] if bar["met"] is False]
    assert code == (3 if missed else 0), run.text
    outcomes = [(fault["fault"], fault["outcomes"]) for fault in records(run.out, FAULT)]
    assert all(any(word in what for word in TIMING) for what in missed), f"{outcomes}\n{run.text}"
    ends = [text.partition(":")[0] for text in content["reaches"]["not_reached"]]
    assert set(ends) <= set(LATE), run.text
    for fault in records(run.out, FAULT):
        # Who is killed is named, and the robot does not move on without.
        assert fault["fault"] != "kill" or fault["named_ms"] is not None, fault
        # One that stands still for less than samples may be old need not stop the robot.
        lasts = fault["fault"] == "kill" or (fault["fault"] == "pause" and fault["seconds"] > 0.6)
        stops = lasts and fault["moving"] and must_stop(fault)
        assert not stops or (fault["rest_ms"] or BUSY_MS + 1.0) <= BUSY_MS, fault
    assert verdict(content) in run.text
    kinds = {row["fault"] for row in content["faults"]}
    assert "kill" in kinds, run.text
    assert run.text.count("it is started again") == sum(
        row["count"] for row in content["faults"] if row["fault"] == "kill"
    )
    assert content["reaches"]["count"] >= 5
    assert content["end"]["orphans"] == []
    assert all(not bag["error"] for bag in content["end"]["bags"])
    samples = records(run.out, SAMPLE)
    assert len(samples) >= 100
    assert set(samples[0]["processes"]) == {
        "simulator",
        "person",
        "predictor",
        "ptomp",
        "separation_monitor",
        "recorder",
        "script",
    }
    assert (run.out / "soak.png").stat().st_size > 20_000
    assert "| what | measured | wanted | verdict |" in (run.out / "soak.md").read_text()
    print("\n".join(f"{bar['what']}: {bar['measured']}" for bar in content["bars"]))


def test_ctrl_c_leaves_a_report(launch: Launch) -> None:
    run = launch("--minutes", "5", "--faults", "pauses", "--every", "0.1", script="soak.py")
    run.wait_for("of 5.0 min", 90.0)
    nodes = run.nodes()
    assert len(nodes) == 6
    tried = subprocess.run(["chrt", "-f", "12", "true"], capture_output=True, check=False)
    permitted = tried.returncode == 0 and len(os.sched_getaffinity(0)) > 1
    wanted = os.SCHED_FIFO if permitted else os.SCHED_OTHER
    assert os.sched_getscheduler(nodes["separation_monitor"].pid) == wanted
    assert os.sched_getscheduler(nodes["ptomp"].pid) == os.SCHED_OTHER
    run.process.send_signal(signal.SIGINT)
    assert run.end(60.0) == 130, run.text
    assert "Traceback" not in run.text
    assert not psutil.wait_procs(list(nodes.values()), timeout=3.0)[1]
    content = json.loads((run.out / "soak.json").read_text())
    assert content["end"]["broken"] == "Ctrl-C"
    assert content["end"]["killed"] == []
    assert [bar["error"] for bar in content["end"]["bags"]] == [""]
    assert "the report is of what there was" in run.text
