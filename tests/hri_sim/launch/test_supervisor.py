"""The supervisor's own part: whose death ends a node, and how long it may take to end."""

from __future__ import annotations

import functools
import os
import subprocess

import pytest

from hri_sim.launch.supervisor import die_with


@pytest.mark.parametrize(("parent", "code"), [(os.getpid, 0), (os.getppid, 1)])
def test_a_node_whose_parent_has_gone_does_not_start(parent, code: int) -> None:
    # Another parent than the one that started it: that one has died meanwhile. Its number, 1 in a
    # container, says nothing by itself.
    done = subprocess.run(["true"], preexec_fn=functools.partial(die_with, parent()))
    assert done.returncode == code
