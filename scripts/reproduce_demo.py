#!/usr/bin/env python3
"""Run the demo for several seeds and write the table; see --help."""

import _project

_project.main("hri_sim.launch.reproduce", "main_demo", graph=True)
