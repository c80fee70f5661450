"""Progressive trajectory optimisation for motion planning (PTOMP), chapter 6 of the thesis."""

from hri_planner.ptomp.config import PtompConfig, load_default_config
from hri_planner.ptomp.costs import TableBox
from hri_planner.ptomp.forecast import HumanForecast
from hri_planner.ptomp.plan import JointPlan
from hri_planner.ptomp.planner import PtompPlanner
from hri_planner.ptomp.result import ReplanResult

__all__ = [
    "HumanForecast",
    "JointPlan",
    "PtompConfig",
    "PtompPlanner",
    "ReplanResult",
    "TableBox",
    "load_default_config",
]
