"""Pinocchio's C++ articulated-body loop, built from the headers of the pin wheel."""

from __future__ import annotations

import ctypes
import sysconfig
from pathlib import Path
from typing import Any

import numpy as np

from . import native
from .links import COORDINATES, Tree

#: Pinocchio's own public definitions (pinocchioTargets.cmake).
DEFINITIONS = (
    "BOOST_MPL_LIMIT_LIST_SIZE=30",
    "BOOST_MPL_LIMIT_VECTOR_SIZE=30",
    "BOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
    "BOOST_FUSION_INVOKE_MAX_ARITY=12",
    "NDEBUG",
)
LEVELS = ("O2", "O3")


def flags(level: str) -> list[str]:
    """Of the compiler, with the headers of the wheel."""
    prefix = Path(sysconfig.get_paths()["purelib"]) / "cmeel.prefix" / "include"
    if not (prefix / "pinocchio").is_dir() or not (prefix / "eigen3").is_dir():
        raise SystemExit("this Python lacks pin or cmeel-eigen: pip install pin cmeel-eigen")
    given = [f"-{level}", "-std=c++17", "-march=native", "-w", *(f"-D{d}" for d in DEFINITIONS)]
    return [*given, f"-I{prefix}", f"-I{prefix / 'eigen3'}"]


def opened(level: str) -> ctypes.CDLL:
    """The library at one level of optimisation."""
    text = (native.HERE / "pinocchio.cpp").read_text()
    found = ctypes.CDLL(str(native.library("pinocchio", text, flags(level), "g++", ".cpp")))
    found.tree_new.restype = ctypes.c_void_p
    found.tree_new.argtypes = [ctypes.c_void_p]
    found.tree_free.argtypes = found.tree_ready.argtypes = [ctypes.c_void_p]
    pointer, number = ctypes.c_void_p, ctypes.c_double
    found.tree_add.argtypes = [
        pointer, ctypes.c_int, ctypes.c_int, pointer, pointer, number, pointer, pointer, number,
    ]  # fmt: skip
    return found


class Built:
    """A Pinocchio model of the tree with its workspace, freed with this object."""

    def __init__(self, library: ctypes.CDLL, tree: Tree) -> None:
        self.library, self.address = library, _model(library, tree)

    def __del__(self) -> None:
        self.library.tree_free(self.address)


def _model(library: ctypes.CDLL, tree: Tree) -> int:
    made = library.tree_new(native.aligned(tree.gravity).ctypes.data)
    for link in tree.links:
        kind = {"ball": 3, "free": 4}.get(link.kind, int(np.argmax(np.abs(link.axis))))
        place, turn, center, inertia = (
            np.ascontiguousarray(x, dtype=float)
            for x in (link.place, link.turn, link.center, link.inertia)
        )
        library.tree_add(
            made, link.parent, kind, place.ctypes.data, turn.ctypes.data, link.mass,
            center.ctypes.data, inertia.ctypes.data, link.armature,
        )  # fmt: skip
    library.tree_ready(made)
    return made


def coordinates(tree: Tree, q: np.ndarray) -> np.ndarray:
    """Pinocchio's q: quaternions as x, y, z, w."""
    out, at = q.copy(), 0
    for link in tree.links:
        end = at + COORDINATES[link.kind][0]
        if link.kind != "pin":
            out[:, end - 4 : end] = np.roll(q[:, end - 4 : end], -1, axis=1)
        at = end
    return out


def back(tree: Tree, q: np.ndarray) -> np.ndarray:
    """Our q of a chain from Pinocchio's: quaternions as w, x, y, z."""
    out, at = q.copy(), 0
    for link in tree.links:
        end = at + COORDINATES[link.kind][0]
        if link.kind != "pin":
            out[end - 4 : end] = np.roll(q[end - 4 : end], 1)
        at = end
    return out


def subjects(
    tree: Tree, q: np.ndarray, u: np.ndarray, rates: bool = False
) -> dict[str, native.Subject]:
    """Level and convention -> function and states; with coordinate rates for an integrator."""
    found: dict[str, native.Subject] = {}
    for level in LEVELS:
        library = opened(level)
        model = Built(library, tree)
        for convention in ("local", "world"):
            f: Any = ctypes.c_void_p.in_dll(
                library, f"{convention}_aba{'_rates' if rates else ''}"
            ).value
            found[f"{level} {convention}"] = native.Subject(
                f, model.address, coordinates(tree, q), u, keep=model
            )
    return found


def local(
    library: ctypes.CDLL, model: Built, tree: Tree, q: np.ndarray, u: np.ndarray
) -> native.Subject:
    """Function and states in the local convention, on a model that is there already."""
    f: Any = ctypes.c_void_p.in_dll(library, "local_aba").value
    return native.Subject(f, model.address, coordinates(tree, q), u, keep=model)
