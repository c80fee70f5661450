#!/usr/bin/env python3
"""Benchmark motion planners in 450 conditions beside a reaching person; see --help."""

import _project

_project.main("hri_sim.benchmark.command")
