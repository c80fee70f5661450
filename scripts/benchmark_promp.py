#!/usr/bin/env python3
"""Time the ProMP core beside plain NumPy and movement_primitives; see --help."""

import _project

# movement_primitives comes with what tests need.
_project.main("hri_prediction.benchmarks.promp", setup=("--dev",))
