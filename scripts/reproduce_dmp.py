#!/usr/bin/env python3
"""Let policies improve by simulated people and make all tables and pictures of that; see --help."""

import _project

_project.main("hri_sim.readability_report.command")
