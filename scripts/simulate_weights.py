#!/usr/bin/env python3
"""Have simulated people reach, and explain their mean reaches; see --help."""

import _project

_project.main("hri_sim.hybrid.simulate_weights")
