#!/usr/bin/env python3
"""List, rename and forget people that the hybrid predictor has learnt; see --help."""

import _project

_project.main("hri_prediction.hybrid.people_command")
