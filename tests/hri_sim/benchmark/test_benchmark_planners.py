"""The benchmark as a whole: figures, rows, the command line, one or many workers."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hri_prediction.errors import ConfigError
from hri_sim.benchmark import command, rows
from hri_sim.benchmark.conditions import task_conditions
from hri_sim.benchmark.intervals import share_interval
from hri_sim.benchmark.outcome import Outcome
from hri_sim.benchmark.planners import NOMINAL, ORACLE, PLANNERS
from hri_sim.benchmark.report import mean_table, paired_table, report
from hri_sim.benchmark.rows import Done, RowFile, Unit
from hri_sim.benchmark.run import Plan, marks, run_benchmark
from hri_sim.benchmark.summary import SHARES, compare, summarise, task_means

GOOD = Outcome(0.06, 0.02, 1e-5, 1e-4, 1.5, 1.0, 0.01, 30.0, 0.4, 42, 0, 900)
BAD = replace(GOOD, clearance=-0.01, time_to_collision=0.0)
LOST = replace(
    GOOD, time_to_goal=None, hold_clearance=None, hold_error=None, time_to_collision=None
)
SMALL = Plan((PLANNERS[NOMINAL],), "test", 1.0, (0, 1), (0, 4), 2)
CLUSTER = Path(__file__).with_name("cluster.py")


def run_main(monkeypatch, *arguments) -> int:
    monkeypatch.setattr("sys.argv", ["script", *map(str, arguments)])
    with pytest.raises(SystemExit) as stop:
        command.main()
    return int(stop.value.code or 0)


def outcomes_of(plan: Plan, make) -> dict[Unit, Done]:
    return {unit: Done(unit, tuple(make(unit)), 1.0) for unit in plan.units}


def test_figures_of_known_outcomes():
    done = outcomes_of(SMALL, lambda unit: (GOOD, BAD) if unit.task == 0 else (GOOD, LOST))
    results = summarise(SMALL, done)
    figures = results["planners"][NOMINAL]
    assert results["seeds"] == [0, 1]
    assert (results["conditions"], results["shares"]["ambiguous"]) == (4, 0.5)
    assert (figures["ok"], figures["strict"], figures["clearance_5cm"]) == (0.5, 0.5, 0.5)
    assert figures["time_to_goal_s"] == 1.5
    assert figures["time_to_collision_s"] == pytest.approx((4 * 0.4 + 2 * 0.0) / 6)
    assert figures["ambiguous"]["clearance_m"] == pytest.approx(0.06)
    assert results["oracle_feasible"] == 0.5
    assert figures["iterations"] == GOOD.iterations == LOST.iterations
    assert f"| {GOOD.iterations} |" in mean_table(results["planners"])
    assert results["trained_for_another_planner"] == []
    assert "Warning" not in report(results)
    assert "Warning: trained" in report({**results, "trained_for_another_planner": ["gpr_f8"]})
    moving = [
        (task, c.number)
        for task in SMALL.tasks
        for c in task_conditions("test", task).conditions[:2]
        if c.staying_clearance > 0.0
    ]
    assert results["shares"]["person_must_move"] == len(moving) / 4
    good = sum(number == 0 for _, number in moving)
    assert figures["person_must_move"]["ok"] == pytest.approx(good / len(moving))
    assert set(figures["ci95"]) >= set(SHARES) == set(figures["ci95_bootstrap"])
    json.dumps(results, allow_nan=False)


def test_differences_are_of_the_same_tasks():
    """What makes tasks hard for both drops out: ten points are sure where shares are not."""
    rng = np.random.default_rng(3)
    worse = {t: [GOOD] * k + [BAD] * (20 - k) for t, k in enumerate(rng.integers(2, 16, 30))}
    better = {t: [GOOD, GOOD, *found[:-2]] for t, found in worse.items()}
    found = compare(better, worse)
    assert found["ok"] == pytest.approx(0.1)
    low, high = found["ci95"]["ok"]
    assert 0.05 < low < 0.1 < high < 0.15
    low, high = share_interval(task_means(worse, SHARES["ok"]))
    assert high - low > 0.1


def test_means_are_compared_motion_by_motion():
    slow = replace(GOOD, time_to_goal=GOOD.time_to_goal + 0.5)
    ours = {t: [GOOD, LOST, GOOD] for t in range(10)}
    theirs = {t: [slow, slow, LOST] for t in range(10)}
    found = compare(ours, theirs)
    assert found["time_to_goal_s"] == pytest.approx(-0.5)  # of the one motion that both have
    assert found["ci95"]["time_to_goal_s"] == pytest.approx([-0.5, -0.5])
    assert "-0.50 (-0.50 to -0.50)" in paired_table({"a - b": found})
    nothing = compare({0: [LOST]}, {0: [LOST]})
    assert nothing["accel_cost"] is None
    assert "–" in paired_table({"a - b": nothing})


def test_no_arrival_leaves_no_times():
    figures = summarise(SMALL, outcomes_of(SMALL, lambda unit: (LOST, LOST)))["planners"][NOMINAL]
    assert figures["ok"] == 0.0
    assert figures["time_to_goal_s"] is None
    assert figures["ci95"]["time_to_goal_s"] is None


def test_rows_outlive_an_interruption(tmp_path):
    path, keep = tmp_path / "rows.jsonl", marks(SMALL)
    file = RowFile(path, keep, Outcome)
    first, second = SMALL.units[:2]
    file.add(Done(first, (GOOD, LOST), 1.25))
    with path.open("a") as stream:
        stream.write('{"planner": "nominal", "se')  # killed while it wrote
    assert RowFile(path, keep, Outcome).read() == {first: Done(first, (GOOD, LOST), 1.25)}
    file.add(Done(second, (BAD, BAD), 2.0))
    assert set(file.read()) == {first, second}
    assert RowFile(path, {**keep, NOMINAL: "of other code"}, Outcome).read() == {}


def test_marks_tell_what_outcomes_depend_on():
    ours = marks(SMALL)
    for other in (
        replace(SMALL, split="tuning"),
        replace(SMALL, slowdown=8.0),
        replace(SMALL, conditions=3),
        replace(SMALL, planners=(replace(PLANNERS[NOMINAL], settings=(("margin", 0.05),)),)),
    ):
        assert marks(other)[NOMINAL] != ours[NOMINAL]
    assert marks(replace(SMALL, slowdown=8.0))[ORACLE] == ours[ORACLE]
    assert marks(replace(SMALL, seeds=(0, 1, 2))) == ours


def test_more_seeds_do_only_what_is_missing(tmp_path, monkeypatch):
    asked = []

    def do_all(work, items, *, workers, scheduler):
        asked.append(len(items))
        yield from (Done(unit, (GOOD, GOOD), 0.0) for unit in items)

    monkeypatch.setattr(rows, "do_all", do_all)
    for seeds in ((0,), (0, 1), (0, 1)):
        run_benchmark(replace(SMALL, seeds=seeds), tmp_path / "rows.jsonl")
    assert asked == [4, 2]


def test_command_resumes_and_gives_the_same_file_for_any_number_of_workers(tmp_path, monkeypatch):
    options = ("--smoke", "--budget", 64, "--planners", "ptomp", "--split", "tuning")
    assert run_main(monkeypatch, "--out", tmp_path / "a", *options, "--workers", 1) == 0
    assert {path.name for path in (tmp_path / "a").iterdir()} == {
        "results.json",
        "results.md",
        "run.json",
        "rows.jsonl",
        "success.png",
        "clearance.png",
    }
    text = (tmp_path / "a" / "results.json").read_text()
    results = json.loads(text)
    assert (results["split"], results["budget"], results["seeds"]) == ("tuning", 64.0, [0])
    assert set(results["planners"]) == {"ptomp"}
    assert results["conditions"] == 4
    found = results["planners"]["ptomp"]
    assert {"ok", "strict", "clearance_2cm", "clearance_5cm", "accel_cost"} <= set(found["ci95"])
    rows = (tmp_path / "a" / "rows.jsonl").read_text().splitlines()
    assert len(rows) == 4  # two tasks, and the oracle's
    # Broken off after two rows, gone on with two workers.
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "rows.jsonl").write_text("\n".join(rows[:2]) + "\n")
    assert run_main(monkeypatch, "--out", tmp_path / "b", *options, "--workers", 2) == 0
    assert (tmp_path / "b" / "results.json").read_text() == text
    assert "`ptomp`" in (tmp_path / "b" / "results.md").read_text()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--planners", "rrt"), "ptomp, .*, nominal"),
        (("--planners", ","), "ptomp, .*, nominal"),
        (("--budget", "2"), "1, 8, 64, 512"),
        (("--split", "all"), "tuning, test"),
        (("--execute", "gazebo"), "paper, mujoco"),
        (("--person", "dances"), "usual, stops, changes-target"),
        (("--latency-ms", "-1"), "0 to 90 ms"),
        (("--smoke", "--planners", "nominal", "--scheduler", "nowhere"), "nowhere"),
    ],
)
def test_wrong_arguments_say_what_is_right(tmp_path, monkeypatch, arguments, message):
    monkeypatch.setattr("sys.argv", ["script", "--out", str(tmp_path / "out"), *arguments])
    with pytest.raises(ConfigError, match=message):
        command.app(standalone_mode=False)


def test_dask_gives_the_same_file(tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    options = ("--smoke", "--planners", "nominal")
    assert run_main(monkeypatch, "--out", tmp_path / "here", *options, "--workers", 1) == 0
    with subprocess.Popen(
        [sys.executable, str(CLUSTER)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as cluster:
        try:
            address = cluster.stdout.readline().strip()
            assert address.startswith("tcp://127.0.0.1")
            # A process of its own: the client's threads are not ours to clean up.
            text = "from hri_sim.benchmark.command import main; main()"
            arguments = ("--out", str(tmp_path / "there"), *options, "--scheduler", address)
            done = subprocess.run(
                [sys.executable, "-c", text, *arguments], capture_output=True, text=True
            )
            assert done.returncode == 0, done.stderr
        finally:
            cluster.stdin.close()
            cluster.wait(timeout=30)
    here, there = ((tmp_path / name / "results.json").read_text() for name in ("here", "there"))
    assert here == there
