#!/usr/bin/env python3
"""Measure latency, rates, losses and load of the live graph; see --help."""

import _project

_project.main("hri_sim.launch.benchmark", graph=True)
