"""The C compiler: found, asked for its version, and run on generated text.  Nothing else is."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from mstmm.errors import EnvironmentFailure

from .build_extension import COMPILE_ARGS

#: Seconds after which a compiler is taken for hanging.
TIMEOUT = 120.0


def compiler() -> str | None:
    """Path of the C compiler: $CC, else gcc, cc or clang; None if there is none."""
    wanted = os.environ.get("CC")
    for name in (wanted,) if wanted else ("gcc", "cc", "clang"):
        found = shutil.which(name)
        if found:
            return found
    return None


def library_suffix() -> str:
    """Ending of shared libraries on this platform."""
    return {"darwin": ".dylib", "win32": ".dll"}.get(sys.platform, ".so")


def build(sources: list[Path], target: Path) -> None:
    """Compile `sources` into the shared library `target`; nothing is left behind on failure.

    The library is built beside the target and renamed, so that no reader sees half a file.
    Raises EnvironmentFailure with the compiler's first lines if it fails, hangs or is missing.
    """
    program = compiler()
    if program is None:
        raise EnvironmentFailure(
            "no C compiler found (gcc, cc, clang, or the one named by CC); install one, "
            "for example: apt-get install gcc"
        )
    handle, temporary = tempfile.mkstemp(suffix=library_suffix(), dir=target.parent)
    os.close(handle)
    flags = [flag for flag in COMPILE_ARGS if flag != "-fvisibility=hidden"]
    command = [program, *flags, "-fPIC", "-shared", *map(str, sources), "-lm", "-o", temporary]
    try:
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            timeout=TIMEOUT,
            check=False,
            stdin=subprocess.DEVNULL,
        )
        if done.returncode != 0:
            first = (
                "\n".join(done.stderr.strip().splitlines()[:5]) or f"exit code {done.returncode}"
            )
            raise EnvironmentFailure(f"{program} could not compile {sources[0].name}: {first}")
        os.replace(temporary, target)
    except subprocess.TimeoutExpired:
        raise EnvironmentFailure(f"{program} did not finish within {TIMEOUT:g} s") from None
    except OSError as error:
        raise EnvironmentFailure(f"{program} could not be run: {error}") from error
    finally:
        Path(temporary).unlink(missing_ok=True)
