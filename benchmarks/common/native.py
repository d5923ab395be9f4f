"""Compiles C and C++ of the benchmarks, opens it, and times functions of one signature."""

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


def library(
    name: str,
    text: str,
    flags: Sequence[str],
    compiler: str = "gcc",
    suffix: str = ".c",
    after: Sequence[str] = (),
) -> Path:
    """Shared library of one source text; kept under a name that holds everything it depends on."""
    header = (HERE / "native.h").read_text()
    whole = "\0".join([compiler, text, header, *flags, *after])
    target = BUILD / f"{name}_{hashlib.sha256(whole.encode()).hexdigest()[:16]}.so"
    if target.exists():
        return target
    BUILD.mkdir(parents=True, exist_ok=True)
    source = target.with_suffix(suffix)
    source.write_text(text)
    half = target.with_suffix(f".{os.getpid()}")
    command = [compiler, *flags, f"-I{HERE}", "-shared", "-fPIC", str(source), "-o", str(half)]
    begin = time.perf_counter()
    subprocess.run([*command, *after, "-lm"], check=True)
    half.rename(target)
    target.with_suffix(".seconds").write_text(str(time.perf_counter() - begin))
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
def loops() -> ctypes.CDLL:
    """The timing loops of native.c."""
    text = (HERE / "native.c").read_text()
    flags = ["-O2", "-march=native", "-std=gnu17", "-fno-tree-vectorize"]
    opened = ctypes.CDLL(str(library("loops", text, flags)))
    opened.throughput.restype = opened.chained.restype = ctypes.c_double
    for function in (opened.throughput, opened.chained):
        function.argtypes = [ctypes.POINTER(_Subject), ctypes.c_int]
    opened.evaluate_all.argtypes = [ctypes.POINTER(_Subject), ctypes.c_void_p]
    return opened


def aligned(array: np.ndarray) -> np.ndarray:
    """A contiguous copy that starts at a cache line."""
    array = np.asarray(array, dtype=np.float64)
    room = np.zeros(array.size + 8)
    first = (-room.ctypes.data // 8) % 8
    out = room[first : first + array.size].reshape(array.shape)
    out[...] = array
    return out


@dataclass
class Subject:
    """A function under test with the states it walks through.

    f: address of a function of the signature in native.h; context: address, or an array.
    """

    f: int
    context: int | np.ndarray
    q: np.ndarray
    u: np.ndarray
    memory: np.ndarray | None = None
    keep: object = None
    record: _Subject = field(init=False)
    order: np.ndarray = field(init=False)  # where a peer's speeds stand among ours, if elsewhere

    def __post_init__(self) -> None:
        self.q, self.u = aligned(self.q), aligned(self.u)
        nq, nu = self.q.shape[1], self.u.shape[1]
        self.work = [aligned(np.zeros(k)) for k in (nq, nu, nq + 2 * nu)]
        if isinstance(self.context, np.ndarray):
            self.context = aligned(self.context)
        self.memory = aligned(np.zeros(8) if self.memory is None else self.memory)
        context = self.context
        address = context.ctypes.data if isinstance(context, np.ndarray) else context
        self.record = _Subject(
            self.f, address, self.memory.ctypes.data, nq, nu, len(self.q), self.q.ctypes.data,
            self.u.ctypes.data, *(w.ctypes.data for w in self.work), 0.0,
        )  # fmt: skip

    def accelerations(self) -> np.ndarray:
        """udot of every state."""
        out = np.zeros_like(self.u)
        if loops().evaluate_all(ctypes.byref(self.record), out.ctypes.data):
            raise RuntimeError("a peer refused a state")
        return out

    def time(self, chained: bool, rounds: int) -> float:
        """CPU ns per evaluation over `rounds` walks through the states."""
        function = loops().chained if chained else loops().throughput
        spent = function(ctypes.byref(self.record), rounds)
        if spent < 0:
            raise RuntimeError("a peer refused a state")
        return spent / (rounds * len(self.q))
