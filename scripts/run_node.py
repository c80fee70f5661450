#!/usr/bin/env python3
"""Run one node in the foreground; see --help."""

import _project

_project.main("hri_sim.launch.run_node", graph=True)
