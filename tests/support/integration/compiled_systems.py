"""The C of the time integration compiled with small test systems, opened by cffi in ABI mode."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cffi
import numpy as np
from numpy.typing import ArrayLike

import mstmm.runtime.integrate
from mstmm.runtime.integrate.c_loop import Integrator, Status
from mstmm.runtime.integrate.settings import Settings
from mstmm.runtime.integrate.steppers import Tableau, get
from mstmm.runtime.libraries.build_extension import cdef
from tests.support.kernels.c_library import compile_library

#: The whole of the time integration's C.
INTEGRATION = Path(mstmm.runtime.integrate.__path__[0], "c")
HERE = Path(__file__).parent
TEST_SYSTEMS = [HERE / "systems.c", HERE / "mechanisms.c"]
TEST_DECLARATIONS = """
typedef struct parameters { double p[8]; double memory[4]; long calls; const mstmm_system *system; }
parameters;
parameters *test_parameters(void);
int test_fill(mstmm_system *system, parameters *at, const char *rhs, int n, int n_error);
void test_use_bounce(mstmm_system *system, parameters *at);
void test_use_three(mstmm_system *system, parameters *at);
void test_use_normalise(mstmm_system *system);
void test_use_accept(mstmm_system *system, parameters *at);
void test_use_lanes(mstmm_system *system, parameters *at, int lanes);
parameters *test_mechanism(mstmm_system *system, const char *name);
void test_use_event(mstmm_system *system, const char *name);
"""


@dataclass
class Problem:
    """A test system and its parameters, which C reads."""

    lab: Lab
    system: Any
    at: Any

    def run(self, method: str | Tableau, t_end: float, y0: ArrayLike, **options: Any) -> Integrator:
        """A run with these settings, 1e-6 and 1e-9 unless given, not yet advanced."""
        tableau = get(method) if isinstance(method, str) else method
        atol = options.pop("atol", 1e-9)
        own = {key: options.pop(key) for key in ("breaks", "bounds", "capacity") if key in options}
        settings = Settings(t_end, **{"rtol": 1e-6, **options})
        system = (self.lab.ffi, self.lab.lib, self.system)
        return Integrator(*system, tableau, settings, y0, atol=atol, **own)

    def finished_run(
        self, method: str | Tableau, t_end: float, y0: ArrayLike, **options: Any
    ) -> Integrator:
        """A run that has finished."""
        run = self.run(method, t_end, y0, **options)
        assert run.advance(60.0) is Status.FINISHED, run.message()
        return run


class Lab:
    """The library and its test systems, compiled unless the folder has it."""

    def __init__(self, folder: Path, *flags: str) -> None:
        self.path = folder / "lab.so"
        sources = [*sorted(INTEGRATION.glob("*.c")), *TEST_SYSTEMS]
        self.ffi: Any = cffi.FFI()
        declared = [
            cdef(INTEGRATION / f"{name}.h") for name in ("bounds", "implicit", "integrate", "lanes")
        ]
        self.ffi.cdef("\n".join([*declared, TEST_DECLARATIONS]))
        options = ("-O2", f"-I{INTEGRATION}", f"-I{HERE}", *flags)
        if not self.path.exists():
            compile_library(sources, self.path, *options)
        self.lib: Any = self.ffi.dlopen(str(self.path))

    def problem(self, rhs: str, n: int, *p: float, n_error: int | None = None) -> Problem:
        """A system of `systems.c` with its parameters."""
        system, at = self.ffi.new("mstmm_system *"), self.lib.test_parameters()
        assert not self.lib.test_fill(
            system, at, rhs.encode(), n, n if n_error is None else n_error
        )
        for i, value in enumerate(p):
            at.p[i] = value
        return Problem(self, system, at)

    def mechanism(self, name: str, *p: float) -> Problem:
        """A mechanical system of `mechanisms.c` with its parameters, for implicit methods too."""
        system = self.ffi.new("mstmm_system *")
        at = self.lib.test_mechanism(system, name.encode())
        assert at != self.ffi.NULL
        for i, value in enumerate(p):
            at.p[i] = value
        return Problem(self, system, at)


def same_bits(left: ArrayLike, right: ArrayLike) -> bool:
    """Equal bit for bit."""
    a, b = np.ascontiguousarray(left), np.ascontiguousarray(right)
    return a.shape == b.shape and a.tobytes() == b.tobytes()
