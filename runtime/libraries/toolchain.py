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
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from mstmm.errors import EnvironmentFailure

if TYPE_CHECKING:
    from ..platform_support.subprocesses import ProcessResult


#: Wall time, s, after which a compilation is stopped, and the variable that overrides it.
TIMEOUT, TIMEOUT_VARIABLE = 300.0, "MSTMM_COMPILE_TIMEOUT"

#: Messages for a full disk, an exhausted quota and a file size limit.
_NO_SPACE_MESSAGES = (
    "No space left on device", "Disk quota exceeded", "File too large", "File size limit exceeded",
)  # fmt: skip

#: Messages of gcc and clang for an unknown option.
_UNKNOWN_OPTION = re.compile("unknown argument|unrecognized|unsupported option|not supported")

#: Environment variables that change the headers and libraries that gcc and clang use.
_SEARCH_PATH_VARIABLES = (
    "CPATH",
    "C_INCLUDE_PATH",
    "LIBRARY_PATH",
    "COMPILER_PATH",
    "GCC_EXEC_PREFIX",
)

_INSTALL_REMEDY = "install one (apt-get install gcc) or set the variable CC"


@dataclass(frozen=True)
class Compiler:
    """C compiler: its command, and the data that distinguish it from another or an updated one."""

    command: tuple[str, ...]
    path: str
    size: int
    modified: int

    def identity(self) -> dict[str, str]:
        """All data that may change the compiler's output, read without running a process."""
        search_paths = {
            name: os.environ[name] for name in _SEARCH_PATH_VARIABLES if os.environ.get(name)
        }
        return {
            "command": shlex.join(self.command), "path": self.path, "size": str(self.size),
            "modified": str(self.modified), "libc": _libc_version(), **search_paths,
        }  # fmt: skip


def find_compiler() -> Compiler:
    """Find the C compiler: $CC, else gcc, cc or clang.  EnvironmentFailure if there is none."""
    try:
        configured_words = shlex.split(os.environ.get("CC") or "")
    except ValueError:
        raise EnvironmentFailure(
            f"CC={os.environ['CC']!r} is not a command; {_INSTALL_REMEDY}"
        ) from None
    for words in [configured_words] if configured_words else [["gcc"], ["cc"], ["clang"]]:
        program = shutil.which(words[0])
        if program is not None:
            return _identify_compiler((os.path.abspath(program), *words[1:]))
    missing = (
        f"CC names {configured_words[0]}, which does not exist"
        if configured_words
        else "no gcc, cc or clang"
    )
    raise EnvironmentFailure(f"no C compiler found ({missing}); {_INSTALL_REMEDY}")


def _identify_compiler(command: tuple[str, ...]) -> Compiler:
    path = os.path.realpath(command[0])
    try:
        status = os.stat(path)
    except OSError as error:
        raise EnvironmentFailure(
            f"the C compiler {path} cannot be examined ({error.strerror}); {_INSTALL_REMEDY}"
        ) from None
    return Compiler(command, path, status.st_size, status.st_mtime_ns)


def _libc_version() -> str:
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


def compiler_version(found: Compiler, folder: Path) -> str:
    """First line of the output of `--version`, run in `folder`."""
    from ..platform_support.subprocesses import ProcessTimeout, run

    try:
        result = run([*found.command, "--version"], folder, 10.0)
    except (ProcessTimeout, OSError):
        return "unknown"
    lines = result.output.splitlines()
    return lines[0].strip() if result.code == 0 and lines else "unknown"


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
    start_time = time.perf_counter()
    kept_flags = tuple(flags)
    while True:
        result = _run_compiler(found, sources, target, kept_flags, timeout)
        unsupported = _unsupported_flags(result, optional) & set(kept_flags)
        if not unsupported:
            break
        kept_flags = tuple(flag for flag in kept_flags if flag not in unsupported)
    if result.code != 0:
        raise EnvironmentFailure(_failure_text(found, result, sources[0].name))
    if not target.is_file() or target.stat().st_size == 0:
        raise EnvironmentFailure(
            f"the C compiler {found.command[0]} reported success but wrote no library; "
            "see mstmm doctor"
        )
    return Compilation(time.perf_counter() - start_time, kept_flags)


def _unsupported_flags(ended: ProcessResult, optional: Sequence[str]) -> set[str]:
    """Optional flags that a failed compiler names in a message about unknown options."""
    complaints = [line for line in ended.output.splitlines() if _UNKNOWN_OPTION.search(line)]
    mentioned_words = {word.strip("'\"`‘’;,") for line in complaints for word in line.split()}
    return mentioned_words & set(optional) if ended.code != 0 else set()


def _run_compiler(
    found: Compiler, sources: Sequence[Path], target: Path, flags: Sequence[str], timeout: float
) -> ProcessResult:
    from ..platform_support.subprocesses import ProcessTimeout, run

    folder = sources[0].parent
    command = [*found.command, *flags, "-fPIC", "-shared", *map(str, sources), "-lm"]
    try:
        return run([*command, "-o", str(target)], folder, timeout, TMPDIR=str(folder))
    except ProcessTimeout:
        raise EnvironmentFailure(
            f"the C compiler {found.command[0]} did not finish within {timeout:g} s of wall time "
            f"and was stopped; set {TIMEOUT_VARIABLE} to more seconds, or see mstmm doctor"
        ) from None
    except OSError as error:
        raise EnvironmentFailure(
            f"the C compiler {found.command[0]} could not be run ({error.strerror}); "
            "see mstmm doctor"
        ) from None


def _failure_text(found: Compiler, ended: ProcessResult, source: str) -> str:
    """Reason that a compilation failed, one line with a remedy."""
    program = found.command[0]
    if any(text in ended.output for text in _NO_SPACE_MESSAGES) or ended.code == -signal.SIGXFSZ:
        return (
            f"the C compiler {program} found no space on the disk; free some, or choose another "
            "folder (MSTMM_CACHE; for user-defined elements MSTMM_KERNELS)"
        )
    if ended.code < 0:
        hint = " (too little memory?)" if -ended.code == signal.SIGKILL else ""
        return f"the C compiler {program} was killed by {ended.signal()}{hint}; see mstmm doctor"
    lines = [line.strip() for line in ended.output.splitlines() if line.strip()]
    error_line = next(
        (line for line in lines if "error" in line), lines[-1] if lines else "no message"
    )
    printable_line = "".join(c if c.isprintable() else " " for c in error_line)[:300]
    return (
        f"the C compiler {program} could not compile {source} (exit code {ended.code}: "
        f"{printable_line}); see mstmm doctor"
    )


# --- processor: features that -march=native uses; a library for one may crash on another ----------

#: Lines of /proc/cpuinfo that do not change while the machine runs: x86, then ARM, then others.
_CONSTANT_LINES = (
    "vendor_id", "cpu family", "model", "model name", "stepping", "flags",
    "CPU implementer", "CPU architecture", "CPU variant", "CPU part", "CPU revision", "Features",
    "cpu", "isa", "uarch", "features",
)  # fmt: skip


@cache
def processor_features(source: Path = Path("/proc/cpuinfo")) -> dict[str, str]:
    """Fields of the first processor in /proc/cpuinfo, and the machine type.

    Where no features are listed the host name is added, so that no two machines share a library:
    slow, but safe.
    """
    lines_found = _first_block(source)
    if not {"flags", "Features", "isa", "features"} & lines_found.keys():
        lines_found["host"] = os.uname().nodename
    return lines_found | {"machine": os.uname().machine}


def _first_block(source: Path) -> dict[str, str]:
    try:
        with source.open("rb", buffering=0) as file:  # one read: every listed processor costs time
            text = file.read(16384)
    except OSError:
        return {}
    block = text.split(b"\n\n", 1)[0].decode("utf-8", "replace")
    lines = (line.partition(":") for line in block.splitlines())
    return {
        name.strip(): value.strip() for name, _, value in lines if name.strip() in _CONSTANT_LINES
    }
