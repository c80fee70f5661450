"""All lines of the table of faults."""

from __future__ import annotations

from hri_sim.faults.capture import CAPTURE
from hri_sim.faults.damaged import DAMAGED
from hri_sim.faults.disturbances import DISTURBANCES
from hri_sim.faults.goals import GOALS
from hri_sim.faults.imports import IMPORTS
from hri_sim.faults.models import MODELS
from hri_sim.faults.processes import PROCESS_FAULTS
from hri_sim.faults.recording import RECORDING

FAULTS = (*PROCESS_FAULTS, *DISTURBANCES, *CAPTURE, *GOALS, *RECORDING, *DAMAGED, *MODELS, *IMPORTS)
"""In the order of the table."""
