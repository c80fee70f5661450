#!/usr/bin/env python3
"""Replay real recordings through the live graph and write the table; see --help."""

import _project

_project.main("hri_sim.launch.reproduce", "main_replay", graph=True)
