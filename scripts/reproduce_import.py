#!/usr/bin/env python3
"""Import the recordings of other programs and write the table of the outcomes; see --help."""

import _project

_project.main("hri_prediction.tracks.importers.reproduce")
