#!/usr/bin/env python3
"""Train a policy from two people's hands; see --help."""

import _project

_project.main("hri_sim.policies.training_command")
