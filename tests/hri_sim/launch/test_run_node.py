"""Nodes by hand: which there are, and what one says when it is ready."""

from __future__ import annotations

import dataclasses
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

rclpy = pytest.importorskip("rclpy")
pytest.importorskip("hri_msgs.msg")

from hri_planner.nodes.ptomp_node import PtompNode  # noqa: E402
from hri_prediction.ros.readiness import ready_line  # noqa: E402
from hri_sim.launch import run_node  # noqa: E402
from hri_sim.launch.parameters import CONFIGURATIONS  # noqa: E402
from hri_sim.testing.domain import own_domain  # noqa: E402

DOMAIN = own_domain("run_node")
NODES = (
    "adaptation",
    "dyad",
    "interaction_monitor",
    "mocap_live",
    "observer",
    "person",
    "policy",
    "predictor",
    "ptomp",
    "recorder",
    "replayer",
    "separation_monitor",
    "simulator",
)


def test_without_arguments_the_nodes_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_node.main([]) == 0
    _, *lines = capsys.readouterr().out.splitlines()
    assert len(lines) == len(NODES)
    for line in lines:
        package, name, *words = line.split()
        assert package.startswith("hri_")
        assert name in NODES
        assert len(words) >= 4  # what it does


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (["hri_planner"], "It has adaptation, policy, ptomp"),
        (["hri"], "no package 'hri'"),
        (["hri", "ptomp"], "no package 'hri'"),
        (["hri_planner", "ptomp", "-p", "a:=1"], "parameters come after --ros-args"),
        (["hri_planner", "ptomp", "blah"], "'blah' would be ignored"),
        (
            ["hri_sim", "ptomp"],
            "no node 'ptomp'; it has dyad, observer, person, recorder, replayer, simulator",
        ),
    ],
)
def test_what_no_node_could_use_is_refused(
    names: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        run_node.main(names)
    assert ended.value.code == 2
    assert words in capsys.readouterr().err


def test_what_a_ready_node_says() -> None:
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=DOMAIN)
    node = PtompNode(context=context, namespace="/cell")
    try:
        line = ready_line(node)
    finally:
        node.close()
        node.destroy_node()
        rclpy.try_shutdown(context=context)
    assert line.startswith(
        "ptomp ready: listens to /cell/humans/bodies/tracked, /cell/joint_states"
    )
    assert "; publishes /cell/joint_trajectory_controller/joint_trajectory, " in line
    assert line.endswith("; serves /cell/ptomp/reach_target")
    assert "parameter" not in line


@pytest.mark.parametrize(
    ("module", "options", "words"),
    [
        (
            "hri_sim.nodes.person_node",
            [],
            r"person ready: listens to /sim/cue; publishes /humans/.*; serves /person/reset",
        ),
        (
            "hri_sim.nodes.dyad_node",
            [],
            r"dyad ready: publishes /humans/.*tracked, .*; serves /dyad/reset",
        ),
        (
            "hri_sim.nodes.recorder_node",
            ["--ros-args", "-p", "output:=bag"],
            r"recorder ready: records all topics to .*bag",
        ),
    ],
)
def test_a_node_says_that_it_is_ready(
    module: str, options: list[str], words: str, tmp_path: Path
) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", f"from {module} import main; main()", *options],
        stdout=subprocess.PIPE,
        cwd=tmp_path,
        text=True,
        env={**os.environ, "ROS_DOMAIN_ID": str(DOMAIN)},
    ) as process:
        try:
            assert process.stdout is not None
            assert re.fullmatch(words + "\n", process.stdout.readline())
        finally:
            process.terminate()
            end = time.monotonic() + 10.0
            while process.poll() is None and time.monotonic() < end:
                time.sleep(0.05)
            process.kill()


@pytest.mark.parametrize("name", sorted(CONFIGURATIONS))
def test_help_of_a_node_has_all_its_parameters(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    package = next(package for package, node in run_node.installed_nodes() if node == name)
    assert run_node.main([package, name, "--help"]) == 0
    said = capsys.readouterr().out
    for prefix, defaults in CONFIGURATIONS[name]:
        for field in dataclasses.fields(defaults):
            if "doc" in field.metadata:
                assert f"\n  {prefix}{field.name}: " in said
    assert "\n  realtime_priority: " in said


def test_help_of_a_parameter_has_unit_and_range(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_node.main(["hri_prediction", "predictor", "--help"]) == 0
    said = capsys.readouterr().out
    assert "  guess.duration: 1.0 s, from 0.1 to 10\n      Of a reach before any is seen" in said
    assert run_node.main(["hri_prediction", "interaction_monitor", "-h"]) == 0
    assert "  side: 'right', one of right, left\n" in capsys.readouterr().out
