#!/usr/bin/env python3
"""Play a recording into the mocap topics; see --help."""

import _project

_project.main("hri_sim.tools.replay_mocap", graph=True)
