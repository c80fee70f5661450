"""Warming compiles all there is: a reach afterwards compiles nothing."""

from reach_trials import run_trial

from hri_planner.ptomp import kernel, optimizer, smoothing
from hri_planner.robot import ik, kinematics
from hri_planner.warm import warm_kernels


def _compiled():
    return {
        f"{module.__name__}.{name}": len(item.signatures)
        for module in (kernel, optimizer, smoothing, ik, kinematics)
        for name, item in vars(module).items()
        if hasattr(item, "signatures")
    }


def test_nothing_is_left_to_compile():
    warm_kernels()
    before = _compiled()
    run_trial(3, iterations=5, limit_s=1.0)
    assert _compiled() == before
