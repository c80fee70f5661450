#!/usr/bin/env python3
"""Time the planner's kernel beside NumPy, Pinocchio and PyTorch; see --help."""

import _project

# Pinocchio and coal come with what tests need.
_project.main("hri_planner.benchmarks.kernel", setup=("--dev",))
