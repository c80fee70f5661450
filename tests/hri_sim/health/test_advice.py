"""Everything that nodes can say is wrong has an advice: looked up in the sources."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from hri_planner.supervision.freshness import Controller, Heard, HeardPerson, Limits, problem
from hri_sim.health import advice_table
from hri_sim.health.advice import UNKNOWN, advise, known
from hri_sim.recording.condition import troubles
from hri_sim.recording.recorder_core import RecorderState
from hri_sim.simulator.stopchain import StopChain, StopChainConfig

ROOT = Path(__file__).resolve().parents[3]
SOURCES = sorted((ROOT / "ros_ws" / "src").glob("hri_*/hri_*/**/*.py"))
NANO = 1_000_000_000

HANDED_ON = {
    ("node.py", "key"): "HriNode.fault itself",
    ("motion_node.py", "kind"): "faults of decisions: looked up in hri_planner/supervision",
    ("bodies.py", "self.what"): "looked up in the classes derived from BodyTopics",
    (
        "recorder_node.py",
        "trouble.kind",
    ): "by its words: hri_sim/recording/condition.py",
}
"""Keys that are no constants, and where the test finds them."""


def sample(node: ast.expr) -> str | None:
    """What a text may be like, with x for what is filled in; none where it is no text."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(
            str(part.value) if isinstance(part, ast.Constant) else "x" for part in node.values
        )
    return None


def faults() -> Iterator[tuple[Path, str, str]]:
    """Of every call of ``fault``: file, key and text; what is filled in is x, what is not known empty."""
    for path in SOURCES:
        for node in ast.walk(ast.parse(path.read_text())):
            if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute):
                continue
            if node.func.attr != "fault" or len(node.args) < 2:
                continue
            key, text = sample(node.args[0]), sample(node.args[1]) or ""
            if key is None and (path.name, ast.unparse(node.args[0])) not in HANDED_ON:
                key = ""  # found by its words, or not at all
            if key is not None:
                yield path, key, text


def handed_on() -> Iterator[tuple[Path, str, str]]:
    """Faults of decisions, and those of topics of bodies."""
    for path in SOURCES:
        tree = ast.parse(path.read_text())
        if path.parent.name == "supervision":
            pairs = [
                part
                for node in ast.walk(tree)
                for found in (
                    [word.value for word in node.keywords if word.arg == "faults"]
                    + (node.args if ast.unparse(node.func).endswith("faults.append") else [])
                    if isinstance(node, ast.Call)
                    else []
                )
                for part in ast.walk(found)
                if isinstance(part, ast.Tuple)
                and len(part.elts) == 2
                and isinstance(part.elts[0], ast.Constant)
            ]
            for pair in pairs:
                yield path, str(sample(pair.elts[0])), sample(pair.elts[1]) or ""
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef) and "BodyTopics" in map(ast.unparse, node.bases):
                (values,) = (
                    part.value
                    for part in node.body
                    if isinstance(part, ast.Assign) and "what" in ast.unparse(part.targets[0])
                )
                yield path, str(sample(values.elts[0])), ""  # type: ignore[attr-defined]


FOUND = [*faults(), *handed_on()]


def test_the_faults_of_all_nodes_are_found() -> None:
    keys = {key for _, key, _ in FOUND}
    assert {"joints", "paused", "replan", "clock", "arm", "prediction", "invalid x"} <= keys
    names = {path.name for path, _, _ in FOUND}
    assert {"predictor_node.py", "motion_node.py", "captured_bodies.py", "node.py"} <= names


@pytest.mark.parametrize(
    ("path", "key", "text"), FOUND, ids=[f"{path.stem}-{key}" for path, key, _ in FOUND]
)
def test_every_fault_has_an_advice(path: Path, key: str, text: str) -> None:
    assert known(key) or advise("", text) != UNKNOWN, (
        f"{path}: the fault {key!r} ({text}) needs an advice in hri_sim/health/advice_table.py"
    )


def warnings() -> Iterator[tuple[Path, str]]:
    """Texts that a node's health returns with WARN or ERROR, as far as they stand in the code."""
    for path in SOURCES:
        for function in ast.walk(ast.parse(path.read_text())):
            if not isinstance(function, ast.FunctionDef) or function.name != "health":
                continue
            for node in ast.walk(function):
                if (
                    isinstance(node, ast.Tuple)
                    and len(node.elts) > 1
                    and ast.unparse(node.elts[0]) in ("WARN", "ERROR")
                    and (text := sample(node.elts[1]))
                ):
                    yield path, text


@pytest.mark.parametrize(("path", "text"), warnings(), ids=lambda value: str(value)[-40:])
def test_every_health_that_is_not_well_has_an_advice(path: Path, text: str) -> None:
    assert advise("", text) != UNKNOWN, (
        f"{path}: {text!r} needs an advice in hri_sim/health/advice_table.py"
    )


GONE = "nothing says any longer who is tracked"
LOST = "a source no longer says who is tracked (it listed nobody)"


def heard(**others: object) -> Heard:
    base = {"joints_ns": 10 * NANO, "controller": Controller(10 * NANO), "tracked": ("ann",)}
    return Heard(**{**base, **others})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("facts", "word"),
    [
        (heard(joints_ns=None), "Start the simulator"),
        (heard(joints_ns=9 * NANO), "has died, hangs or is late"),
        (heard(joints_ns=11 * NANO), "one time server"),
        (heard(controller=Controller(9 * NANO)), "has died, hangs or is late"),
        (heard(tracked=None), "Start a source of people"),
        (heard(tracked=(), unlisted=GONE), "What said who is tracked"),
        (heard(tracked=(), unlisted=LOST), "One of several sources"),
        (heard(), "Start the predictor"),
        (heard(what="arm"), "Start a source of people"),
        (heard(people={"ann": HeardPerson(10 * NANO, True, "markers swapped")}), "predictor's row"),
        (heard(people={"ann": HeardPerson(9 * NANO)}), "Samples come too late"),
        (heard(people={"ann": HeardPerson(11 * NANO)}), "one time server"),
    ],
)
def test_what_keeps_the_planner_from_moving(facts: Heard, word: str) -> None:
    text = problem(facts, Limits(0.1, 0.085, True), 10 * NANO)
    assert text
    assert word in advise("", text)
    assert advise("paused", text) == advise("", text)  # the cause tells more than the pause


def test_what_stops_the_controller() -> None:
    chain = StopChain(StopChainConfig(command_timeout=0.1))
    chain.update(NANO, 0.001, moving=True)
    assert "Nobody sends" in advise("", chain.reason)
    chain.plan_received(NANO, needs_replan=True)
    chain.command(1.0, 2 * NANO)
    chain.update(2 * NANO, 0.001, moving=True)
    assert "does not send its plans in time" in advise("", chain.reason)
    chain.motion_ended()
    chain.command(0.0, 2 * NANO)
    chain.update(2 * NANO, 0.001, moving=True)
    assert "keeps the robot at rest" in advise("", chain.reason)


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("ann invalid: no usable sample for 0.2 s (late or repeated sample)", "two sources"),
        ("ann: late or repeated sample, 3 so far", "two sources"),
        ("ann: stamps went back, 1 so far", "two sources"),
        ("ann: jump of a marker, 2 so far", "labels"),
        ("ann invalid: no usable sample for 0.2 s (markers swapped)", "labels"),
        ("ann invalid: no usable sample for 0.2 s (jump: wrist)", "labels"),
        ("ann: jump: elbow", "labels"),
        ("ann was last seen 6.8 s ago", "start it again"),
        ("ann: implausible length: shoulder-elbow 0.500 m, expected 0.280 m", "wrong unit"),
        (
            "ann invalid: arm not seen (implausible length: shoulder-elbow 280 m, expected 0.280 m)",
            "wrong unit",
        ),
        ("ann invalid: no usable sample for 0.2 s", "cameras"),
        (
            "ann invalid: no usable sample for 0.2 s (samples come at 5 Hz, too seldom to find reaches)",
            "rate",
        ),
        ("sample of ann is stamped 3.200 s in the future; expected at most 0.05 s", "time server"),
        ("the clock went back: the present motion is dropped", "only one node publishes /clock"),
        ("not writing: [Errno 28] No space left on device", "Free disk space"),
        ("/x is not recorded: no such type", "message type"),
        ("policy/load_model is not there", "Start the policy node"),
        ("a hand moves beside the targets: the trial begins when it rests", "rest the hands"),
        ("connecting to QTM at 192.168.1.5:22223", "Track Manager"),
    ],
)
def test_words_that_tell_more_than_the_key(text: str, word: str) -> None:
    assert word in advise("", text)


def test_what_nobody_has_thought_of() -> None:
    assert advise("odd", "something odd") == UNKNOWN


def test_advice_names_scripts_and_documents_that_exist() -> None:
    said = " ".join(item.do for item in advice_table.TABLE)
    named = set(re.findall(r"(?:scripts|docs)/\w+\.\w+|\b\w+\.py\b", said))
    assert named
    for name in named:
        assert (ROOT / name).exists() or (ROOT / "scripts" / name).exists(), name
    for package, executable in re.findall(r"(hri_\w+) (\w+)", said):
        setup = (ROOT / "ros_ws" / "src" / package / "setup.py").read_text()
        assert f'"{executable} = ' in setup, executable


@pytest.mark.parametrize("error", ["", "No space left on device"])
def test_every_trouble_of_a_recorder_has_an_advice(error: str) -> None:
    state = RecorderState(5, 4, 1, 0, 10, 99, 99, 99, error, 10, 0.9, 4.0)
    found = troubles(state, {"/a": 3}, {"/b": 2}, {"/c": "c/msg/C"})
    assert len(found) == 4
    for trouble in found:
        assert advise(trouble.kind, trouble.text) != UNKNOWN, trouble
