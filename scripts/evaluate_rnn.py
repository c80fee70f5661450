#!/usr/bin/env python3
"""Hold learnt policies against people; see --help."""

import _project

_project.main("hri_sim.policies.evaluation_command")
