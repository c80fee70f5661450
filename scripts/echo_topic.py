#!/usr/bin/env python3
"""Print the messages, or the rate, of a topic; see --help."""

import _project

_project.main("hri_sim.tools.echo_topic")
