"""From statuses to rows: states, growth, silence, what the graph shows. Nothing here needs ROS."""

from __future__ import annotations

import io
import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from hri_sim.health.advice_table import (
    ABSENT,
    COMPILED,
    DROPS,
    FROZEN,
    GONE,
    MISSES,
    SILENT,
    SLOW,
    SOURCES,
    STARVED,
    TWINS,
    UNHEARD,
)
from hri_sim.health.figures import ERROR, OK, STALE, WARN, NodeStatus, figures_of
from hri_sim.health.processes import StoppedNode, node_of, stopped_nodes
from hri_sim.health.screen import screen, to_mapping
from hri_sim.health.watch import Row, Watch, all_gone, exit_code

from .statuses import ARM, arm_input, status


def watch(*said: NodeStatus, names: tuple[str, ...] = (), there: list[str] | None = None) -> Watch:
    """A watch that has heard each of these at 0 s, and seen who is there."""
    made = Watch(names)
    for one in said:
        made.hear(one, 0.0)
    made.look([one.name for one in said] if there is None else there, 0.0)
    return made


def keys(row: Row) -> list[str]:
    return [trouble.key for trouble in row.troubles]


def text_of(rows: list[Row], width: int = 110) -> str:
    out = io.StringIO()
    Console(file=out, width=width).print(screen(rows, "head", width))
    return out.getvalue()


def test_a_node_that_is_well() -> None:
    (row,) = watch(status(**arm_input())).rows(0.5)
    assert (row.name, row.level, row.says, row.troubles) == ("/predictor", OK, "well", ())
    assert row.figures is not None
    assert row.figures.tick_ms == (1.5, 4.25)
    assert row.worst_input is not None
    assert (row.worst_input.topic, row.worst_input.latency_ms) == (ARM, (16.0, 21.5))
    assert exit_code([row]) == 0
    shown = text_of([row])
    assert "250 Hz, 15 ms" in shown
    assert "what to do" not in shown


@pytest.mark.parametrize(
    ("scale", "words"), [("1.000", "full speed"), ("0.430", "slowed 0.43"), ("0.000", "stopped")]
)
def test_a_monitor_says_how_fast_the_robot_may_be(scale: str, words: str) -> None:
    figures = {"speed_scale": scale, "protective_distance_m": "0.500"}
    (row,) = watch(status("/separation_monitor", **figures)).rows(0.0)
    assert row.says == f"{words} · well"


def test_faults_and_words_get_their_advice() -> None:
    text = "person1 invalid: no usable sample for 0.31 s"
    said = status(
        level=ERROR, message=f"{text}; the machine sings", **{"fault invalid person1": text}
    )
    (row,) = watch(said).rows(0.0)
    assert row.level == ERROR
    assert keys(row) == ["", "invalid person1"]
    assert row.troubles[0].text == "the machine sings"
    assert "cameras" in row.troubles[1].do
    assert exit_code([row]) == 1
    assert "cameras" in text_of([row])


def test_a_fault_that_is_all_a_node_says_is_told_once() -> None:
    text = "trajectory refused: point 3 has 6 positions"
    (row,) = watch(status(level=WARN, message=text, **{"fault trajectory": text})).rows(0.0)
    assert keys(row) == ["trajectory"]
    assert exit_code([row]) == 3


@pytest.mark.parametrize(
    ("before", "after", "key"),
    [
        ({"tick_overruns": 5}, {"tick_overruns": 60}, SLOW),
        ({}, {"tick_hz": 30.0}, STARVED),
        ({"deadline_misses": 1}, {"deadline_misses": 9}, MISSES),
        ({"dropped /a": 2}, {"dropped /a": 5}, DROPS),
        ({}, {"lost_in_transport /a": 2, "dropped /b": 1}, DROPS),
        ({"compiled_late": "f"}, {"compiled_late": "f, g"}, COMPILED),
    ],
)
def test_what_figures_show_is_a_warning_although_the_node_is_content(before, after, key) -> None:
    made = watch(status(**before))
    assert made.rows(0.0)[0].level == OK
    made.hear(status(**after), 9.0)
    (row,) = made.rows(9.0)
    assert (row.level, keys(row)) == (WARN, [key])
    assert "well" not in row.says
    for second in range(10, 30):  # what does not go on is over
        made.hear(status(**{**after, "tick_hz": 50.0}), float(second))
    (row,) = made.rows(29.5)
    assert (row.level, row.says) == (OK, "well")


def test_now_and_then_a_late_tick_is_no_trouble() -> None:
    made = watch(status())
    made.hear(status(tick_overruns=2, deadline_misses=2, **{"dropped /a": 2}), 2.0)
    (row,) = made.rows(2.0)
    assert row.level == OK
    assert row.lately["tick_overruns"] == 2
    assert "2 (+2)" in text_of([row])


def test_a_node_that_was_started_anew_counts_from_zero() -> None:
    made = watch(status(tick_overruns=500, **{"dropped /a": 70}))
    made.hear(status(tick_overruns=1), 1.0)
    (row,) = made.rows(1.0)
    assert row.level == OK
    assert set(row.lately.values()) == {0}


def test_silence_and_leaving() -> None:
    made = watch(status(), status("/ptomp", message="idle"))
    for second in (1.0, 2.0):
        made.hear(status(), second)
        made.hear(status("/ptomp"), second)
    made.hear(status("/ptomp"), 4.5)
    (silent, other) = made.rows(5.0)
    assert (silent.level, keys(silent), silent.says) == (STALE, [SILENT], "silent for 3 s")
    assert other.level == OK
    assert exit_code([silent, other]) == 1
    made.look(["/ptomp"], 5.0)
    (gone, other) = made.rows(5.0)
    assert (gone.level, keys(gone)) == (STALE, [GONE])
    assert not all_gone([gone, other])
    made.look([], 6.0)
    assert all_gone(made.rows(6.0))  # at once: who leaves in order is not waited for
    made.look(["/ptomp", "/predictor"], 8.0)
    made.hear(status(), 8.0)
    assert [row.level for row in made.rows(8.0)] == [OK, STALE]


def test_who_speaks_seldom_may_be_silent_for_longer() -> None:
    made = Watch()  # in slow motion a second of the node takes ten
    for second in (0.0, 10.0, 20.0):
        made.hear(status(), second)
    assert made.rows(40.0)[0].level == OK
    assert made.rows(46.0)[0].level == STALE


def test_a_node_that_has_not_spoken_yet() -> None:
    made = watch(status(), there=["/predictor", "/ptomp"])
    assert len(made.rows(1.0)) == 1
    made.hear(status(), 3.0)
    _, row = made.rows(3.0)
    assert (row.name, row.level, keys(row)) == ("/ptomp", STALE, [UNHEARD])
    # Where drivers speak under names of their own, nobody can tell who has not spoken.
    made.hear(status("lwr: temperatures"), 3.0)
    assert [row.name for row in made.rows(3.0)] == ["/predictor", "lwr: temperatures"]
    made.look(["/predictor", "/ptomp", "/lwr"], 3.0)
    made.hear(status(), 6.0)
    assert "/ptomp" in [row.name for row in made.rows(6.0)]


def test_a_stopped_process_has_a_row_whatever_the_graph_knows() -> None:
    stopped = [StoppedNode("ptomp", 42)]
    # Frozen before it was ever heard.
    made = watch(status())
    made.look_at_processes(stopped)
    rows = {row.name: row for row in made.rows(0.5)}
    assert rows["/predictor"].level == OK
    assert (rows["/ptomp"].level, keys(rows["/ptomp"])) == (STALE, [FROZEN])
    assert rows["/ptomp"].says == "its process 42 is stopped"
    assert "kill -CONT" in text_of(made.rows(0.5))
    # Silent, and dropped by the graph: neither gone nor merely silent.
    made = watch(status(), status("/cell/ptomp"))
    made.look_at_processes(stopped)
    for present, at_s in ((["/predictor", "/cell/ptomp"], 5.0), (["/predictor"], 30.0)):
        made.look(present, at_s)
        made.hear(status(), at_s)
        rows = {row.name: row for row in made.rows(at_s)}
        assert set(rows) == {"/predictor", "/cell/ptomp"}
        assert keys(rows["/cell/ptomp"]) == [FROZEN]
    # Who is looked for is not absent, and others are not looked at.
    made = watch(names=("ptomp",))
    made.look_at_processes([*stopped, StoppedNode("person", 43)])
    assert [(row.name, keys(row)) for row in made.rows(0.5)] == [("/ptomp", [FROZEN])]


@pytest.mark.parametrize(
    ("command", "name"),
    [
        (["/e/.venv/bin/python", "/e/.venv/lib/hri_planner/ptomp", "--ros-args"], "ptomp"),
        (["/ws/install/hri_sim/lib/hri_sim/simulator"], "simulator"),
        (["/usr/bin/python3", "ptomp"], ""),
        (["vi", "/ws/src/hri_planner/ptomp"], ""),
        ([], ""),
    ],
)
def test_command_lines_of_nodes(command: list[str], name: str) -> None:
    assert node_of(command) == name


def test_stopped_nodes_of_the_own_domain_are_found(tmp_path: Path) -> None:
    node = tmp_path / "lib" / "hri_sim" / "sleeper"
    node.parent.mkdir(parents=True)
    node.write_text("import time\ntime.sleep(60)\n")
    process = subprocess.Popen([sys.executable, str(node)], env={"ROS_DOMAIN_ID": "77"})
    try:
        assert stopped_nodes({"ROS_DOMAIN_ID": "77"}) == []
        process.send_signal(signal.SIGSTOP)
        for _ in range(200):
            found = stopped_nodes({"ROS_DOMAIN_ID": "77"})
            if found:
                break
            time.sleep(0.05)
        assert found == [StoppedNode("sleeper", process.pid)]
        assert stopped_nodes({}) == []
    finally:
        process.kill()
        process.wait()


def test_names_that_are_wanted() -> None:
    said = [status(name) for name in ("/cell/predictor", "/ptomp", "/recorder")]
    made = watch(*said, names=("predictor", "/ptomp", "planner"))
    rows = made.rows(0.0)
    assert [row.name for row in rows] == ["/cell/predictor", "/ptomp", "planner"]
    assert keys(rows[2]) == [ABSENT]
    assert exit_code(rows) == 1
    assert exit_code(rows[:2]) == 0
    assert exit_code(Watch().rows(0.0)) == 1  # nobody at all


def test_two_nodes_of_one_name_and_two_sources_of_one_body() -> None:
    made = watch(status(**arm_input()), there=["/predictor", "/predictor"])
    assert made.sole_topics == {ARM}
    made.look_at_sources({ARM: ["/person", "/replayer"]})
    (row,) = made.rows(0.0)
    assert row.level == WARN
    assert sorted(keys(row)) == sorted([SOURCES, TWINS])
    assert f"{ARM} comes from /person and /replayer" in row.says
    made.look_at_sources({ARM: ["/person", "/person"]})
    assert f"{ARM} comes from 2 nodes called /person" in made.rows(0.0)[0].says
    recorder = watch(status("/recorder", **{f"received {ARM}": 5}))
    recorder.look_at_sources({ARM: ["/person", "/replayer"]})
    assert recorder.rows(0.0)[0].level == OK  # it takes what there is


def test_what_was_dropped_is_named() -> None:
    made = watch(status(**{"dropped /a": 2, "dropped /b": 1}))
    made.hear(status(**{"dropped /a": 9, "dropped /b": 1}), 5.0)
    (row,) = made.rows(5.0)
    assert row.says == "7 messages dropped in 5 s: /a"
    assert row.dropped == 10


def test_the_input_that_runs_dry_comes_first() -> None:
    values = arm_input() | {
        "received /joint_states": 5,
        "received_hz /joint_states": 0.0,
        "age_s /joint_states": 4.1,
        "quiet_s /joint_states": 4.1,
        "received /sim/cue": 1,
        "age_s /sim/cue": 70.0,
        "received_hz /sim/cue": 0.0,
    }
    text = "nothing on /joint_states for 4.1 s"
    (row,) = watch(status(level=WARN, message=text, **values)).rows(0.0)
    assert row.worst_input is not None
    assert row.worst_input.topic == "/joint_states"
    assert "has stopped, died or hangs" in row.troubles[0].do


@pytest.mark.parametrize("width", [60, 80, 110, 160])
def test_the_table_keeps_to_its_width(width: int) -> None:
    long = "the newest sample behind the prediction of person1 is 0.123 s old"
    rows = watch(
        status("/a_node_of_a_long_name", level=WARN, message=long, **arm_input()),
        status("/other", level=ERROR, message="[odd] markup [/]"),
    ).rows(0.0)
    shown = text_of(rows, width)
    assert max(len(line) for line in shown.splitlines()) <= width
    assert "[odd]" in shown
    assert ("oldest input" in shown) == (width >= 100)


def test_advice_is_given_once_for_all_that_need_it() -> None:
    text = "this node was not run for 0.61 s: is the machine overloaded?"
    said = [status(n, WARN, text, **{"fault standstill": text}) for n in ("/a", "/b")]
    shown = text_of(watch(*said).rows(0.0))
    assert shown.count("did not run this node") == 1
    assert "/a, /b" in shown


def test_programs_get_numbers_and_nulls() -> None:
    (row,) = watch(status(**arm_input(), **{"sent_hz /out": "49.9", "dropped /x": 3})).rows(0.0)
    told = json.loads(json.dumps(to_mapping(row), allow_nan=False))
    assert told["state"] == "OK"
    assert told["inputs"][ARM]["hz"] == 250.0
    assert told["sent_hz"] == {"/out": 49.9}
    assert told["dropped"] == {"/x": 3}
    (row,) = watch(NodeStatus("driver: motor", WARN, "hot", {})).rows(0.0)
    told = json.loads(json.dumps(to_mapping(row), allow_nan=False))
    assert (told["period_ms"], told["inputs"]) == (None, {})
    assert "hot" in text_of([row])


KEYS = st.sampled_from(
    [
        "period_ms",
        "tick_hz",
        "tick_overruns",
        "received /a",
        "age_s /a",
        "received_hz /a",
        "fault x",
    ]
)


VALUES = st.one_of(st.text(max_size=8), st.floats().map(str), st.integers().map(str))


@given(st.dictionaries(st.one_of(KEYS, st.text(max_size=8)), VALUES))
def test_figures_of_anything_are_figures(values: dict[str, str]) -> None:
    figures_of(values)
    (row,) = watch(NodeStatus("/n", WARN, "odd", values)).rows(0.0)
    json.dumps(to_mapping(row), allow_nan=False)
    assert "odd" in text_of([row])
