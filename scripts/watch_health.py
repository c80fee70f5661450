#!/usr/bin/env python3
"""Show how every node does, and what to do about what is wrong; see --help."""

import _project

_project.main("hri_sim.tools.watch_health")
