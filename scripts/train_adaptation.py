#!/usr/bin/env python3
"""Train parameter adaptation on simulated motions; see --help."""

import _project

_project.main("hri_sim.adaptation.command")
