#!/usr/bin/env python3
"""Launch the graph with a policy of movement primitives; see --help."""

import _project

_project.main("hri_sim.launch.dmp", graph=True)
