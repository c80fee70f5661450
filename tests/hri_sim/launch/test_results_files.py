"""Files with results say of which commit, when and on which machine they were measured."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from hri_prediction.results.origin import origin_line
from hri_sim.launch.benchmark import write_results
from hri_sim.launch.reproduce import write_demo, write_replay

ORIGIN = {
    "commit": "abc123",
    "date": "2025-01-31",
    "machine": {"cpu": "Some CPU", "cores": 2, "python": "3.12.1"},
}


def test_every_file_with_results_says_so(tmp_path: Path) -> None:
    nothing: dict[str, Any] = {"p50": None, "p99": None}
    write_demo(tmp_path, ORIGIN, {})
    write_replay(tmp_path, ORIGIN, {}, [])
    latencies = {"mocap_to_prediction": nothing, "mocap_to_trajectory": nothing}
    results = {"origin": ORIGIN, "seeds": [1], "outcomes": ["reached"], "latency_ms": latencies}
    figures = ("lost_messages", "host_share", "cpu_share", "replan_miss_share", "replans")
    results |= {
        "rates_hz": {},
        "sim_realtime_factor": 30.0,
        "recorder_msgs_per_s": 5000.0,
    } | dict.fromkeys(figures, 0)
    write_results(tmp_path, results, {"a": np.zeros(3), "b": np.ones(3)})
    line = origin_line(ORIGIN)
    assert line == "Commit abc123, 2025-01-31; Some CPU, 2 cores, Python 3.12.1."
    for name in ("demo", "replay", "results"):
        assert line in (tmp_path / f"{name}.md").read_text()
        assert json.loads((tmp_path / f"{name}.json").read_text())["origin"] == ORIGIN
