#!/usr/bin/env python3
"""Try margins of each planner on the tuning tasks, as many for each; see --help."""

import _project

_project.main("hri_sim.benchmark.tuning_command")
