#!/usr/bin/env python3
"""Measure what the recorder takes without loss; see --help."""

import _project

_project.main("hri_sim.recording.benchmark", graph=True)
