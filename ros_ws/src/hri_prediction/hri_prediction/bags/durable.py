"""Files that a power cut does not take away again."""

from __future__ import annotations

import errno
import os

_UNABLE = (errno.EINVAL, errno.ENOSYS, errno.EOPNOTSUPP)


def sync(descriptor: int) -> None:
    """Wait until the disk has what the operating system has of a file or folder.

    A file system that knows no syncing is left alone.

    Args:
        descriptor: Descriptor of the open file or folder.

    Raises:
        OSError: the disk did not take it; which part is missing is not known.
    """
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in _UNABLE:
            raise
