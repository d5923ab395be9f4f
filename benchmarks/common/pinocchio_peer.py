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


def compiler_flags(level: str) -> list[str]:
    """Compiler flags with the headers of the wheel."""
    prefix = Path(sysconfig.get_paths()["purelib"]) / "cmeel.prefix" / "include"
    if not (prefix / "pinocchio").is_dir() or not (prefix / "eigen3").is_dir():
        raise SystemExit("this Python lacks pin or cmeel-eigen: pip install pin cmeel-eigen")
    options = [f"-{level}", "-std=c++17", "-march=native", "-w", *(f"-D{d}" for d in DEFINITIONS)]
    return [*options, f"-I{prefix}", f"-I{prefix / 'eigen3'}"]


def open_library(level: str) -> ctypes.CDLL:
    """The library at one level of optimisation."""
    text = (native.HERE / "pinocchio.cpp").read_text()
    library = ctypes.CDLL(
        str(native.compile_library("pinocchio", text, compiler_flags(level), "g++", ".cpp"))
    )
    library.tree_new.restype = ctypes.c_void_p
    library.tree_new.argtypes = [ctypes.c_void_p]
    library.tree_free.argtypes = library.tree_ready.argtypes = [ctypes.c_void_p]
    pointer, number = ctypes.c_void_p, ctypes.c_double
    library.tree_add.argtypes = [
        pointer, ctypes.c_int, ctypes.c_int, pointer, pointer, number, pointer, pointer, number,
    ]  # fmt: skip
    return library


class PinocchioModel:
    """A Pinocchio model of the tree with its workspace, freed with this object."""

    def __init__(self, library: ctypes.CDLL, tree: Tree) -> None:
        self.library, self.address = library, _build_model(library, tree)

    def __del__(self) -> None:
        self.library.tree_free(self.address)


def _build_model(library: ctypes.CDLL, tree: Tree) -> int:
    address = library.tree_new(native.aligned_copy(tree.gravity).ctypes.data)
    for link in tree.links:
        kind = {"ball": 3, "free": 4}.get(link.kind, int(np.argmax(np.abs(link.axis))))
        position, orientation, center, inertia = (
            np.ascontiguousarray(x, dtype=float)
            for x in (link.position, link.orientation, link.center, link.inertia)
        )
        library.tree_add(
            address, link.parent, kind, position.ctypes.data, orientation.ctypes.data, link.mass,
            center.ctypes.data, inertia.ctypes.data, link.armature,
        )  # fmt: skip
    library.tree_ready(address)
    return address


def pinocchio_coordinates(tree: Tree, q: np.ndarray) -> np.ndarray:
    """Pinocchio's q: quaternions as x, y, z, w."""
    converted, offset = q.copy(), 0
    for link in tree.links:
        end = offset + COORDINATES[link.kind][0]
        if link.kind != "pin":
            converted[:, end - 4 : end] = np.roll(q[:, end - 4 : end], -1, axis=1)
        offset = end
    return converted


def scene_coordinates(tree: Tree, q: np.ndarray) -> np.ndarray:
    """q of mstmm for a chain from Pinocchio's: quaternions as w, x, y, z."""
    converted, offset = q.copy(), 0
    for link in tree.links:
        end = offset + COORDINATES[link.kind][0]
        if link.kind != "pin":
            converted[end - 4 : end] = np.roll(q[end - 4 : end], 1)
        offset = end
    return converted


def subjects(
    tree: Tree, q: np.ndarray, u: np.ndarray, rates: bool = False
) -> dict[str, native.Subject]:
    """Level and convention -> function and states; `rates` adds coordinate rates."""
    subjects_by_name: dict[str, native.Subject] = {}
    for level in LEVELS:
        library = open_library(level)
        model = PinocchioModel(library, tree)
        for convention in ("local", "world"):
            f: Any = ctypes.c_void_p.in_dll(
                library, f"{convention}_aba{'_rates' if rates else ''}"
            ).value
            subjects_by_name[f"{level} {convention}"] = native.Subject(
                f, model.address, pinocchio_coordinates(tree, q), u, owner=model
            )
    return subjects_by_name


def local_subject(
    library: ctypes.CDLL, model: PinocchioModel, tree: Tree, q: np.ndarray, u: np.ndarray
) -> native.Subject:
    """Function and states in the local convention, on an existing model."""
    f: Any = ctypes.c_void_p.in_dll(library, "local_aba").value
    return native.Subject(f, model.address, pinocchio_coordinates(tree, q), u, owner=model)
