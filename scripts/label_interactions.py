#!/usr/bin/env python3
"""Say what kind of interaction each movement of two recorded people is; see --help."""

import _project

_project.main("hri_prediction.ontology.label_command")
