"""A short soak with real processes: nodes die, are started again, and the report says what came of it."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable

import psutil
from launched import Launched

Launch = Callable[..., Launched]
TIMING = ("robot at rest", "latency", "named", "without a fault are reached")
"""What a machine that is busy with other things may miss."""


def test_two_minutes_with_all_faults(launch: Launch) -> None:
    run = launch("--smoke", "--seed", "2", script="soak.py")
    assert run.end(300.0) in (0, 3), run.text
    assert "Traceback" not in run.text
    content = json.loads((run.out / "soak.json").read_text())
    missed = [bar["what"] for bar in content["bars"] if bar["met"] is False]
    assert all(any(word in what for word in TIMING) for what in missed), run.text
    kinds = {row["fault"] for row in content["faults"]}
    assert "kill" in kinds, run.text
    assert run.text.count("it is started again") == sum(
        row["count"] for row in content["faults"] if row["fault"] == "kill"
    )
    assert content["reaches"]["count"] >= 5
    assert content["end"]["orphans"] == []
    assert all(not bag["error"] for bag in content["end"]["bags"])
    samples = [
        json.loads(line)
        for line in (run.out / "soak.jsonl").read_text().splitlines()
        if '"kind":"sample"' in line
    ]
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
    run.process.send_signal(signal.SIGINT)
    assert run.end(60.0) == 130, run.text
    assert "Traceback" not in run.text
    assert not psutil.wait_procs(list(nodes.values()), timeout=3.0)[1]
    content = json.loads((run.out / "soak.json").read_text())
    assert content["end"]["broken"] == "Ctrl-C"
    assert content["end"]["killed"] == []
    assert [bar["error"] for bar in content["end"]["bags"]] == [""]
    assert "the report is of what there was" in run.text
