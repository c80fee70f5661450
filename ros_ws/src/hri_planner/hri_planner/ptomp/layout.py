"""How the kernels lay out trajectories, robot, people and workspace in flat arrays.

A trajectory is (7, ROW), joints by time: a structure of arrays, so that one instruction works on
several columns. Its columns 0 and 1 lie in the past (one and two steps before the hand-over),
column 2 is the state at the hand-over, the others are free. Beyond its last column it stands still,
for at least as many columns as the kernels look at.

All arrays of a call have one type, float64 or float32.
"""

from __future__ import annotations

ROW = 176
"""Row length of workspace, people and roll-outs. It is constant and the rows lie in one array, so
the compiler knows that rows do not overlap."""

LANES = 16
"""Columns are padded to a multiple of this, so that no scalar rest of a loop remains."""

MAX_COLUMNS = ROW - LANES
"""Largest number of columns P of a trajectory: differences in time look beyond the last one."""

FIRST_FREE = 3
"""First column that a planner may change."""

TERMS = (
    "collision",
    "contact",
    "effort",
    "jerk",
    "joint_limits",
    "speed",
    "acceleration",
    "table",
    "goal",
    "control",
    "interaction_learned",
)
TERM_COUNT = len(TERMS)

# Rows of the workspace: elbow, wrist, tool and unit vectors along the three parts; per column collision,
# contact and smallest distance; ones where a column is not past (from 2 on) and where it is free;
# per column what nearness costs; the robot's shoulder and the hand tip of the person that is looked at.
ELBOW, WRIST, TOOL, AXES = 0, 3, 6, 9
COLLISION, CONTACT, NEAREST = 18, 19, 20
AHEAD, FREE = 21, 22
LEARNT, BASE, TIP = 23, 24, 27
WORKSPACE_ROWS = 30

# Rows of a person's arm: of its three limbs the starts, unit vectors along them (zero where a limb has no
# length), lengths, standard deviations at the starts and what these rise by along each metre.
ARM_START, ARM_AXIS, ARM_LENGTH, ARM_SIGMA, ARM_RISE = 0, 9, 18, 21, 24
ARM_ROWS = 27

# The robot's vector: lengths (4), then of its three parts mass and radius, then of its seven joints
# lower limit, upper limit and largest speed.
LENGTHS, MASSES, RADII, LOWER, UPPER, VELOCITY = 0, 4, 7, 10, 17, 24
BODY_SIZE = 31

# Positions in the parameter vector; costs.py fills it.
P_MARGIN, P_KAPPA, P_COLLISION, P_CONTACT_MARGIN, P_CONTACT = 0, 1, 2, 3, 4
P_EFFORT, P_JERK, P_LIMITS, P_LIMIT_SCALE, P_SPEED, P_SPEED_SHARE = 5, 6, 7, 8, 9, 10
P_ACCELERATION, P_ACCELERATION_LIMIT, P_TABLE, P_TABLE_HEIGHT = 11, 12, 13, 14
P_GOAL, P_CONTROL, P_STEP = 15, 16, 17
P_GOAL_X = 18
P_PARALLEL = 21
P_GRAVITY, P_LITERAL = 22, 23
P_LEARNT, P_LEARNT_STEEP, P_NEARNESS = (
    24,
    25,
    26,
)  # weight, one over the length, first of 25 weights
NEARNESS_COUNT = 25
PARAMETER_COUNT = P_NEARNESS + NEARNESS_COUNT

FAR = 1e3
"""Clearance where there is nobody [m]."""

FAST = {"contract", "reassoc", "nsz", "arcp"}
"""What the compiler may do to sums. It may not assume that there is no NaN: one stays one."""
