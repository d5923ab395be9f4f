"""Compile C and C++ of the benchmarks, and time functions of one signature."""

from __future__ import annotations

import ctypes
import hashlib
import os
import subprocess
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
BUILD = Path(os.environ.get("BENCHMARK_BUILD", HERE.parents[1] / "build" / "benchmarks"))


def compile_library(
    name: str,
    text: str,
    flags: Sequence[str],
    compiler: str = "gcc",
    suffix: str = ".c",
    libraries: Sequence[str] = (),
) -> Path:
    """Shared library of a source text, cached by a hash of its text, flags and compiler."""
    header = (HERE / "native.h").read_text()
    hashed_text = "\0".join([compiler, text, header, *flags, *libraries])
    target = BUILD / f"{name}_{hashlib.sha256(hashed_text.encode()).hexdigest()[:16]}.so"
    if target.exists():
        return target
    BUILD.mkdir(parents=True, exist_ok=True)
    source = target.with_suffix(suffix)
    source.write_text(text)
    partial = target.with_suffix(f".{os.getpid()}")
    command = [compiler, *flags, f"-I{HERE}", "-shared", "-fPIC", str(source), "-o", str(partial)]
    start_time = time.perf_counter()
    subprocess.run([*command, *libraries, "-lm"], check=True)
    partial.rename(target)
    target.with_suffix(".seconds").write_text(str(time.perf_counter() - start_time))
    return target


class _Subject(ctypes.Structure):
    _fields_ = [
        ("f", ctypes.c_void_p), ("context", ctypes.c_void_p), ("memory", ctypes.c_void_p),
        ("nq", ctypes.c_int), ("nu", ctypes.c_int), ("n_states", ctypes.c_int),
        ("q", ctypes.c_void_p), ("u", ctypes.c_void_p),
        ("qdot", ctypes.c_void_p), ("udot", ctypes.c_void_p), ("inputs", ctypes.c_void_p),
        ("zero", ctypes.c_double),
    ]  # fmt: skip


@cache
def timing_loops() -> ctypes.CDLL:
    """The timing loops of native.c."""
    text = (HERE / "native.c").read_text()
    flags = ["-O2", "-march=native", "-std=gnu17", "-fno-tree-vectorize"]
    shared_library = ctypes.CDLL(str(compile_library("loops", text, flags)))
    shared_library.throughput.restype = shared_library.chained.restype = ctypes.c_double
    for function in (shared_library.throughput, shared_library.chained):
        function.argtypes = [ctypes.POINTER(_Subject), ctypes.c_int]
    shared_library.evaluate_all.argtypes = [ctypes.POINTER(_Subject), ctypes.c_void_p]
    return shared_library


def aligned_copy(array: np.ndarray) -> np.ndarray:
    """Contiguous copy that starts at a cache line."""
    array = np.asarray(array, dtype=np.float64)
    buffer = np.zeros(array.size + 8)
    first = (-buffer.ctypes.data // 8) % 8
    view = buffer[first : first + array.size].reshape(array.shape)
    view[...] = array
    return view


@dataclass
class Subject:
    """Function under test and the states at which it is evaluated.

    f: address of a function of the signature in native.h; context: address, or an array.
    """

    f: int
    context: int | np.ndarray
    q: np.ndarray
    u: np.ndarray
    memory: np.ndarray | None = None
    owner: object = None
    record: _Subject = field(init=False)
    speed_order: np.ndarray = field(init=False)  # indices of its speeds in mstmm's, if reordered

    def __post_init__(self) -> None:
        self.q, self.u = aligned_copy(self.q), aligned_copy(self.u)
        nq, nu = self.q.shape[1], self.u.shape[1]
        self.work = [aligned_copy(np.zeros(k)) for k in (nq, nu, nq + 2 * nu)]
        if isinstance(self.context, np.ndarray):
            self.context = aligned_copy(self.context)
        self.memory = aligned_copy(np.zeros(8) if self.memory is None else self.memory)
        context = self.context
        address = context.ctypes.data if isinstance(context, np.ndarray) else context
        self.record = _Subject(
            self.f, address, self.memory.ctypes.data, nq, nu, len(self.q), self.q.ctypes.data,
            self.u.ctypes.data, *(w.ctypes.data for w in self.work), 0.0,
        )  # fmt: skip

    def accelerations(self) -> np.ndarray:
        """udot of every state."""
        view = np.zeros_like(self.u)
        if timing_loops().evaluate_all(ctypes.byref(self.record), view.ctypes.data):
            raise RuntimeError("a program rejected a state")
        return view

    def time(self, chained: bool, rounds: int) -> float:
        """CPU ns per evaluation over `rounds` walks through the states."""
        function = timing_loops().chained if chained else timing_loops().throughput
        duration = function(ctypes.byref(self.record), rounds)
        if duration < 0:
            raise RuntimeError("a program rejected a state")
        return duration / (rounds * len(self.q))
