#!/usr/bin/env python3
"""Let a policy improve by how a person reads the robot; see --help."""

import _project

_project.main("hri_sim.launch.adapt", graph=True)
