#!/usr/bin/env python3
"""Show what a bag holds, or recover a broken one; see --help."""

import _project

_project.main("hri_sim.tools.inspect_bag")
