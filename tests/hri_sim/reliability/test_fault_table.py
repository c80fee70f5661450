"""Faults: what is kept of them, when a bar is missed, and what the table says."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from hri_prediction.errors import ConfigError
from hri_prediction.results.progress import ProgressLine
from hri_sim.faults.catalogue import FAULTS
from hri_sim.faults.command import NAMES, chosen
from hri_sim.faults.processes import BESIDE
from hri_sim.launch.parameters import CONFIGURATIONS
from hri_sim.launch.run_node import installed_nodes
from hri_sim.reliability import kept, table
from hri_sim.reliability.fault import FILES, Fault, Figure, Place, Result, Skipped, Trial
from hri_sim.reliability.kept import bring_about, mark_of, module_of

REST = Figure("rest_ms", "at rest after", "ms", 200.0)
REACHED = Figure("reached", "reached", limit=1.0, least=True)
asked: list[int] = []


def measure(seeds: Sequence[int], place: Place) -> Iterator[Trial]:
    for seed in seeds:
        asked.append(seed)
        yield Trial(seed, {"rest_ms": 100.0 + 50.0 * seed, "reached": 1.0}, "it was silent")


def refuse(seeds: Sequence[int], place: Place) -> Iterator[Trial]:
    raise Skipped("no disk can be mounted here")
    yield


FAULT = Fault("noise", "noise", "it is loud", "it is heard", FILES, (REST, REACHED), measure)


@pytest.fixture
def progress(monkeypatch: pytest.MonkeyPatch) -> Iterator[ProgressLine]:
    asked.clear()
    # This file is no module of the project.
    monkeypatch.setattr(kept, "mark_of", lambda fault: "mark")
    with ProgressLine(Console(quiet=True)) as line:
        yield line


def test_repetitions_that_are_done_are_not_done_again(
    tmp_path: Path, progress: ProgressLine
) -> None:
    first = bring_about(FAULT, 2, tmp_path, progress)
    again = bring_about(FAULT, 4, tmp_path, progress)
    assert asked == [0, 1, 2, 3]
    assert again.trials[:2] == first.trials
    assert bring_about(FAULT, 1, tmp_path, progress, first_seed=3).trials == again.trials[3:]
    assert asked == [0, 1, 2, 3]
    assert not (tmp_path / "scratch" / "noise").exists()
    bring_about(FAULT, 1, tmp_path, progress, smoke=True)
    assert asked == [0, 1, 2, 3, 0], "a smoke run is something else"


def test_repetitions_say_which_commit_they_are_of(tmp_path: Path, progress: ProgressLine) -> None:
    bring_about(FAULT, 2, tmp_path, progress, origin="abc, 2026-01-01")
    result = bring_about(FAULT, 3, tmp_path, progress, origin="def, 2026-01-02")
    (said,) = table.kept_lines([result], "def, 2026-01-02")
    assert "Of 3 repetitions" in said
    assert "2 of commit abc, 2026-01-01." in said
    fresh = bring_about(FAULT, 1, tmp_path, progress, first_seed=3, origin="def, 2026-01-02")
    assert table.kept_lines([fresh], "def, 2026-01-02") == []


def test_a_bar_that_is_missed_once_is_missed(tmp_path: Path, progress: ProgressLine) -> None:
    result = bring_about(FAULT, 4, tmp_path, progress)
    assert not result.met
    assert (result.missed(REST), result.missed(REACHED)) == (1, 0)
    assert result.failed_seeds() == [3]
    assert (result.median(REST), result.worst(REST)) == (175.0, 250.0)
    text = "\n".join(table.lines([result]))
    assert "at rest after 175; 250 ms | **missed, 1 of 4**" in text
    assert "`scripts/reproduce_reliability.py --only noise --count 4`" in text
    assert "- noise: 3" in text
    assert "it was silent" in text


def test_what_was_said_does_not_tell_where_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HRI_PROJECT_ROOT", "/home/somebody/stack")
    said = "cannot read /home/somebody/stack/runs/bag"
    text = "\n".join(
        table.lines([Result(FAULT, (Trial(0, {"rest_ms": 1.0, "reached": 1.0}, said),))])
    )
    assert "cannot read runs/bag" in text
    assert "/home/somebody" not in text


def test_what_did_not_happen_is_missed() -> None:
    result = Result(FAULT, (Trial(0, {"rest_ms": None, "reached": 1.0}),))
    assert not result.met
    assert result.misses() == ["seed 0: at rest after: None ms (wanted ≤ 200.0); said: "]
    assert result.worst(REST) is None
    assert "never" in "\n".join(table.lines([result]))
    assert table.to_mapping(result)["figures"]["rest_ms"]["worst"] is None


def test_what_cannot_be_brought_about_is_said(tmp_path: Path, progress: ProgressLine) -> None:
    result = bring_about(replace(FAULT, measure=refuse), 3, tmp_path, progress)
    assert result.met
    assert "no disk can be mounted here | skipped" in "\n".join(table.lines([result]))
    # What was missed before that stays missed.
    before = Result(FAULT, (Trial(0, {"rest_ms": None, "reached": 1.0}),), result.skipped)
    assert not before.met
    said = "\n".join(table.lines([before]))
    assert "no disk can be mounted here" in said
    assert "**missed, 1 of 1**" in said


def test_every_line_has_a_name_of_its_own_and_a_bar() -> None:
    assert len(set(NAMES)) == len(NAMES)
    for fault in FAULTS:
        assert any(figure.limit is not None for figure in fault.figures), fault.name
        keys = [figure.key for figure in fault.figures]
        assert len(set(keys)) == len(keys), fault.name
        assert module_of(fault.measure).startswith("hri_sim.faults."), fault.name
    killed = [
        fault.name.removeprefix("kill_") for fault in FAULTS if fault.name.startswith("kill_")
    ]
    nodes = {name for name in killed if not name.endswith(BESIDE)}
    assert {name.removesuffix(BESIDE) for name in killed} == nodes
    assert nodes == {name for _, name in installed_nodes()}
    assert nodes == set(CONFIGURATIONS)
    assert nodes <= {fault.name.removeprefix("freeze_") for fault in FAULTS}
    processes = ("kill_", "freeze_")
    assert all(fault.count >= 20 for fault in FAULTS if fault.name.startswith(processes))


def test_the_wrong_messages_meet_every_node() -> None:
    (fault,) = (fault for fault in FAULTS if fault.name == "wrong_hri_msgs")
    assert fault.count == len(installed_nodes())


def test_lines_are_chosen_by_name() -> None:
    assert chosen(()) == (True, FAULTS)
    assert chosen(("encounters",)) == (True, ())
    only, (fault,) = chosen(("kill_ptomp",))
    assert not only
    assert fault.name == "kill_ptomp"
    with pytest.raises(ConfigError, match=r"--only noise; expected one of encounters, kill_"):
        chosen(("noise",))


def test_what_is_kept_is_of_this_code_alone() -> None:
    marks = {mark_of(fault) for fault in FAULTS if fault.name in ("kill_ptomp", "truncated_bags")}
    assert len(marks) == 2
