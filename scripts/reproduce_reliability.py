#!/usr/bin/env python3
"""Let things go wrong on purpose and make the tables of what happens then; see --help."""

import _project

_project.main("hri_sim.faults.command", graph=True)
