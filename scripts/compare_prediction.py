#!/usr/bin/env python3
"""Hold recorded predictions against those made offline; see --help."""

import _project

_project.main("hri_prediction.evaluation.cli")
