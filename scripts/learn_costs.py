#!/usr/bin/env python3
"""Learn by which costs people move beside each other; see --help."""

import _project

_project.main("hri_sim.ontology.costs_command")
