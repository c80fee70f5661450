"""``scripts/fit_ioc.py`` from a bag and on a cluster: what it says of the same reaches elsewhere."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from drawn import recorded

from hri_prediction.motor_control.cli import main
from hri_prediction.ros.arm_bag import write_arm_bag
from hri_prediction.tracks.files import save_tracks

CLUSTER = Path(__file__).parents[2] / "hri_sim/benchmark/cluster.py"


def test_a_bag_says_what_its_tracks_say(solver, rng, tmp_path, capsys):
    track = recorded(solver, 40, rng)[0]
    save_tracks(tmp_path / "reach.npz", [track])
    write_arm_bag(tmp_path / "bag", track)
    found = []
    for source in ("reach.npz", "bag"):
        out = tmp_path / f"from {source}"
        arguments = [str(tmp_path / source), "--out", str(out), "--workers", "1", "--facing", "90"]
        assert main(arguments) == 0, capsys.readouterr().err
        assert "bringing reaches to the model of the arm: 1 of 1" in capsys.readouterr().out
        assert "| hand jerk (HJ) |" in (out / "results.md").read_text()
        (row,) = json.loads((out / "results.json").read_text())["reaches"]
        found.append(row)
    np.testing.assert_allclose(found[1]["alpha"], found[0]["alpha"], atol=1e-4)
    np.testing.assert_allclose(found[1]["q_end_deg"], found[0]["q_end_deg"], atol=1e-3)


def test_a_cluster_finds_the_same(solver, rng, tmp_path):
    pytest.importorskip("distributed")
    save_tracks(tmp_path / "reaches.npz", [recorded(solver, n, rng)[0] for n in (0, 40)])
    arguments = [str(tmp_path / "reaches.npz"), "--facing", "90"]
    assert main([*arguments, "--out", str(tmp_path / "here"), "--workers", "1"]) == 0
    with subprocess.Popen(
        [sys.executable, str(CLUSTER)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as cluster:
        try:
            address = cluster.stdout.readline().strip()
            # A process of its own: the client's threads are not ours to clean up.
            text = "from hri_prediction.motor_control.cli import main; raise SystemExit(main())"
            arguments += ["--out", str(tmp_path / "there"), "--scheduler", address]
            done = subprocess.run(
                [sys.executable, "-c", text, *arguments], capture_output=True, text=True
            )
            assert done.returncode == 0, done.stdout + done.stderr
        finally:
            cluster.stdin.close()
            cluster.wait(timeout=30)
    here, there = (
        json.loads((tmp_path / name / "results.json").read_text())["reaches"]
        for name in ("here", "there")
    )
    assert [{**row, "seconds": 0} for row in here] == [{**row, "seconds": 0} for row in there]
