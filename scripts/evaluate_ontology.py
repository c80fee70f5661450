#!/usr/bin/env python3
"""Measure how well the cases of interaction are told apart; see --help."""

import _project

_project.main("hri_sim.ontology.evaluation_command")
