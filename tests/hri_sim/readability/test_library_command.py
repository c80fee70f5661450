"""The command that lists, compares, adds and exports policies, as users give it."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from hri_planner.dmp.model_file import read_dmp, save_dmp
from hri_planner.dmp.policy import DmpPolicy
from hri_planner.pibb.library import PolicyLibrary
from hri_prediction.errors import ConfigError, DataError
from hri_sim.readability.library_command import app, draw_comparison, tables

ROOT = Path(__file__).resolve().parents[3]
START = np.array([0.3, 0.0, 0.4])
GOALS = {"g|1": START + np.array([0.4, 0.0, 0.0]), "g2": START + np.array([0.3, 0.3, 0.0])}
LEARNT = {
    "experiment": "transfer",
    "updates": 15,
    "trials": 51,
    "cost_first": 30.0,
    "cost_last": 21.5,
}


def policy(seed: int) -> DmpPolicy:
    rng = np.random.default_rng(seed)
    weights = {name: 0.02 * rng.standard_normal((3, 20)) for name in GOALS}
    return DmpPolicy(START, np.zeros(7), GOALS, weights, 1.0)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The present folder, with two policies in the library that goes with it."""
    monkeypatch.chdir(tmp_path)
    library = PolicyLibrary(Path("runs/policies"))
    library.add(policy(1), "ann", "transfer", {**LEARNT, "commit": "gabc"})
    library.add(policy(2), "bob", "transfer", LEARNT)
    return tmp_path


def call(*words: str) -> str:
    result = CliRunner().invoke(app, words, catch_exceptions=False, env={"COLUMNS": "200"})
    assert result.exit_code == 0, result.output
    return re.sub(r" +", " ", result.output)


# ------------------------------------------------------------------ list
def test_lists_what_is_there(here: Path) -> None:
    PolicyLibrary(Path("runs/policies")).add(policy(3), "eve", "other", {})
    said = call("list")
    assert "transfer in runs/policies" in said
    assert re.search(r"ann g\|1, g2 15 51 30 21\.5 20\S+ \d\d:\d\d gabc", said)
    assert re.search(r"eve g\|1, g2 – – – – 20", said)
    assert said.index("other in") < said.index("transfer in")
    (here / "runs/policies/transfer/mad.npz").write_bytes(b"PK\x03\x04")
    said = call("list", "--library", str(here / "runs" / "policies"))
    assert re.search(r"cannot be used: .*mad\.npz: cannot read", said)


def test_lists_nothing_where_nothing_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert "no policies in runs/policies" in call("list")
    with pytest.raises(ConfigError, match="--library nowhere is no folder"):
        call("list", "--library", "nowhere")


# ------------------------------------------------------------------ compare
def test_compares_on_the_terminal(here: Path) -> None:
    said = call("compare", "transfer")
    assert "transfer: each way beside the straight line" in said
    assert "how far the ways of two people are apart" in said
    assert "g|1 ann – bob" in said
    assert "results:" not in said
    assert sorted(path.name for path in here.iterdir()) == ["runs"]
    found = PolicyLibrary(Path("runs/policies")).compare("transfer")
    (_, _, ways), (_, _, pairs) = tables(found)
    assert [row[:2] for row in ways] == [
        ["g|1", "ann"], ["g|1", "bob"], ["g2", "ann"], ["g2", "bob"],
    ]  # fmt: skip
    assert ways[0][2] == f"{100 * found.ways[0].length:.4g}"
    assert pairs[0][2] == f"{100 * found.pairs[0].rms:.3g}"


def test_one_alone_is_compared_with_the_straight_line(here: Path) -> None:
    said = call("compare", "transfer", "bob")
    assert "beside the straight line" in said
    assert "apart" not in said
    assert "ann" not in said


def test_leaves_files(here: Path) -> None:
    said = call("compare", "transfer", "bob", "ann", "--out", "new/out")
    assert "results: new/out/compare.json" in said
    names = ["compare.json", "compare.md", "compare.png"]
    assert sorted(path.name for path in Path("new/out").iterdir()) == names
    results = json.loads(Path("new/out/compare.json").read_text())
    assert results["persons"] == ["bob", "ann"]
    assert "commit" in results["origin"]
    assert len(results["ways"]) == 4
    assert [(one["first"], one["second"]) for one in results["pairs"]] == [("bob", "ann")] * 2
    text = Path("new/out/compare.md").read_text()
    assert text.startswith("# Policies of transfer, compared")
    assert "| g\\|1 | bob – ann |" in text
    assert "![ways of bob, ann](compare.png)" in text
    with pytest.raises(ConfigError, match=r"already holds compare\.json"):
        call("compare", "transfer", "--out", "new/out")
    call("compare", "transfer", "ann", "--out", "new/out", "--overwrite")
    assert json.loads(Path("new/out/compare.json").read_text())["persons"] == ["ann"]


def test_the_picture_shows_each_way_twice(
    here: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from matplotlib.figure import Figure

    drawn: list[Figure] = []
    save = Figure.savefig

    def kept(figure: Figure, *words: object, **named: object) -> None:
        drawn.append(figure)
        save(figure, *words, **named)

    monkeypatch.setattr(Figure, "savefig", kept)
    found = PolicyLibrary(Path("runs/policies")).compare("transfer")
    draw_comparison(tmp_path / "picture.png", found)
    (figure,) = drawn
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    views = ("from above", "from the side")
    assert titles == [f"{goal}, {view}" for view in views for goal in GOALS]
    for axes, title in zip(figure.axes, titles, strict=True):
        goal = title.split(",")[0]
        lines = {line.get_label(): line for line in axes.lines if line.get_label() in "annbob"}
        assert set(lines) == {"ann", "bob"}
        for name, line in lines.items():
            # From 0 to the goal: the straight line is the axis.
            along, across = np.array(line.get_data())
            assert (along[0], across[0]) == (0.0, 0.0)
            length = 100.0 * np.linalg.norm(GOALS[goal] - START)
            assert (along[-1], across[-1]) == pytest.approx((length, 0.0), abs=0.05)
            way = next(w for w in found.ways if (w.person, w.goal) == (name, goal))
            assert np.abs(across).max() <= 100.0 * way.sideways + 1e-9
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["ann", "bob"]


def test_the_picture_of_many_people_with_goals_of_their_own(tmp_path: Path) -> None:
    library = PolicyLibrary(tmp_path / "library")
    for index in range(8):
        own = {f"g{index % 3}": GOALS["g2"]}
        made = DmpPolicy(START, np.zeros(7), own, {name: np.zeros((3, 20)) for name in own}, 1.0)
        library.add(made, f"p{index}", "a", {})
    draw_comparison(tmp_path / "picture.png", library.compare("a"))
    assert (tmp_path / "picture.png").stat().st_size > 10_000


# ------------------------------------------------------------------ add and export
def test_adds_and_exports(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    save_dmp("policy.npz", policy(1), {**LEARNT, "person": "p1", "seed": 3})
    said = call("add", "policy.npz", "--person", "ann")
    assert said.strip() == "added: runs/policies/transfer/ann.npz"
    with pytest.raises(ConfigError, match=r"there already.*--replace"):
        call("add", "policy.npz", "--person", "ann")
    call("add", "policy.npz", "--person", "ann", "--replace")
    said = call("add", "policy.npz", "--person", "bob", "--experiment", "b", "--library", "shelf")
    assert "shelf/b/bob.npz" in said
    assert "learnt in transfer, not in b" in said
    assert "exported: out/x.npz" in call("export", "b", "bob", "out/x.npz", "--library", "shelf")
    found, learnt = read_dmp("out/x.npz")
    assert (learnt["person"], learnt["experiment"], learnt["seed"]) == ("bob", "b", 3)
    for name in GOALS:
        assert found.path(name).tobytes() == policy(1).path(name).tobytes()
    with pytest.raises(ConfigError, match=r"there already.*--replace"):
        call("export", "transfer", "ann", "out/x.npz")
    call("export", "transfer", "ann", "out/x.npz", "--replace")
    assert read_dmp("out/x.npz")[1]["person"] == "ann"
    assert [path.name for path in Path("out").iterdir()] == ["x.npz"]


def test_what_cannot_be_added_or_exported(here: Path) -> None:
    save_dmp("policy.npz", policy(1), {})
    Path("broken.npz").write_bytes(b"PK\x03\x04")
    with pytest.raises(ConfigError, match=r"in which experiment.*--experiment"):
        call("add", "policy.npz", "--person", "eve")
    with pytest.raises(ConfigError, match="cannot be the name of a file"):
        call("add", "policy.npz", "--person", "../eve", "--experiment", "a")
    with pytest.raises(DataError, match=r"cannot read broken\.npz"):
        call("add", "broken.npz", "--person", "eve")
    with pytest.raises(DataError, match=r"cannot read nowhere\.npz"):
        call("add", "nowhere.npz", "--person", "eve")
    with pytest.raises(ConfigError, match=r"of eve for transfer.*\(ann, bob\)"):
        call("export", "transfer", "eve", "eve.npz")
    with pytest.raises(ConfigError, match=r"ends in \.npz"):
        call("export", "transfer", "ann", "ann.txt")
    Path("runs/policies/transfer/ann.npz").write_bytes(b"PK\x03\x04")
    with pytest.raises(DataError, match="cannot read"):
        call("export", "transfer", "ann", "ann.npz")
    assert not Path("ann.npz").exists()


# ------------------------------------------------------------------ the script
@pytest.mark.parametrize("command", [[], ["list"], ["compare"], ["add"], ["export"]])
def test_every_command_has_a_help(command: list[str]) -> None:
    assert "Usage: " in call(*command, "--help")
    assert call(*command, "--help") == call(*command, "-h")


def test_errors_are_one_line_and_exit_code_1(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(ROOT / "scripts" / "policy_library.py"), "compare", "a", "ann"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
        env={**os.environ, "HRI_PROJECT_ROOT": str(ROOT)},
    )
    assert (done.returncode, done.stdout) == (1, "")
    assert re.fullmatch(
        r"policy_library\.py: error: runs/policies has no policy of ann for a; .*\n", done.stderr
    )
