#!/usr/bin/env python3
"""Kinds of interaction, beside the thesis: tables, live latency, learnt costs; see --help."""

import _project

_project.main("hri_sim.ontology.reproduction_command")
