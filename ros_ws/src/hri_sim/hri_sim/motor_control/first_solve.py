"""How long the first optimum of a reach takes in a new process, on a new machine too."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path

from hri_prediction.errors import HriError


def first_solve(cache: Path | None = None) -> dict[str, float]:
    """Measured in a process of its own.

    Args:
        cache: Empty folder for all that is compiled, as on a machine where nothing is yet; none: what was
            compiled before is used.

    Returns:
        ``import_s``: from its start until everything is imported; ``first_s``: from then on until the first
        optimum, with its scale factors and all compiled code that is loaded; ``next_ms``: likewise of
        another reach.

    Raises:
        HriError: the process failed.
    """
    command = [sys.executable, "-m", "hri_sim.motor_control.first_solve", str(time.monotonic())]
    kept = {} if cache is None else {"XDG_CACHE_HOME": str(cache), "NUMBA_CACHE_DIR": str(cache)}
    environment = {**os.environ, **kept}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        last = (done.stderr.strip().splitlines() or ["nothing"])[-1]
        raise HriError(
            f"a new process did not solve a reach (exit code {done.returncode}); it said: {last}"
        )
    found: dict[str, float] = json.loads(done.stdout)
    return found


def main(begun_s: float) -> None:
    """The process, which was started at a time of the clock that all processes of a machine share."""
    import numpy as np

    from hri_prediction.motor_control import design
    from hri_prediction.motor_control.arm_model import ArmModel
    from hri_prediction.motor_control.costs import CHAPTER_3
    from hri_prediction.motor_control.ocp import ReachSolver
    from hri_prediction.motor_control.problem import ReachProblem
    from hri_prediction.motor_control.scaling import scaling_of

    imported_s = time.monotonic()
    alpha = np.full(len(CHAPTER_3), 1.0 / len(CHAPTER_3))
    solver = ReachSolver(ArmModel.of_body())
    done_s = [imported_s]
    every = design.tasks()
    for number in (0, len(every) // 2):
        task = ReachProblem.at_rest(*every[number][2:])
        solver.solve(task, scaling_of(solver, task).weights(alpha, CHAPTER_3))
        done_s.append(time.monotonic())
    found = {
        "import_s": imported_s - begun_s,
        "first_s": done_s[1] - done_s[0],
        "next_ms": 1e3 * (done_s[2] - done_s[1]),
    }
    print(json.dumps(found))


if __name__ == "__main__":
    main(float(sys.argv[1]))
