"""C compiler: find it, identify it, and compile generated text; no other program is run."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import signal
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from mstmm.errors import EnvironmentFailure

if TYPE_CHECKING:
    from ..host.process import Ended

#: Wall time, s, after which a compilation is stopped, and the variable that overrides it.
TIMEOUT, TIMEOUT_VARIABLE = 300.0, "MSTMM_COMPILE_TIMEOUT"

#: Messages for a full disk, an exhausted quota and a file size limit.
_NO_ROOM = (
    "No space left on device", "Disk quota exceeded", "File too large", "File size limit exceeded",
)  # fmt: skip

#: Messages of gcc and clang for an unknown option.
_UNKNOWN = re.compile("unknown argument|unrecognized|unsupported option|not supported")

#: Environment variables that change the headers and libraries that gcc and clang use.
_VARIABLES = ("CPATH", "C_INCLUDE_PATH", "LIBRARY_PATH", "COMPILER_PATH", "GCC_EXEC_PREFIX")

_INSTALL = "install one (apt-get install gcc) or set the variable CC"


@dataclass(frozen=True)
class Compiler:
    """C compiler: its command, and the data that distinguish it from another or an updated one."""

    command: tuple[str, ...]
    path: str
    size: int
    modified: int

    def identity(self) -> dict[str, str]:
        """All data that may change the compiler's output, read without running a process."""
        set_here = {name: os.environ[name] for name in _VARIABLES if os.environ.get(name)}
        return {
            "command": shlex.join(self.command), "path": self.path, "size": str(self.size),
            "modified": str(self.modified), "libc": _libc(), **set_here,
        }  # fmt: skip


def compiler() -> Compiler:
    """Find the C compiler: $CC, else gcc, cc or clang.  EnvironmentFailure if there is none."""
    try:
        wanted = shlex.split(os.environ.get("CC") or "")
    except ValueError:
        raise EnvironmentFailure(f"CC={os.environ['CC']!r} is not a command; {_INSTALL}") from None
    for words in [wanted] if wanted else [["gcc"], ["cc"], ["clang"]]:
        program = shutil.which(words[0])
        if program is not None:
            return _identified((os.path.abspath(program), *words[1:]))
    missing = f"CC names {wanted[0]}, which does not exist" if wanted else "no gcc, cc or clang"
    raise EnvironmentFailure(f"no C compiler found ({missing}); {_INSTALL}")


def _identified(command: tuple[str, ...]) -> Compiler:
    path = os.path.realpath(command[0])
    try:
        status = os.stat(path)
    except OSError as error:
        raise EnvironmentFailure(
            f"the C compiler {path} cannot be examined ({error.strerror}); {_INSTALL}"
        ) from None
    return Compiler(command, path, status.st_size, status.st_mtime_ns)


def _libc() -> str:
    try:
        return os.confstr("CS_GNU_LIBC_VERSION") or "unknown"
    except (AttributeError, OSError, ValueError):
        return "unknown"


def time_limit() -> float:
    """Maximum wall time of a compilation, s: that of the variable, or 300."""
    text = os.environ.get(TIMEOUT_VARIABLE)
    if not text:
        return TIMEOUT
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 < value < 1e6:
        raise EnvironmentFailure(
            f"{TIMEOUT_VARIABLE}={text!r}: expected the maximum time of a compilation in s, "
            "such as 300"
        )
    return value


def version(found: Compiler, folder: Path) -> str:
    """First line of the output of `--version`, run in `folder`."""
    from ..host.process import Hanging, run

    try:
        ended = run([*found.command, "--version"], folder, 10.0)
    except (Hanging, OSError):
        return "unknown"
    lines = ended.said.splitlines()
    return lines[0].strip() if ended.code == 0 and lines else "unknown"


def library_suffix() -> str:
    """Ending of shared libraries on this platform."""
    return ".dylib" if sys.platform == "darwin" else ".so"


@dataclass(frozen=True)
class Compilation:
    """Wall time of a successful compilation, s, and the flags that it used."""

    seconds: float
    flags: tuple[str, ...]


def build(
    found: Compiler, sources: Sequence[Path], target: Path, flags: Sequence[str],
    optional: Sequence[str], timeout: float,
) -> Compilation:  # fmt: skip
    """Compile `sources`, all in one folder, into the shared library `target`.

    Flags that are also in `optional` are omitted if the compiler does not support them.  All files
    of the compiler, also temporary ones, are in that folder, so that its removal removes them all.
    Raises EnvironmentFailure, one line, if the compiler cannot be run, fails, is killed, does not
    end within `timeout` s, or writes no library.
    """
    begin = time.perf_counter()
    kept = tuple(flags)
    while True:
        ended = _compiled(found, sources, target, kept, timeout)
        unknown = _unknown(ended, optional) & set(kept)
        if not unknown:
            break
        kept = tuple(flag for flag in kept if flag not in unknown)
    if ended.code != 0:
        raise EnvironmentFailure(_reason(found, ended, sources[0].name))
    if not target.is_file() or target.stat().st_size == 0:
        raise EnvironmentFailure(
            f"the C compiler {found.command[0]} reported success but wrote no library; "
            "see mstmm doctor"
        )
    return Compilation(time.perf_counter() - begin, kept)


def _unknown(ended: Ended, optional: Sequence[str]) -> set[str]:
    """Optional flags that a failed compiler names in a message about unknown options."""
    complaints = [line for line in ended.said.splitlines() if _UNKNOWN.search(line)]
    named = {word.strip("'\"`‘’;,") for line in complaints for word in line.split()}
    return named & set(optional) if ended.code != 0 else set()


def _compiled(
    found: Compiler, sources: Sequence[Path], target: Path, flags: Sequence[str], timeout: float
) -> Ended:
    from ..host.process import Hanging, run

    folder = sources[0].parent
    command = [*found.command, *flags, "-fPIC", "-shared", *map(str, sources), "-lm"]
    try:
        return run([*command, "-o", str(target)], folder, timeout, TMPDIR=str(folder))
    except Hanging:
        raise EnvironmentFailure(
            f"the C compiler {found.command[0]} did not finish within {timeout:g} s of wall time "
            f"and was stopped; set {TIMEOUT_VARIABLE} to more seconds, or see mstmm doctor"
        ) from None
    except OSError as error:
        raise EnvironmentFailure(
            f"the C compiler {found.command[0]} could not be run ({error.strerror}); "
            "see mstmm doctor"
        ) from None


def _reason(found: Compiler, ended: Ended, source: str) -> str:
    """Reason that a compilation failed, one line with a remedy."""
    program = found.command[0]
    if any(text in ended.said for text in _NO_ROOM) or ended.code == -signal.SIGXFSZ:
        return (
            f"the C compiler {program} found no space on the disk; free some, or choose another "
            "folder (MSTMM_CACHE; for user-defined elements MSTMM_KERNELS)"
        )
    if ended.code < 0:
        hint = " (too little memory?)" if -ended.code == signal.SIGKILL else ""
        return f"the C compiler {program} was killed by {ended.signal()}{hint}; see mstmm doctor"
    lines = [line.strip() for line in ended.said.splitlines() if line.strip()]
    first = next((line for line in lines if "error" in line), lines[-1] if lines else "no message")
    shown = "".join(c if c.isprintable() else " " for c in first)[:300]
    return (
        f"the C compiler {program} could not compile {source} (exit code {ended.code}: {shown}); "
        "see mstmm doctor"
    )
