#!/usr/bin/env python3
"""Fit what weights of costs to expect of anybody to explained reaches; see --help."""

import _project

_project.main("hri_prediction.hybrid.fit_command")
