#!/usr/bin/env python3
"""Record simulated people in each case of interaction as bags; see --help."""

import _project

_project.main("hri_sim.tools.simulate_dyads")
