#!/usr/bin/env python3
"""Train learnt policies and make all tables and pictures of them; see --help."""

import _project

_project.main("hri_sim.policy_report.command")
