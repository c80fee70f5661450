#!/usr/bin/env python3
"""Time optimal control of reaching and its inverse beside other ways; see --help."""

import _project

_project.main("hri_sim.motor_control.benchmark_command")
