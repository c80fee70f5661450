#!/usr/bin/env python3
"""Train a task library from bags or track files; see --help."""

import _project

_project.main("hri_prediction.prediction.cli", "train_main")
