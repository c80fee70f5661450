#!/usr/bin/env python3
"""Do the analyses of why people reach as they do; see --help."""

import _project

_project.main("hri_sim.motor_control.study_command")
