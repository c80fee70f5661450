#!/usr/bin/env python3
"""Find which optimal-control costs explain recorded reaches; see --help."""

import _project

_project.main("hri_prediction.motor_control.cli")
