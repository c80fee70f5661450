"""The help of the scripts: at once, also where nothing has been set up."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = sorted([path.name for path in (ROOT / "scripts").glob("[!_]*.py")] + ["demo"])


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """The scripts alone, with a set-up that does nothing but say that it was called."""
    shutil.copytree(ROOT / "scripts", tmp_path / "scripts")
    this_machine = "ros_ws/src/hri_prediction/hri_prediction/ros/this_machine.py"
    (tmp_path / this_machine).parent.mkdir(parents=True)
    shutil.copy(ROOT / this_machine, tmp_path / this_machine)
    (tmp_path / "scripts" / "setup").write_text('#!/bin/sh\necho "set-up $*" >&2\nexit 7\n')
    return tmp_path


def call(checkout: Path, script: str, *options: str) -> subprocess.CompletedProcess[str]:
    env = {k: v for k, v in os.environ.items() if k != "HRI_PROJECT_ROOT"}
    return subprocess.run(
        [sys.executable, str(checkout / "scripts" / script), *options],
        capture_output=True,
        text=True,
        env=env,
        timeout=20,
    )


@pytest.mark.parametrize("script", SCRIPTS)
def test_help_without_set_up(checkout: Path, script: str) -> None:
    done = call(checkout, script, "--help")
    assert done.returncode == 0, done.stderr
    usage, _, about, *_ = done.stdout.splitlines()
    assert usage.startswith(f"usage: {script} ")
    assert about in (ROOT / "scripts" / script).read_text().replace("; see --help.", ".")
    assert "./scripts/setup" in done.stdout
    assert "set-up" not in done.stderr


def test_only_a_help_of_the_script_goes_without_set_up(checkout: Path) -> None:
    assert call(checkout, "train_promp.py", "-h").returncode == 0
    for wrong in (["--no-such-option"], [], ["hri_sim", "person", "--ros-args", "--help"]):
        done = call(checkout, "run_node.py", *wrong)
        assert (done.returncode, done.stderr) == (7, "set-up \n")


def test_help_where_it_is_set_up_does_not_install_what_tests_need(checkout: Path) -> None:
    (checkout / ".venv").mkdir()
    (checkout / ".venv" / ".setup.json").write_text(json.dumps({"hri_sim": "1"}))
    assert call(checkout, "benchmark_promp.py", "--help").stderr == "set-up --no-wait\n"
    assert call(checkout, "benchmark_promp.py").stderr == "set-up --dev --no-wait\n"
