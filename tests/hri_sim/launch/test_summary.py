"""What is said of a run: the table, and the figures when the recording is missing."""

from __future__ import annotations

import io
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from hri_planner.separation.config import MEASURED
from hri_sim.launch.record import Series, gaps_of, with_baseline
from hri_sim.launch.reports import ReachReport
from hri_sim.launch.reproduce import demo_row, replay_row
from hri_sim.launch.summary import print_table, succeeded, summarise, write_summary
from hri_sim.media.frames import BaselineTrack, ReachMark, RunRecord
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
    assert read["recording_ended_early_s"] is None
    for reach in read["reaches"]:
        assert reach["duration_s"] == 12.34
        for name in ("goal_error_m", "min_clearance_m", "deadline_misses", "max_handover_jump_rad"):
            assert reach[name] is None
    console = Console(file=io.StringIO(), width=80)
    print_table(console, read)
    assert "not recorded from begin to end" in console.file.getvalue()  # type: ignore[attr-defined]
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
    last_s = 4.0 * (len(reports) - 1) + 3.0  # when the last reach was over
    assert summary["recording_ended_early_s"] == pytest.approx(last_s - 4.4)
    # The worst of all is not known when one is not.
    assert demo_row(1, summary).split("|")[3:5] == [" – ", " – "]
    assert replay_row("x", summary, None).split("|")[4] == " – "
    whole = _series(scenario, 4.0 * len(reports))
    of_whole = summarise(whole, reports, scenario=scenario, bag=tmp_path, seed=1)
    assert of_whole["touched"] is False
    assert of_whole["recording_ended_early_s"] == 0.0
    console = Console(file=io.StringIO(), width=80)
    print_table(console, summary)
    assert "too busy" not in console.file.getvalue()  # type: ignore[attr-defined]
    summary["reaches"][0]["deadline_misses"] = 200
    print_table(console, summary)
    late = console.file.getvalue()  # type: ignore[attr-defined]
    assert re.search(r"200 of \d+ plans \(\d+%\) were late and dropped, more than 10%", late)
    frozen = Console(file=io.StringIO(), width=200)
    print_table(frozen, summary | {"stopped_s": {"ptomp": 20.04}})
    said = frozen.file.getvalue()  # type: ignore[attr-defined]
    assert "late and dropped: ptomp was stopped for 20.0 s" in said
    assert "too busy" not in said
    taken = Console(file=io.StringIO(), width=200)
    print_table(taken, summary | {"host_share": 0.083})
    said = taken.file.getvalue()  # type: ignore[attr-defined]
    assert "late and dropped; the host of this virtual machine took 8% of its" in said
    assert "more than 10%: the machine was too busy" in said
    quiet = Console(file=io.StringIO(), width=200)
    print_table(quiet, summary | {"host_share": 0.003})
    assert "host" not in quiet.file.getvalue()  # type: ignore[attr-defined]
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


@pytest.mark.parametrize(
    ("misses", "told", "busy"), [(2, False, False), (5, True, False), (11, True, True)]
)
def test_a_machine_is_called_busy_when_a_tenth_of_the_plans_is_late(
    misses: int, told: bool, busy: bool
) -> None:
    reach = {
        "outcome": "reached", "reason": "", "goal_error_m": 0.0, "min_clearance_m": 0.1,
        "baseline_min_clearance_m": 0.1, "duration_s": 2.0, "replans": 100 - misses,
        "deadline_misses": misses, "max_handover_jump_rad": 0.0,
    }  # fmt: skip
    summary = {
        "reaches": [reach],
        "touched": False,
        "latency_ms": {"mocap_to_trajectory": {"p50": None}},
    }
    console = Console(file=io.StringIO(), width=200)
    print_table(console, summary)
    said: str = console.file.getvalue()  # type: ignore[attr-defined]
    assert (f"{misses} of 100 plans ({misses}%) were late" in said) is told
    assert ("too busy" in said) is busy


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


def test_a_recording_in_two_bags_tells_of_the_reaches_beside_the_gap(
    scenario: Scenario, tmp_path: Path
) -> None:
    reports = _reports(scenario, live_m=0.07)
    assert len(reports) > 2
    whole = _series(scenario, 4.0 * len(reports))
    times = np.arange(0.0, 4.0 * len(reports), 0.1)
    clearance = np.where((times > 5.0) & (times < 6.0), 0.01, 0.2)
    baseline = BaselineTrack(times, np.zeros((len(times), 7)), clearance)
    series = replace(whole, record=replace(whole.record, baseline=baseline), gaps_s=((4.8, 6.2),))
    summary = summarise(series, reports, scenario=scenario, bag=tmp_path, seed=1)
    first, second, third, *_ = summary["reaches"]
    assert first["goal_error_m"] is not None
    assert second["goal_error_m"] is None
    assert second["min_clearance_m"] == pytest.approx(0.07)  # seen live
    assert third["min_clearance_m"] == pytest.approx(0.05)
    # Where nobody was recorded the baseline is of people who are not known.
    assert summary["baseline_min_clearance_m"] == pytest.approx(0.2)
    assert summary["recording_gaps_s"] == [[4.8, 6.2]]
    console = Console(file=io.StringIO(), width=120)
    print_table(console, summary)
    said: str = console.file.getvalue()  # type: ignore[attr-defined]
    assert "nothing was recorded from 4.80 to 6.20 s" in said
    assert "reach 2 was not recorded from begin to end" in said
    assert "reach 3 was" not in said


def test_a_recorder_that_was_stopped_leaves_a_gap() -> None:
    times = np.concatenate((np.arange(0.0, 2.0, 0.004), np.arange(5.5, 8.0, 0.004)))
    nothing = np.zeros(0)
    ((begin, end),) = gaps_of(times, nothing, nothing)
    assert (begin, end) == pytest.approx((1.996, 5.5))
    # A recorder that died leaves one, too: the same one, seen from its bags, is told once.
    assert gaps_of(times, np.array([1.99, 5.51]), nothing) == ((1.99, 5.51),)
    between = np.array([2.5, 3.0, 7.0, 7.5])
    assert gaps_of(times, between, nothing) == ((begin, end), (7.0, 7.5))
    assert gaps_of(np.arange(0.0, 3.0, 0.004), nothing, nothing) == ()
    some_lost = np.delete(np.arange(0.0, 3.0, 0.004), slice(100, 120))
    assert gaps_of(some_lost, nothing, nothing) == ()


def test_a_simulator_that_was_stopped_leaves_none() -> None:
    """All others were recorded meanwhile; those of just before and after say nothing."""
    times = np.concatenate((np.arange(0.0, 2.0, 0.004), np.arange(5.5, 8.0, 0.004)))
    nothing = np.zeros(0)
    assert gaps_of(times, nothing, np.arange(0.0, 8.0, 0.02)) == ()
    on_time = np.concatenate((np.arange(0.0, 2.02, 0.02), np.arange(5.48, 8.0, 0.02)))
    assert len(gaps_of(times, nothing, on_time)) == 1


def test_a_run_that_was_broken_off(scenario: Scenario, tmp_path: Path) -> None:
    reports = _reports(scenario)
    for begun in (0, 1):
        summary = summarise(None, reports[:begun], scenario=scenario, bag=tmp_path, seed=1)
        assert summary["outcome"] == "interrupted"
        assert len(summary["reaches"]) == begun
        assert summary["touched"] is None
        console = Console(file=io.StringIO())
        print_table(console, summary)
        said: str = console.file.getvalue()  # type: ignore[attr-defined]
        assert f"{begun} of {len(reports)} reaches begun" in said


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
