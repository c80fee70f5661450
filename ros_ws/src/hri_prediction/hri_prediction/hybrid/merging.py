"""Libraries of all people and of one, as one."""

from __future__ import annotations

from dataclasses import replace

from hri_prediction.errors import DataError
from hri_prediction.prediction.library import TaskLibrary


def merged(common: TaskLibrary | None, personal: TaskLibrary) -> TaskLibrary:
    """What one person may do: own tasks, and those of all people.

    Args:
        common: Of all; none: there is none.
        personal: Of one. Its lengths count, and where names are the same, its tasks.

    Raises:
        DataError: they have different bases.
    """
    if common is None:
        return personal
    basis, own = common.tasks[0].promp.basis, personal.tasks[0].promp.basis
    if basis != own:
        raise DataError(
            f"a library with {basis}", expected=f"{own}, as weights_per_dim of this predictor says"
        )
    known = {(task.name, task.side) for task in personal.tasks}
    others = tuple(task for task in common.tasks if (task.name, task.side) not in known)
    return replace(personal, tasks=(*personal.tasks, *others))
