"""Every line of the table of faults that needs no real time, once."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from hri_sim.faults.capture import CAPTURE, GRAPHS
from hri_sim.faults.catalogue import FAULTS
from hri_sim.faults.disturbances import DISTURBANCES, clock_graph, death, reset_graph
from hri_sim.faults.models import TOGETHER
from hri_sim.faults.motion import PTOMP, lockstep
from hri_sim.faults.processes import MONITORED
from hri_sim.reliability.fault import PROCESSES, Fault, Place, Result

QUICK = [fault for fault in FAULTS if fault.kind != PROCESSES]


OTHER_GRAPHS = {
    "clock_back": (3, 6),
    "clock_ahead": (3, 6),
    "reset": (2, 4, 6),
    "two_bodies": (3, 6),
    "wrong_units": (1, 4),
    "mocap_swapped": (2, 3),
    "source_clock_back": (1, 4),
    "wrong_frame": (2,),
}
"""Repetitions with a policy, or with a monitor. Of motion capture each of the other lines has one of the
other graphs, and of disturbances the second repetition a monitor; the report has all, many times."""


def other_seeds(fault: Fault) -> tuple[int, ...]:
    """Repetitions of a line that are looked at besides the first."""
    if fault.name in OTHER_GRAPHS:
        return OTHER_GRAPHS[fault.name]
    return (1 + CAPTURE.index(fault) % (len(GRAPHS) - 1),) if fault in CAPTURE else (1,)


def test_repetitions_have_other_graphs() -> None:
    assert [clock_graph(seed) for seed in (3, 6)] == [("policy", "off"), ("ptomp", "measured")]
    assert [reset_graph(seed) for seed in OTHER_GRAPHS["reset"]] == [
        ("ptomp", "measured"),
        ("policy", "off"),
        ("policy", "measured"),
    ]
    assert GRAPHS[1:3] == (("ptomp", "measured"), ("policy", "off"))
    assert len(set(GRAPHS)) == len(GRAPHS) == 5
    assert {*OTHER_GRAPHS} <= {fault.name for fault in (*CAPTURE, *DISTURBANCES)}
    looked_at = [seed % len(GRAPHS) for fault in CAPTURE for seed in other_seeds(fault)]
    assert min(looked_at.count(index) for index in range(1, len(GRAPHS))) >= 3


@pytest.fixture(scope="session")
def keep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Libraries, which take a while to make."""
    return tmp_path_factory.mktemp("keep")


@pytest.mark.parametrize("fault", QUICK, ids=lambda fault: fault.name)
def test_a_line(fault: Fault, tmp_path: Path, keep: Path) -> None:
    check(fault, 0, tmp_path, keep)


@pytest.mark.parametrize(
    ("fault", "seed"),
    [
        (fault, seed)
        for fault in (*CAPTURE, *DISTURBANCES)
        for seed in other_seeds(fault)
        if not fault.name.startswith(("death_", "overload"))
    ],
    ids=lambda value: getattr(value, "name", value),
)
def test_a_line_with_another_graph(fault: Fault, seed: int, tmp_path: Path, keep: Path) -> None:
    check(fault, seed, tmp_path, keep)


@pytest.mark.parametrize("victim", MONITORED)
def test_a_death_beside_a_monitor(victim: str, tmp_path: Path, keep: Path) -> None:
    """As the report has it with processes, in real time."""
    (fault,) = (one for one in DISTURBANCES if one.name == f"death_of_{victim}")
    beside = replace(fault, measure=lockstep(partial(death, victim, PTOMP, "measured")))
    check(beside, 1, tmp_path, keep)


def check(fault: Fault, seed: int, tmp_path: Path, keep: Path) -> None:
    result = Result(fault, tuple(fault.measure([seed], Place(tmp_path, keep, smoke=True))))
    (trial,) = result.trials
    assert set(trial.figures) <= {figure.key for figure in fault.figures}
    assert result.met, "\n".join(result.misses())
    if fault.name.endswith("_models") and fault.name != "wrong_models":
        assert 0 < (trial.figures["refused"] or 0.0) <= TOGETHER


def test_every_other_node_refuses_the_wrong_messages_too(tmp_path: Path, keep: Path) -> None:
    (fault,) = (fault for fault in QUICK if fault.name == "wrong_hri_msgs")
    result = Result(fault, tuple(fault.measure(range(1, fault.count), Place(tmp_path, keep))))
    assert len({trial.said.partition(":")[0] for trial in result.trials}) == fault.count - 1
    assert result.met, "\n".join(result.misses())


def test_same_repetition_same_figures(tmp_path: Path, keep: Path) -> None:
    (fault,) = (fault for fault in QUICK if fault.name == "mocap_outliers")
    found = [
        list(fault.measure([0], Place(tmp_path / name, keep, smoke=True))) for name in ("a", "b")
    ]
    assert found[0][0].figures["jump_rad"] == found[1][0].figures["jump_rad"]
