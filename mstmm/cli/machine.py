"""Checks of `mstmm doctor`: compiler, CPU, cache, packages, kernels, and two test runs.

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

from mstmm.errors import EnvironmentFailure, MstmmError
from mstmm.scene import Scene

if TYPE_CHECKING:
    from ..runtime.model.model import Model

#: (scene, engine) -> model.
Compile = Callable[[Scene, str], "Model"]

#: Packages needed for runs or derivations.
PACKAGES = ("mstmm", "numpy", "scipy", "cffi", "sympy", "jinja2", "pydantic")

#: Free disk space, bytes, below which a problem is reported.
_LITTLE_ROOM = 50_000_000


@dataclass(frozen=True)
class Finding:
    """Finding of a check; `ok` is False if an action is necessary."""

    subject: str
    ok: bool
    text: str
    data: dict[str, Any] = field(default_factory=dict)


def examine(compiled: Compile, flags: Sequence[str], optional: Sequence[str] = ()) -> list[Finding]:
    """Run all checks and return their findings, in logical order.

    `compiled(scene, engine)` returns the model of a scene (mstmm.compile).  `flags` are the
    compiler flags of fused code, `optional` those that a compiler need not support.
    """
    parts = (
        _versions(), _processor(), _compiler(flags), _cache(), _prebuilt(compiled),
        _built_here(compiled, flags, optional),
    )  # fmt: skip
    return [finding for part in parts for finding in part]


# --- environment ----------------------------------------------------------------------------------


def _versions() -> Iterator[Finding]:
    found = {"python": platform.python_version()}
    missing = []
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            missing.append(name)
    text = ", ".join(f"{name} {number}" for name, number in found.items())
    if missing:
        text += f"; missing: {', '.join(missing)}: pip install {' '.join(missing)}"
    yield Finding("versions", not missing, text, {"versions": found, "missing": missing})


def _processor() -> Iterator[Finding]:
    from ..runtime.libraries import processor

    found = processor.features()
    flags = set((found.get("flags") or found.get("Features") or "").split())
    wide = [name for name in ("avx512f", "avx2", "fma", "asimd", "sve") if name in flags]
    name = found.get("model name") or found.get("CPU part") or found["machine"]
    text = f"{name} ({found['machine']}; {', '.join(wide) or 'no vector extensions found'})"
    yield Finding("processor", True, text, dict(found))


def _compiler(flags: Sequence[str]) -> Iterator[Finding]:
    from ..runtime.libraries import toolchain

    try:
        found = toolchain.compiler()
    except EnvironmentFailure as error:
        text = f"{error}; until then scenes use the looped engine, and user-defined hinges are slow"
        yield Finding("compiler", False, text)
        return
    with tempfile.TemporaryDirectory(prefix="mstmm-doctor-") as folder:
        answer = toolchain.version(found, Path(folder))
    text = f"{' '.join(found.command)}: {answer}"
    yield Finding("compiler", True, text, {**found.identity(), "version": answer})
    yield Finding("flags", True, " ".join(flags), {"flags": list(flags)})


def _cache() -> Iterator[Finding]:
    from ..runtime.libraries import folder as cache_folder
    from ..runtime.libraries import upkeep as cache_upkeep

    try:
        place, allowed = cache_folder.private_folder(), cache_folder.limit()
        with tempfile.TemporaryFile(dir=place) as file:
            file.write(b"\0" * 4096)
    except EnvironmentFailure as error:
        yield Finding("cache", False, str(error))
        return
    except OSError as error:
        text = f"{place} is not writable ({error.strerror}); free disk space or change permissions"
        yield Finding("cache", False, f"{text}, or set {cache_folder.VARIABLE}")
        return
    entries = cache_upkeep.listed(place)
    size, free = sum(entry.bytes for entry in entries), shutil.disk_usage(place).free
    mode = stat.S_IMODE(place.stat().st_mode)
    data = {
        "folder": str(place), "mode": f"{mode:04o}", "entries": len(entries), "bytes": size,
        "limit": allowed, "free": free,
    }  # fmt: skip
    number = "1 library" if len(entries) == 1 else f"{len(entries)} libraries"
    text = (
        f"{place} (mode {mode:04o}): {number}, {size / 1e6:.1f} of "
        f"{allowed / 1e6:.0f} MB; {free / 1e6:.0f} MB free on the disk"
    )
    yield Finding("cache", True, text, data)
    if free < _LITTLE_ROOM:
        text = f"only {free / 1e6:.1f} MB are free in {place}; free disk space"
        yield Finding("cache", False, text)
    damaged = [entry.folder.name for entry in entries if entry.problem]
    if damaged:
        text = f"{len(damaged)} corrupt ({', '.join(damaged[:3])}); they are rebuilt when used"
        yield Finding("cache", False, f"{text}, or remove them: mstmm cache clean")


# --- test runs ------------------------------------------------------------------------------------


def _prebuilt(compiled: Compile) -> Iterator[Finding]:
    from ..runtime.kernels import prebuilt

    try:
        names = sorted(f"{kind} {name}" for kind, name in prebuilt.elements())
    except Exception as error:  # a broken library may raise anything
        yield _broken("kernels", error)
        return
    yield Finding("kernels", True, f"{len(names)} prebuilt elements", {"elements": names})
    yield _tried("looped engine", lambda: _pendulum(compiled, "looped"))


def _built_here(
    compiled: Compile, flags: Sequence[str], optional: Sequence[str]
) -> Iterator[Finding]:
    """Test of a compiled kernel, then of a fused scene."""
    from ..runtime.libraries import toolchain

    try:
        toolchain.compiler()
    except EnvironmentFailure:
        return  # reported by `_compiler`
    trial = _tried("compiling", lambda: _tiny_library(flags, optional))
    yield trial
    if trial.ok:
        yield _tried("fused engine", lambda: _pendulum(compiled, "fused"))


def _tried(subject: str, trial: Callable[[], str]) -> Finding:
    try:
        return Finding(subject, True, trial())
    except Exception as error:  # any failure must leave the other findings available
        return _broken(subject, error)


def _broken(subject: str, error: Exception) -> Finding:
    if isinstance(error, MstmmError):
        return Finding(subject, False, str(error))
    text = f"{type(error).__name__}: {error}; reinstall mstmm"
    return Finding(subject, False, text)


def _tiny_library(flags: Sequence[str], optional: Sequence[str]) -> str:
    """Compile a kernel with the flags of fused code, call it and compare with exact values."""
    from ..runtime.libraries.build import Order, fetched
    from ..runtime.libraries.toolchain import TIMEOUT

    text = (
        "#include <math.h>\n"
        "int trial(const double *x, double *y)\n"
        "{ for (int i = 0; i < 64; ++i) y[i] = sqrt(x[i]) + 2.0 * x[i]; return 0; }\n"
    )
    with tempfile.TemporaryDirectory(prefix="mstmm-doctor-") as folder:
        order = Order(
            "trial",
            "0" * 64,
            lambda key: {"trial.c": text},
            tuple(flags),
            ("trial",),
            "TMPDIR",
            optional=tuple(optional),
        )
        built = fetched(Path(folder) / "trial", order, min(TIMEOUT, 60.0))
        worst = _trial_error(built.path)
    if not worst <= 1e-15:
        raise EnvironmentFailure(
            f"a test kernel gives wrong numbers (relative error {worst:.1e}); "
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
    worst = max(abs(a - b) / max(b, 1.0) for a, b in zip(y, expected, strict=True))
    ffi.dlclose(lib)
    return worst


def _pendulum(compiled: Compile, engine: str) -> str:
    """Simulate a pendulum for one period, known from the complete elliptic integral."""
    import numpy as np
    from scipy.special import ellipk

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
    square = mass * g * arm / (inertia + mass * arm**2)  # rad^2/s^2
    angles = np.linspace(-3.0, 3.0, 25)[:, None]
    found = model.accelerations(angles, np.zeros_like(angles))
    worst = float(np.abs(found + square * np.sin(angles)).max() / square)
    period = float(4.0 * ellipk(np.sin(start / 2) ** 2) / np.sqrt(square))
    back = model.simulate(period, rtol=1e-10, atol=1e-12)
    drift = abs(float(back.q[-1, 0]) - start) if back.success else float("inf")
    if not (worst <= 1e-13 and drift <= 1e-7):
        raise EnvironmentFailure(
            f"a pendulum differs from its closed form by {worst:.1e} (accelerations) and "
            f"{drift:.1e} rad (after a period); reinstall mstmm: pip install --force-reinstall "
            "mstmm"
        )
    return (
        f"a pendulum agrees with its closed form (accelerations {worst:.0e}, "
        f"a period {drift:.0e} rad)"
    )


def summary() -> str:
    """Python interpreter and platform to which the findings apply."""
    return f"{sys.executable} on {platform.platform()}"
