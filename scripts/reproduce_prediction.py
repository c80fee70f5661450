#!/usr/bin/env python3
"""Evaluate the predictor on all data and write the table of the documentation; see --help."""

import _project

_project.main("hri_sim.evaluation.reproduce")
