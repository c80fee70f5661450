#!/usr/bin/env python3
"""Launch the graph with the replanning motion planner; see --help."""

import _project

_project.main("hri_sim.launch.ptomp", graph=True)
