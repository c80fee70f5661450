#!/usr/bin/env python3
"""Train what tells the cases of interaction apart; see --help."""

import _project

_project.main("hri_sim.ontology.training_command")
