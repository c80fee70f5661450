#!/usr/bin/env python3
"""Run the whole graph for a long time, with faults, and report on it; see --help."""

import _project

_project.main("hri_sim.launch.soak", graph=True)
