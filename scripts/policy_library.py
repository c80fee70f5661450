#!/usr/bin/env python3
"""List, compare, add and export policies that were learnt with people; see --help."""

import _project

_project.main("hri_sim.readability.library_command")
