"""What is met and what is missed, and the files that say so."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

sys.path.insert(0, str(Path(__file__).parent))

from soak_records import BEGUN, CANCELLED, ENDED, KILLED, REACHED, TOUCHED, write_record

from hri_prediction.errors import DataError
from hri_sim.launch.soak import app
from hri_sim.soak.contacts import Contact
from hri_sim.soak.judging import LONG_S, figures, missed
from hri_sim.soak.judging import verdict as summary
from hri_sim.soak.log import BEGIN, LOG, SoakLog, read_log
from hri_sim.soak.report import FIGURES, PICTURE, TEXT, report, write_report


def judged(folder: Path, contacts: Sequence[Contact] | None = (TOUCHED,)) -> dict[str, Any]:
    """What is in soak.json, without the files."""
    return figures(read_log(folder / LOG), np.random.default_rng(0), contacts)


def verdict(content: dict[str, Any], words: str) -> dict[str, Any]:
    (bar,) = [bar for bar in content["bars"] if words in bar["what"]]
    return bar


def test_a_run_in_which_all_went_well(tmp_path: Path) -> None:
    content = write_report(write_record(tmp_path))
    assert not missed(content)
    assert [bar["needs"] for bar in content["bars"] if not bar["met"]] == ["a bag"]
    assert json.loads((tmp_path / FIGURES).read_text()) == content
    text = (tmp_path / TEXT).read_text()
    assert "**missed**" not in text
    assert "| kill | ptomp | 1 | 1/1 | 150 | 20 | 6.0 | 1/1 | 9.0 | – |" in text
    judged = len(content["bars"]) - 1
    assert f"\n{judged} of {judged} judged bars met; 1 not judged" in text
    assert "| bag | 150.0 | 10.0 | 900000 | yes | whole |" in text
    assert (tmp_path / PICTURE).stat().st_size > 20_000
    assert content["rates_hz"] == {"person": 250.0}
    assert content["files"]["mb_per_minute"] == pytest.approx([15.0] * 3)
    # Of the two lives of ptomp only the second is long enough.
    lives = {(row["node"], row["growth"] is not None) for row in content["memory"]}
    assert lives == {("person", True), ("ptomp", True), ("ptomp", False)}
    assert content["memory"][0]["cores"] == pytest.approx(0.25)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"leak": 0.07}, "process' memory"),
        ({"slower": 0.5}, "processor time"),
        ({"faults": ({**KILLED, "rest_ms": 230.0},)}, "at rest"),
        ({"faults": ({**KILLED, "rest_ms": None},)}, "at rest"),
        ({"faults": ({**KILLED, "named_ms": 1200.0},)}, "named"),
        ({"faults": ({**KILLED, "named_ms": None},)}, "named"),
        ({"faults": ({**KILLED, "reached_s": None},)}, "after the fault"),
        ({"faults": ({**CANCELLED, "as_wanted": False},)}, "end as they should"),
        ({"reaches": ({**REACHED, "outcome": "blocked"},)}, "without a fault"),
        ({"deaths": ({"s": 3.0, "node": "person", "wanted": False},)}, "by themselves"),
        ({"end": {**ENDED, "not_finite": 2}}, "not finite"),
        ({"end": {**ENDED, "orphans": ["ptomp (7)"]}}, "processes left"),
        ({"end": {**ENDED, "shared_left": ["fastrtps_1"]}}, "shared memory"),
        ({"end": {**ENDED, "bags": [{**ENDED["bags"][0], "error": "damaged"}]}}, "bags"),  # type: ignore[index]
        ({"end": {**ENDED, "broken": "Ctrl-C"}}, "the run"),
        ({"end": None}, "the end of the run"),
    ],
)
def test_each_thing_that_is_missed_is_named(
    tmp_path: Path, changed: dict[str, Any], words: str
) -> None:
    content = judged(write_record(tmp_path, **changed))
    assert missed(content)
    assert [bar["what"] for bar in content["bars"] if bar["met"] is False] == [
        verdict(content, words)["what"]
    ]
    assert "**missed**" in report(content)


@pytest.mark.parametrize(
    "fault",
    [
        {**KILLED, "moving": False, "rest_ms": 0.0},  # it stood already
        {**KILLED, "node": "recorder", "rest_ms": None},  # nobody needs it
        {**CANCELLED, "rest_ms": 900.0},  # that is no fault of a node
    ],
)
def test_who_must_be_at_rest(tmp_path: Path, fault: dict[str, Any]) -> None:
    content = judged(write_record(tmp_path, faults=(fault,)))
    assert verdict(content, "at rest")["met"] is None
    assert not missed(content)


def test_what_is_not_judged_is_named_and_not_met(tmp_path: Path) -> None:
    content = judged(write_record(tmp_path, faults=(), seconds=45))
    unjudged = {bar["what"]: bar["needs"] for bar in content["bars"] if bar["met"] is None}
    assert {"growth of a process' memory", "a death is named"} < unjudged.keys()
    assert unjudged["growth of a process' memory"] == "a run of 5 minutes"
    assert not missed(content)
    met = sum(bar["met"] is True for bar in content["bars"])
    said = summary(content)
    assert said.startswith(f"{met} of {met} judged bars met; {len(unjudged)} not judged: ")
    assert met + len(unjudged) == len(content["bars"])
    assert "growth of a process' memory (needs a run of 5 minutes)" in said
    assert "a death is named (needs at least one)" in said
    assert said in report(content)
    assert "| growth of a process' memory | no process lived long enough | ≤ 5% | not judged |" in (
        report(content)
    )


def test_what_is_missed_beside_what_is_not_judged_counts_by_itself(tmp_path: Path) -> None:
    content = judged(write_record(tmp_path, end={**ENDED, "not_finite": 1}, seconds=45))
    assert missed(content)
    count = sum(bar["met"] is not None for bar in content["bars"])
    assert summary(content).startswith(f"{count - 1} of {count} judged bars met; ")


def test_a_long_run_without_growth_to_judge_is_missed(tmp_path: Path) -> None:
    # The processes are new in each sample, so that none lives long enough.
    content = judged(write_record(tmp_path, seconds=int(LONG_S) + 2, lasting=()))
    assert verdict(content, "process' memory")["met"] is False
    assert missed(content)
    content = judged(write_record(tmp_path / "short", seconds=int(LONG_S) - 2, lasting=()))
    assert verdict(content, "process' memory")["met"] is None
    assert not missed(content)


def test_processes_that_are_too_young_to_be_judged_are_named(tmp_path: Path) -> None:
    content = judged(write_record(tmp_path, lasting=("person",)))
    bar = verdict(content, "process' memory")
    assert bar["measured"].endswith("1 of 2 judged, too short: ptomp")


def test_disturbed_goals_may_fail(tmp_path: Path) -> None:
    lost = {**REACHED, "outcome": "lost_input", "disturbed": True}
    content = judged(write_record(tmp_path, reaches=(lost,)))
    assert verdict(content, "without a fault")["met"] is None


def test_a_run_that_ended_at_once(tmp_path: Path) -> None:
    with SoakLog(tmp_path / LOG) as log:
        log.write(BEGIN, BEGUN)
    content = write_report(tmp_path)
    assert [bar["what"] for bar in content["bars"] if bar["met"] is False] == ["the end of the run"]
    with pytest.raises(DataError):
        write_report(tmp_path / "elsewhere")


def test_contacts_are_told_whatever_they_were(tmp_path: Path) -> None:
    gave_way = replace(TOUCHED, approach=-0.3, robot_part="upper_arm")
    content = judged(write_record(tmp_path), (TOUCHED, gave_way))
    bar = verdict(content, "comes at the person")
    assert bar["met"] is True
    assert bar["measured"] == "0 of 2 contacts; 1 with more than 0.02 m/s, at most +0.10 m/s"
    assert "| 0.1 | 0.50 | -0.30 | upper_arm | ann/forearm |" in report(content)
    assert "Nobody was touched." in report(judged(tmp_path, ()))


def test_a_robot_that_comes_at_somebody_too_fast_is_missed(tmp_path: Path) -> None:
    content = judged(write_record(tmp_path), (TOUCHED, replace(TOUCHED, approach=0.16)))
    assert [bar["what"] for bar in content["bars"] if bar["met"] is False] == [
        "contacts in which the robot comes at the person with more than 0.15 m/s"
    ]


def test_without_a_bag_contacts_are_not_judged(tmp_path: Path) -> None:
    content = write_report(write_record(tmp_path))
    assert verdict(content, "comes at the person")["met"] is None
    assert content["contacts"] is None
    assert "no bag" in (tmp_path / TEXT).read_text()
    (tmp_path / "bag").mkdir()  # one that cannot be read
    assert verdict(write_report(tmp_path), "comes at the person")["met"] is None


def test_the_folder_of_another_run_is_refused_and_left_as_it_is(tmp_path: Path) -> None:
    write_report(write_record(tmp_path))
    before = {path: path.read_bytes() for path in sorted(tmp_path.iterdir())}
    refused = CliRunner().invoke(app, ["--minutes", "1", "--out", str(tmp_path)])
    assert refused.exit_code == 1
    assert "is not empty" in refused.output
    assert "memory" not in refused.output  # no table of the other run
    assert {path: path.read_bytes() for path in sorted(tmp_path.iterdir())} == before


def test_a_folder_that_cannot_be_made_is_not_called_a_full_disk() -> None:
    refused = CliRunner().invoke(app, ["--minutes", "1", "--out", "/proc/soak"])
    assert refused.exit_code == 1
    assert "cannot write to --out /proc/soak" in " ".join(refused.output.split())
