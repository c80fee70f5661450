#!/usr/bin/env python3
"""Make a track file or a bag from a motion capture recording; see --help."""

import _project

_project.main("hri_prediction.tracks.importers.cli")
