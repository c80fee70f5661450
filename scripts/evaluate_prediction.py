#!/usr/bin/env python3
"""Measure the predictor on simulated or recorded reaches, beside simple ones; see --help."""

import _project

_project.main("hri_sim.evaluation.evaluate")
