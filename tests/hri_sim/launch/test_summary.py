"""What is said of a run: the table, and the figures when the recording is missing."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from hri_planner.separation.config import MEASURED
from hri_sim.launch.record import Series, with_baseline
from hri_sim.launch.reports import ReachReport
from hri_sim.launch.reproduce import demo_row, replay_row
from hri_sim.launch.summary import print_table, succeeded, summarise, write_summary
from hri_sim.media.frames import ReachMark, RunRecord
from hri_sim.scenario.schema import Scenario
from hri_sim.scenario.shipped import load_shipped


@pytest.fixture
def scenario() -> Scenario:
    return load_shipped("table_reach")


def _reports(
    scenario: Scenario, outcome: str = "reached", live_m: float | None = None
) -> list[ReachReport]:
    return [
        ReachReport(
            index=index,
            target=reach.robot_target,
            outcome=outcome,
            reason="why",
            cue_ns=index * 4_000_000_000,
            end_ns=index * 4_000_000_000 + 2_000_000_000,
            over_ns=index * 4_000_000_000 + 3_000_000_000,
            duration_s=12.34,
            replans=1234,
            min_clearance_m=live_m,
        )
        for index, reach in enumerate(scenario.reaches)
    ]


def _series(scenario: Scenario, until_s: float) -> Series:
    """A run whose recording ends at a time."""
    times = np.arange(0.0, until_s, 0.1)
    record = RunRecord(
        scenario=scenario,
        time_s=times,
        q=np.zeros((len(times), 7)),
        arms=np.zeros((len(times), len(scenario.persons), 4, 3)),
        clearance_m=np.full(len(times), 0.05),
        reaches=tuple(ReachMark(4.0 * i, 4.0 * i + 2.0) for i in range(len(scenario.reaches))),
    )
    empty = np.zeros(0)
    return Series(0, record, empty, empty, empty, empty, empty.astype(int), empty, empty, {}, 0)


@pytest.mark.parametrize("outcome", ["reached", "blocked"])
def test_a_run_without_a_recording(scenario: Scenario, tmp_path: Path, outcome: str) -> None:
    reports = _reports(scenario, outcome)
    summary = summarise(None, reports, scenario=scenario, bag=tmp_path / "bag", seed=1)
    write_summary(tmp_path / "summary.json", summary)
    read: dict[str, Any] = json.loads((tmp_path / "summary.json").read_text())
    assert read["outcome"] == outcome
    assert succeeded(read) is (outcome == "reached")
    assert read["touched"] is None
    assert read["mocap_rate_hz"] is None
    for reach in read["reaches"]:
        assert reach["duration_s"] == 12.34
        for name in ("goal_error_m", "min_clearance_m", "deadline_misses", "max_handover_jump_rad"):
            assert reach[name] is None
    console = Console(file=io.StringIO(), width=80)
    print_table(console, read)
    assert "recording ended" in console.file.getvalue()  # type: ignore[attr-defined]
    assert demo_row(1, read).count("–") == 5


def test_a_recording_that_ends_early_says_nothing_of_the_later_reaches(
    scenario: Scenario, tmp_path: Path
) -> None:
    reports = _reports(scenario)
    assert len(reports) > 1
    series = _series(scenario, 4.5)
    summary = summarise(series, reports, scenario=scenario, bag=tmp_path, seed=1)
    first, second, *_ = summary["reaches"]
    assert first["min_clearance_m"] == pytest.approx(0.05)
    assert first["deadline_misses"] == 0
    assert second["goal_error_m"] is None
    assert second["min_clearance_m"] is None
    assert second["deadline_misses"] is None
    assert summary["touched"] is None
    # The worst of all is not known when one is not.
    assert demo_row(1, summary).split("|")[3:5] == [" – ", " – "]
    assert replay_row("x", summary, None).split("|")[4] == " – "
    whole = _series(scenario, 4.0 * len(reports))
    assert summarise(whole, reports, scenario=scenario, bag=tmp_path, seed=1)["touched"] is False
    console = Console(file=io.StringIO(), width=80)
    print_table(console, summary)
    assert "too busy" not in console.file.getvalue()  # type: ignore[attr-defined]
    summary["reaches"][0]["deadline_misses"] = 200
    print_table(console, summary)
    assert "plans were late and dropped" in console.file.getvalue()  # type: ignore[attr-defined]
    monitored = Console(file=io.StringIO(), width=120)
    print_table(monitored, summary | {"separation": MEASURED})
    said = monitored.file.getvalue()  # type: ignore[attr-defined]
    assert "before the monitor changed that" in said
    assert "too busy" not in said
    whole.record.clearance_m[0] = 0.0
    assert summarise(whole, reports, scenario=scenario, bag=tmp_path, seed=1)["touched"] is True


@pytest.mark.parametrize(("live_m", "touched"), [(0.03, False), (-0.002, True)])
def test_what_was_seen_live_counts_where_the_recording_ended(
    scenario: Scenario, tmp_path: Path, live_m: float, touched: bool
) -> None:
    reports = _reports(scenario, live_m=live_m)
    for until_s in (4.5, 6.5):  # the robot was there, but the person was not through
        series = _series(scenario, until_s)
        summary = summarise(series, reports, scenario=scenario, bag=tmp_path, seed=1)
        first, second, *_ = summary["reaches"]
        assert first["min_clearance_m"] == pytest.approx(0.05)
        assert second["min_clearance_m"] == live_m
        assert summary["touched"] is touched
        assert succeeded(summary) is not touched
    unrecorded = summarise(None, reports, scenario=scenario, bag=tmp_path, seed=1)
    assert [reach["min_clearance_m"] for reach in unrecorded["reaches"]] == [live_m] * len(reports)
    assert unrecorded["touched"] is touched


def test_a_run_with_nobody(scenario: Scenario, tmp_path: Path) -> None:
    alone = scenario.model_copy(
        update={
            "persons": (),
            "reaches": tuple(
                r.model_copy(update={"person_target": None}) for r in scenario.reaches
            ),
        }
    )
    reports = _reports(alone)
    series = _series(alone, 4.0 * len(reports))
    series.record.clearance_m[:] = np.inf  # as read_run has it
    summary = summarise(series, reports, scenario=alone, bag=tmp_path, seed=1)
    write_summary(tmp_path / "summary.json", summary)
    assert summary["mocap_rate_hz"] is None
    assert [reach["min_clearance_m"] for reach in summary["reaches"]] == [None] * len(reports)
    assert summary["touched"] is False
    console = Console(file=io.StringIO(), width=80)
    print_table(console, summary)
    said: str = console.file.getvalue()  # type: ignore[attr-defined]
    assert said.count("nobody") == len(reports)
    assert "inf" not in said


def test_a_run_that_was_broken_off(scenario: Scenario, tmp_path: Path) -> None:
    reports = _reports(scenario)
    for begun in (0, 1):
        summary = summarise(None, reports[:begun], scenario=scenario, bag=tmp_path, seed=1)
        assert summary["outcome"] == "interrupted"
        assert len(summary["reaches"]) == begun
        assert summary["touched"] is None
        print_table(Console(file=io.StringIO()), summary)


def test_no_baseline_for_what_was_not_recorded(scenario: Scenario) -> None:
    record = with_baseline(_series(scenario, 1.5).record)
    assert record.baseline is None
    record = with_baseline(_series(scenario, 4.5).record)
    assert record.baseline is not None
    assert record.baseline.time_s[-1] == pytest.approx(4.5, abs=0.2)


def test_the_table_fits_80_columns() -> None:
    reach = {
        "outcome": "unreachable",
        "reason": "why",
        "goal_error_m": 0.1234,
        "min_clearance_m": -0.1234,
        "baseline_min_clearance_m": -0.1234,
        "duration_s": 12.34,
        "replans": 12345,
        "deadline_misses": 1234,
        "max_handover_jump_rad": 0.012345,
    }
    summary = {
        "reaches": [reach] * 12,
        "touched": False,
        "latency_ms": {"mocap_to_trajectory": {"p50": None}},
    }
    console = Console(file=io.StringIO(), width=80)
    print_table(console, summary)
    text: str = console.file.getvalue()  # type: ignore[attr-defined]
    assert "…" not in text
    words = ("outcome", "error", "clear", "base", "time", "plans", "late", "jump", "mrad")
    head = "\n".join(text.splitlines()[:6])
    assert all(word in head for word in words)
    row = next(line for line in text.splitlines() if "unreachable" in line)
    for cell in ("123.4", "-12.3", "12.34", "12345", "1234", "12.345"):
        assert cell in row
