#!/usr/bin/env python3
"""Put the hybrid predictor on trial: first guesses, learning, latency; see --help."""

import _project

_project.main("hri_sim.hybrid.command")
