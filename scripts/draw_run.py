#!/usr/bin/env python3
"""Draw picture and video of an earlier run from its bag; see --help."""

import _project

_project.main("hri_sim.launch.draw")
