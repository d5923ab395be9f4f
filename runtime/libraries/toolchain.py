"""The C compiler: found, told apart from others, and run on generated text.  Nothing else is."""

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

#: Seconds of wall time after which a compiler is taken for hanging, and the variable that says
#: otherwise.
TIMEOUT, TIMEOUT_VARIABLE = 300.0, "MSTMM_COMPILE_TIMEOUT"

#: What a full disk, a used-up quota and a limit on files are called.
_NO_ROOM = (
    "No space left on device", "Disk quota exceeded", "File too large", "File size limit exceeded",
)  # fmt: skip

#: How gcc and clang say that they do not know an option.
_UNKNOWN = re.compile("unknown argument|unrecognized|unsupported option|not supported")

#: Variables by which gcc and clang find other headers and libraries.
_VARIABLES = ("CPATH", "C_INCLUDE_PATH", "LIBRARY_PATH", "COMPILER_PATH", "GCC_EXEC_PREFIX")

_INSTALL = "install one (apt-get install gcc) or name one by the variable CC"


@dataclass(frozen=True)
class Compiler:
    """A C compiler: how it is called, and what tells it from another or an updated one."""

    command: tuple[str, ...]
    path: str
    size: int
    modified: int

    def identity(self) -> dict[str, str]:
        """All that may change what it makes of a text, without asking it (no process is run)."""
        set_here = {name: os.environ[name] for name in _VARIABLES if os.environ.get(name)}
        return {
            "command": shlex.join(self.command), "path": self.path, "size": str(self.size),
            "modified": str(self.modified), "libc": _libc(), **set_here,
        }  # fmt: skip


def compiler() -> Compiler:
    """The compiler: $CC, else gcc, cc or clang.  EnvironmentFailure if there is none."""
    try:
        wanted = shlex.split(os.environ.get("CC") or "")
    except ValueError:
        raise EnvironmentFailure(f"CC={os.environ['CC']!r} is not a command; {_INSTALL}") from None
    for words in [wanted] if wanted else [["gcc"], ["cc"], ["clang"]]:
        program = shutil.which(words[0])
        if program is not None:
            return _identified((os.path.abspath(program), *words[1:]))
    missing = f"CC names {wanted[0]}, which is not there" if wanted else "no gcc, cc or clang"
    raise EnvironmentFailure(f"no C compiler found ({missing}); {_INSTALL}")


def _identified(command: tuple[str, ...]) -> Compiler:
    path = os.path.realpath(command[0])
    try:
        status = os.stat(path)
    except OSError as error:
        raise EnvironmentFailure(
            f"the C compiler {path} cannot be looked at ({error.strerror}); {_INSTALL}"
        ) from None
    return Compiler(command, path, status.st_size, status.st_mtime_ns)


def _libc() -> str:
    try:
        return os.confstr("CS_GNU_LIBC_VERSION") or "unknown"
    except (AttributeError, OSError, ValueError):
        return "unknown"


def time_limit() -> float:
    """Seconds of wall time that a compiler may take, the variable's or 300."""
    text = os.environ.get(TIMEOUT_VARIABLE)
    if not text:
        return TIMEOUT
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 < value < 1e6:
        raise EnvironmentFailure(
            f"{TIMEOUT_VARIABLE}={text!r}: expected the longest time of a compilation in s, "
            "such as 300"
        )
    return value


def version(found: Compiler, folder: Path) -> str:
    """First line of what `--version` answers, asked in `folder`."""
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
    """What a successful compiler took, s, and the flags it was given in the end."""

    seconds: float
    flags: tuple[str, ...]


def build(
    found: Compiler, sources: Sequence[Path], target: Path, flags: Sequence[str],
    optional: Sequence[str], timeout: float,
) -> Compilation:  # fmt: skip
    """Compile `sources`, all in one folder, into the shared library `target`.

    Those of `flags` that are in `optional` too are left out if the compiler does not know them.
    Everything the compiler writes, its temporary files too, lies in that folder: whoever removes
    it leaves nothing behind.  Raises EnvironmentFailure, one line, if the compiler cannot be run,
    fails, is killed, does not end within `timeout` s, or leaves no library.
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
            f"the C compiler {found.command[0]} reported success and left no library; "
            "see mstmm doctor"
        )
    return Compilation(time.perf_counter() - begin, kept)


def _unknown(ended: Ended, optional: Sequence[str]) -> set[str]:
    """The optional flags that a failed compiler names in a complaint about options."""
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
    """One line on why a compiler failed."""
    program = found.command[0]
    if any(text in ended.said for text in _NO_ROOM) or ended.code == -signal.SIGXFSZ:
        return (
            f"the C compiler {program} found no room on the disk; make room, or take another "
            "folder (MSTMM_CACHE; of own elements MSTMM_KERNELS)"
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
