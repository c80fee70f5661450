#!/usr/bin/env python3
"""Search the places of all cases of interaction, for simulated dyads; see --help."""

import _project

_project.main("hri_sim.ontology.layouts_command")
