#!/usr/bin/env python3
"""Measure the planners in all test conditions, write tables and pictures; see --help."""

import _project

_project.main("hri_sim.reproduction.command")
