#!/usr/bin/env python3
"""Launch the graph with a policy that was learnt from two people; see --help."""

import _project

_project.main("hri_sim.launch.policy", graph=True)
