"""`mstmm doctor`: checks of compiler, CPU, cache, packages and kernels, and two test runs.

Each check returns findings and raises nothing; a problem includes its remedy.
"""

from __future__ import annotations

import platform
import shutil
import stat
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from mstmm.errors import EnvironmentFailure, MstmmError

from .error_boundary import ENVIRONMENT
from .options import Json
from .terminal_output import print_json, print_lines

if TYPE_CHECKING:
    from mstmm.runtime.model.model import Model
    from mstmm.scene import Scene

#: (scene, engine) -> model.
Compile = Callable[["Scene", str], "Model"]

#: Packages needed for runs or derivations.
PACKAGES = ("mstmm", "numpy", "scipy", "cffi", "sympy", "jinja2", "pydantic")

#: Free disk space, bytes, below which a problem is reported.
_MIN_FREE_BYTES = 50_000_000


@dataclass(frozen=True)
class Diagnosis:
    """Finding of a check; `ok` is False if an action is necessary."""

    subject: str
    ok: bool
    text: str
    data: dict[str, Any] = field(default_factory=dict)


def doctor(json: Json = False) -> None:
    """Diagnose compiler, CPU, cache, packages and kernels, with two test runs."""
    from mstmm.abi.fused_library import COMPILER_FLAGS, OPTIONAL_FLAGS
    from mstmm.pipeline.compilation import compile_scene

    interpreter = f"{sys.executable} on {platform.platform()}"
    findings = list(run_diagnostics(compile_scene, COMPILER_FLAGS, OPTIONAL_FLAGS))
    problems = sum(not finding.ok for finding in findings)
    if json:
        rows = [vars(finding) for finding in findings]
        print_json({"ok": not problems, "interpreter": interpreter, "findings": rows})
    else:
        print_lines(interpreter)
        width = max(len(finding.subject) for finding in findings)
        for finding in findings:
            mark = "ok     " if finding.ok else "PROBLEM"
            print_lines(f"{mark}  {finding.subject:<{width}}  {finding.text}")
        plural = "s" if problems > 1 else ""
        print_lines(
            f"{problems} problem{plural}; each line gives the remedy."
            if problems
            else "No problems found."
        )
    if problems:
        raise typer.Exit(ENVIRONMENT)


def run_diagnostics(
    compiled: Compile, flags: Sequence[str], optional: Sequence[str] = ()
) -> Iterator[Diagnosis]:
    """Run all checks and yield their findings, in logical order.

    `compiled(scene, engine)` returns the model of a scene (mstmm.compile).  `flags` are the
    compiler flags of fused code, `optional` those that a compiler need not support.
    """
    yield from _check_versions()
    yield from _check_processor()
    yield from _check_compiler(flags)
    yield from _check_cache()
    yield from _check_prebuilt(compiled)
    yield from _check_local_build(compiled, flags, optional)


# --- environment ----------------------------------------------------------------------------------


def _check_versions() -> Iterator[Diagnosis]:
    versions_found = {"python": platform.python_version()}
    missing = []
    for name in PACKAGES:
        try:
            versions_found[name] = version(name)
        except PackageNotFoundError:
            missing.append(name)
    text = ", ".join(f"{name} {number}" for name, number in versions_found.items())
    if missing:
        text += f"; missing: {', '.join(missing)}: pip install {' '.join(missing)}"
    yield Diagnosis("versions", not missing, text, {"versions": versions_found, "missing": missing})


def _check_processor() -> Iterator[Diagnosis]:
    from mstmm.runtime.libraries.toolchain import processor_features

    features = processor_features()
    flags = set((features.get("flags") or features.get("Features") or "").split())
    vector_extensions = [
        name for name in ("avx512f", "avx2", "fma", "asimd", "sve") if name in flags
    ]
    name = features.get("model name") or features.get("CPU part") or features["machine"]
    extensions = ", ".join(vector_extensions) or "no vector extensions found"
    text = f"{name} ({features['machine']}; {extensions})"
    yield Diagnosis("processor", True, text, dict(features))


def _check_compiler(flags: Sequence[str]) -> Iterator[Diagnosis]:
    from mstmm.runtime.libraries import toolchain

    try:
        compiler_found = toolchain.find_compiler()
    except EnvironmentFailure as error:
        text = f"{error}; until then scenes use the looped engine, and user-defined hinges are slow"
        yield Diagnosis("compiler", False, text)
        return
    with tempfile.TemporaryDirectory(prefix="mstmm-doctor-") as folder:
        version_text = toolchain.compiler_version(compiler_found, Path(folder))
    text = f"{' '.join(compiler_found.command)}: {version_text}"
    yield Diagnosis("compiler", True, text, {**compiler_found.identity(), "version": version_text})
    yield Diagnosis("flags", True, " ".join(flags), {"flags": list(flags)})


def _check_cache() -> Iterator[Diagnosis]:
    from mstmm.runtime.libraries import cache_files
    from mstmm.runtime.libraries.cache import list_entries

    try:
        cache_path, size_limit = cache_files.private_folder(), cache_files.size_limit()
        with tempfile.TemporaryFile(dir=cache_path) as file:
            file.write(b"\0" * 4096)
    except EnvironmentFailure as error:
        yield Diagnosis("cache", False, str(error))
        return
    except OSError as error:
        reason = f"not writable ({error.strerror})"
        text = f"{cache_path} is {reason}; free disk space or change permissions"
        yield Diagnosis("cache", False, f"{text}, or set {cache_files.VARIABLE}")
        return
    entries = list_entries(cache_path)
    size, free = sum(entry.bytes for entry in entries), shutil.disk_usage(cache_path).free
    mode = stat.S_IMODE(cache_path.stat().st_mode)
    data = {
        "folder": str(cache_path), "mode": f"{mode:04o}", "entries": len(entries), "bytes": size,
        "limit": size_limit, "free": free,
    }  # fmt: skip
    number = "1 library" if len(entries) == 1 else f"{len(entries)} libraries"
    text = (
        f"{cache_path} (mode {mode:04o}): {number}, {size / 1e6:.1f} of "
        f"{size_limit / 1e6:.0f} MB; {free / 1e6:.0f} MB free on the disk"
    )
    yield Diagnosis("cache", True, text, data)
    if free < _MIN_FREE_BYTES:
        text = f"only {free / 1e6:.1f} MB are free in {cache_path}; free disk space"
        yield Diagnosis("cache", False, text)
    damaged = [entry.folder.name for entry in entries if entry.problem]
    if damaged:
        text = f"{len(damaged)} corrupt ({', '.join(damaged[:3])}); they are rebuilt when used"
        yield Diagnosis("cache", False, f"{text}, or remove them: mstmm cache clean")


# --- test runs ------------------------------------------------------------------------------------


def _check_prebuilt(compiled: Compile) -> Iterator[Diagnosis]:
    from mstmm.runtime.kernels import prebuilt_kernels

    try:
        names = sorted(f"{kind} {name}" for kind, name in prebuilt_kernels.elements())
    except Exception as error:  # a broken library may raise anything
        yield _failed_trial("kernels", error)
        return
    yield Diagnosis("kernels", True, f"{len(names)} prebuilt elements", {"elements": names})
    yield _run_trial("looped engine", lambda: _test_pendulum(compiled, "looped"))


def _check_local_build(
    compiled: Compile, flags: Sequence[str], optional: Sequence[str]
) -> Iterator[Diagnosis]:
    """Test of a compiled kernel, then of a fused scene."""
    from mstmm.runtime.libraries import toolchain

    try:
        toolchain.find_compiler()
    except EnvironmentFailure:
        return  # reported by `_check_compiler`
    trial = _run_trial("compiling", lambda: _test_library(flags, optional))
    yield trial
    if trial.ok:
        yield _run_trial("fused engine", lambda: _test_pendulum(compiled, "fused"))


def _run_trial(subject: str, trial: Callable[[], str]) -> Diagnosis:
    try:
        return Diagnosis(subject, True, trial())
    except Exception as error:  # any failure must leave the other findings available
        return _failed_trial(subject, error)


def _failed_trial(subject: str, error: Exception) -> Diagnosis:
    text = f"{type(error).__name__}: {error}; reinstall mstmm"
    return Diagnosis(subject, False, str(error) if isinstance(error, MstmmError) else text)


def _test_library(flags: Sequence[str], optional: Sequence[str]) -> str:
    """Compile a kernel with the flags of fused code, call it and compare with exact values."""
    from mstmm.runtime.libraries.library_build import BuildOrder, get_or_build
    from mstmm.runtime.libraries.toolchain import TIMEOUT

    text = (
        "#include <math.h>\n"
        "int trial(const double *x, double *y)\n"
        "{ for (int i = 0; i < 64; ++i) y[i] = sqrt(x[i]) + 2.0 * x[i]; return 0; }\n"
    )
    with tempfile.TemporaryDirectory(prefix="mstmm-doctor-") as folder:
        order = BuildOrder(
            "trial", "0" * 64, lambda key: {"trial.c": text}, tuple(flags), ("trial",), "TMPDIR",
            optional=tuple(optional),
        )  # fmt: skip
        built = get_or_build(Path(folder) / "trial", order, min(TIMEOUT, 60.0))
        largest_error = _trial_error(built.path)
    if not largest_error <= 1e-15:
        raise EnvironmentFailure(
            f"a test kernel gives wrong numbers (relative error {largest_error:.1e}); "
            "use another compiler: set CC"
        )
    return f"a test kernel compiled in {built.seconds:.2f} s and gives correct numbers"


def _trial_error(path: Path) -> float:
    import cffi

    ffi = cffi.FFI()
    ffi.cdef("int trial(const double *x, double *y);")
    lib: Any = ffi.dlopen(str(path))
    x, y = [0.37 * i for i in range(64)], ffi.new("double[]", 64)
    lib.trial(ffi.new("double[]", x), y)
    expected = [value**0.5 + 2.0 * value for value in x]
    largest_error = max(abs(a - b) / max(b, 1.0) for a, b in zip(y, expected, strict=True))
    ffi.dlclose(lib)
    return largest_error


def _test_pendulum(compiled: Compile, engine: str) -> str:
    """Simulate a pendulum for one period, known from the complete elliptic integral."""
    import numpy as np
    from scipy.special import ellipk

    from mstmm.scene import Scene

    mass, arm, inertia, g, start = 1.3, 0.45, 0.09, 9.81, 1.1
    rod = {
        "name": "rod", "mass": mass, "center_of_mass": [arm, 0, 0],
        "inertia": [0.001, inertia, inertia],
    }  # fmt: skip
    pivot = {
        "name": "pivot", "type": "pin", "inboard": "ground", "outboard": "rod", "axis": [0, 0, 1],
        "initial": {"q": [start]},
    }  # fmt: skip
    scene = Scene.model_validate({"gravity": [g, 0, 0], "body": [rod], "hinge": [pivot]})
    model = compiled(scene, engine)
    squared_frequency = mass * g * arm / (inertia + mass * arm**2)  # rad^2/s^2
    angles = np.linspace(-3.0, 3.0, 25)[:, None]
    accelerations = model.accelerations(angles, np.zeros_like(angles))
    acceleration_error = float(
        np.abs(accelerations + squared_frequency * np.sin(angles)).max() / squared_frequency
    )
    period = float(4.0 * ellipk(np.sin(start / 2) ** 2) / np.sqrt(squared_frequency))
    run = model.simulate(period, rtol=1e-10, atol=1e-12)
    drift = abs(float(run.q[-1, 0]) - start) if run.success else float("inf")
    if not (acceleration_error <= 1e-13 and drift <= 1e-7):
        raise EnvironmentFailure(
            f"a pendulum differs from its closed form by {acceleration_error:.1e} (accelerations) "
            f"and {drift:.1e} rad (after a period); reinstall mstmm: pip install --force-reinstall "
            "mstmm"
        )
    return (
        f"a pendulum agrees with its closed form (accelerations {acceleration_error:.0e}, "
        f"a period {drift:.0e} rad)"
    )
