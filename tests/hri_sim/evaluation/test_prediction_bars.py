"""What is wanted of the predictor: one row for each bar and each set of reaches, misses shown."""

import pytest

from hri_prediction.evaluation.folds import LEAVE_ONE_OUT, WITHIN
from hri_sim.evaluation.bars import BAR_HEAD, Bar, bar_lines, bars


def evaluation(
    protocol: str, *, end=0.02, half=0.5, most=0.95, duration: float | None = 0.05, people=""
) -> dict:
    ours = {"endpoint_error_m": {"median": end}, "coverage50": half, "coverage95": most}
    return {
        "protocol": protocol,
        "predictors": {"promp": ours},
        "duration_error_s": {"0.3": {"median": 9.0}, "0.35": {"median": duration}},
        **({"people": people} if people else {}),
    }


def test_each_bar_is_held_against_each_set_of_reaches_it_is_for():
    results = {
        f"{data}_{protocol}": evaluation(protocol, people=people)
        for data, people in (("adl", ""), ("dfki", ""), ("matched", "matched"))
        for protocol in (WITHIN, LEAVE_ONE_OUT)
    }
    found = bars(results)
    assert all(bar.met for bar in found)
    kinds = [bar.what for bar in found]
    assert [kinds.count(what) for what in dict.fromkeys(kinds)] == [2, 4, 4, 2]
    assert len({(bar.what, bar.reaches) for bar in found}) == len(found) == 12
    assert sum("DFKI" in bar.reaches for bar in found) == 4
    assert bar_lines(results)[0].startswith("Wanted and measured, of `promp`: 12 met, 0 missed.")


def test_misses_are_shown_as_such():
    results = {
        f"adl_{LEAVE_ONE_OUT}": evaluation(LEAVE_ONE_OUT, end=0.0471, half=0.531, most=0.984),
        f"dfki_{WITHIN}": evaluation(WITHIN, half=0.3),
        f"via_points_{LEAVE_ONE_OUT}": evaluation(
            LEAVE_ONE_OUT, duration=0.143, people="via_points"
        ),
    }
    lines = bar_lines(results)
    assert "2 met, 4 missed" in lines[0]
    assert lines[2] == BAR_HEAD
    assert lines[3:9] == [
        "| median end-point error [mm] | seated reaches (ADL), leave-one-subject-out | 47.1 | ≤ 47 "
        "| **missed** |",
        "| points within the 50 % region [%] | seated reaches (ADL), leave-one-subject-out | 53.1 "
        "| 42–58 | met |",
        "| points within the 50 % region [%] | pick and place (DFKI), within | 30.0 | 42–58 "
        "| **missed** |",
        "| points within the 95 % region [%] | seated reaches (ADL), leave-one-subject-out | 98.4 "
        "| 90–98 | **missed** |",
        "| points within the 95 % region [%] | pick and place (DFKI), within | 95.0 | 90–98 | met |",
        "| median duration error [ms] | simulated, `via_points`, leave-one-subject-out | 143.0 "
        "| ≤ 80 | **missed** |",
    ]


@pytest.mark.parametrize(
    ("measured", "met"), [(42.0, True), (58.0, True), (41.99, False), (58.01, False), (None, False)]
)
def test_ends_of_a_range_belong_to_it_and_nothing_measured_is_a_miss(measured, met):
    bar = Bar("what", "reaches", measured, 42.0, 58.0)
    assert bar.met == met
    assert bar.row.endswith("| met |" if met else "| **missed** |")


def test_exact_ends_survive_the_change_of_units():
    results = {f"adl_{WITHIN}": evaluation(WITHIN, end=0.041, half=0.58, most=0.98)}
    assert all(bar.met for bar in bars(results))
    unseen = {f"x_{WITHIN}": evaluation(WITHIN, duration=None, people="matched")}
    assert not bars(unseen)[0].met
    assert "| – |" in bars(unseen)[0].row


def test_no_bar_no_table():
    assert bar_lines({}) == []
