"""Reading files that are files, and writing them so that a reader never sees half of one."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mstmm.errors import EnvironmentFailure, SceneError


def refuse_special(path: Path, where: str) -> None:
    """SceneError for a folder, a device or a named pipe, which a reader would wait on for ever.

    A file that is missing is left to whoever opens it.
    """
    if os.path.exists(path) and not os.path.isfile(path):  # False where a folder is closed to us
        raise SceneError(f"{where}: {path} is not a regular file; give the path of one")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary file beside `path` that takes its name when the block ends well.

    Raises EnvironmentFailure, with the old file untouched, if anything cannot be written.
    """
    temporary: Path | None = None
    try:
        handle, name = tempfile.mkstemp(path.suffix, f".{path.stem}.", path.parent)
        os.close(handle)
        temporary = Path(name)
        yield temporary
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(0o666 & ~mask)
        temporary.replace(path)
    except OSError as error:
        reason = error.strerror or str(error)
        raise EnvironmentFailure(f'"{path}" cannot be written: {reason}') from error
    finally:
        if temporary is not None:
            temporary.unlink(missing_ok=True)
