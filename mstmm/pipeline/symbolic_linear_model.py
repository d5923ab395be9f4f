"""Linear model as SymPy expressions: its schedule evaluated on formulas, not on numbers.

Parameters that stay symbols pass through packing as formulas.  The residual of the scene is inlined
and differentiated as for fused code, and its kernel evaluated on formulas.  There is no second
derivation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..derive.fuse.linearisation import fuse_linear, fuse_required
from ..errors import SceneError
from ..ir import KernelIR, Port
from ..ir.graph import Graph
from ..ir.interpreter import replay_kernel
from ..ir.scene_structure import Key
from ..ir.symbolic_arithmetic import FormulaArithmetic
from ..numerics.piecewise_polynomial import NUMBERS_PER_PIECE
from ..numerics.symbolic_number import Formula, SymbolTable, factor_of_symbol, formula
from ..runtime.linear.frozen_loads import INERTIAL
from ..runtime.linear.input_channels import Channel
from ..runtime.linear.mck_matrices import SymbolicLinearModel
from ..runtime.packing import scene_parameters
from ..runtime.packing.expression_tapes import MOVING, state_ports
from ..runtime.packing.fused_structure import structure_and_numbers
from ..runtime.packing.parameter_derivatives import (
    folded_parameters,
    reject_folded_parameters,
    seed_derivatives,
)
from ..runtime.packing.system import LoadNumbers, System
from ..scene.validators.validation_messages import did_you_mean
from .sympy_expressions import SympyWriter

if TYPE_CHECKING:
    from ..runtime.linear.linear_equations import LinearEquations


# --- names ----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class SymbolNames:
    """Names given by the user: of parameters by full name, of q and u by index."""

    parameters: dict[str, str] = field(default_factory=dict)
    coordinates: dict[int, str] = field(default_factory=dict)
    speeds: dict[int, str] = field(default_factory=dict)


@dataclass(frozen=True)
class _Motion:
    """Coordinate or speed: the table for its name, its index, and whether it is free."""

    among: dict[int, str]
    index: int
    free: bool


def resolve_kept_names(linear: LinearEquations, keep: Sequence[str]) -> SymbolNames:
    """Resolve the names of `keep` to parameters, coordinates and speeds.

    Raises SceneError for a name that is unknown or listed twice, and for coordinates with a
    prescribed motion or whose rates are not their speeds, as those of quaternions.
    """
    if isinstance(keep, str) or not all(isinstance(name, str) for name in keep):
        raise SceneError(f'keep = {keep!r}: expected a list of names such as ["rod1.mass"]')
    symbol_names = SymbolNames()
    motions_by_name = dict(_motions(linear, symbol_names))
    numbers = scene_parameters.scene_parameters(linear.model.scene)
    for name in keep:
        if name in motions_by_name:
            motion = motions_by_name[name]
            if not motion.free:
                raise SceneError(
                    f'keep "{name}": expected a free coordinate whose rate is a speed, or its '
                    "speed, found one that a drive imposes or that is no integral of a speed; "
                    "leave it a number"
                )
            is_duplicate = motion.among.setdefault(motion.index, name) != name
        elif name in numbers or f"{name}[0]" in numbers:
            (full_name,) = scene_parameters.resolve_names(linear.model.scene, [name])
            is_duplicate = symbol_names.parameters.setdefault(full_name, name) != name
        else:
            folded_names = set(folded_parameters(linear.model.scene, numbers))
            candidates = [x for x in numbers if x not in folded_names]
            candidates += (x for x, motion in motions_by_name.items() if motion.free)
            raise SceneError(
                f'keep "{name}": expected a number, coordinate or speed of the scene'
                f"{did_you_mean(name, candidates)}"
            )
        if is_duplicate:
            raise SceneError(f'keep "{name}": this number is listed twice; name it once')
    return symbol_names


def _motions(linear: LinearEquations, found: SymbolNames) -> Iterator[tuple[str, _Motion]]:
    """Iterate over all coordinates and speeds with their full names."""
    for slots in linear.model.coordinate_layout.owners:
        for k, name in enumerate(slots.q_names):
            is_free = slots.rates_are_speeds and slots.u + k in linear.free_speed_indices
            yield f"{slots.name}.{name}", _Motion(found.coordinates, slots.q + k, is_free)
        for k, name in enumerate(slots.u_names):
            is_free = slots.rates_are_speeds and slots.u + k in linear.free_speed_indices
            yield f"{slots.name}.{name}", _Motion(found.speeds, slots.u + k, is_free)


# --- matrices -------------------------------------------------------------------------------------

Kernels = Callable[[Key, str], KernelIR]
Rows = list[list[Formula]]

#: Largest number of coordinates, and of products of terms (some seconds); each term converted to an
#: expression counts as the third number of products.
MAX_COORDINATES, MAX_PRODUCTS, _PRODUCTS_PER_TERM = 24, 300_000, 10
#: Largest deviation of an equilibrium from a quarter turn, or from a 1 of a quaternion.
_MAX_ROUNDING = 1e-13
#: Largest acceleration that counts as zero, relative to those of stiffness and damping in motions
#: of order one.
_MAX_ZERO_ACCELERATION = 1e-12


def symbolic_linear_model(
    linear: LinearEquations, keep: Sequence[str], kernels: Kernels
) -> SymbolicLinearModel:
    """M, C, K, V, W in SymPy; all values but those named in `keep` are inserted as numbers."""
    _require_symbolic(linear)
    names = resolve_kept_names(linear, keep)
    reason = "formula; linearize models of other values"
    reject_folded_parameters(linear.model.scene, list(names.parameters), reason)
    equations = _FormulaEquations(linear, names, kernels)
    writer = SympyWriter()
    symbols = {name: writer.symbol(equations.symbols[name]) for name in keep}
    m, c, k = map(writer.matrix, equations.count_terms(equations.second_order()))
    input_matrices = [
        equations.input_matrix(channels)
        for channels in (linear.input_channels, linear.disturbance_channels)
    ]
    v, w = map(writer.matrix, equations.count_terms(input_matrices))
    numbers = {
        symbols[name]: kept_formula.value for name, kept_formula in equations.symbols.items()
    }
    return SymbolicLinearModel(
        m,
        c,
        k,
        v,
        w,
        symbols,
        numbers,
        linear.coordinate_names,
        linear.input_names,
        linear.disturbance_names,
    )


def _require_symbolic(linear: LinearEquations) -> None:
    if linear.drive_indices:
        raise SceneError(
            f"symbolic: the motion of the drive of {linear.prescribed_coordinates[0]} is an "
            "input, for which there is no symbolic column; remove it from the inputs"
        )
    if len(linear) > MAX_COORDINATES:
        raise SceneError(
            f"symbolic: the scene has {len(linear)} coordinates; the limit is {MAX_COORDINATES}; "
            "use M, C and K of linearize, after with_parameters for other values"
        )
    if linear.model.packed_scene.releases:
        names = ", ".join(f'"{name}"' for name in linear.model.packed_scene.releases)
        raise SceneError(
            f"symbolic: hinge {names} is released during the run, which changes the form of the "
            "equations; remove the release"
        )


class _FormulaEquations:
    """Linear model on formulas; `symbols` has the symbols of the names that are kept."""

    def __init__(self, linear: LinearEquations, names: SymbolNames, kernels: Kernels) -> None:
        self._linear, self._kernels, self._book = linear, kernels, SymbolTable(MAX_PRODUCTS)
        self.symbols: dict[str, Formula] = {}
        model, state = linear.model, linear.state
        self._user_elements = model.known or {}
        #: Contribution of a unit of each disturbance input to R, filled in by `second_order`.
        self._inputs: dict[int, list[Formula]] = {
            channel.input: []
            for channel in (*linear.input_channels, *linear.disturbance_channels)
            if channel.input >= 0
        }
        values = model.parameters
        seeds = [self._symbol(name, values[full]) for full, name in names.parameters.items()]
        self._system, self._frames = seed_derivatives(
            model.scene, self._user_elements, list(names.parameters), lambda _, k: seeds[k]
        )
        if dry := linear.dry:
            self._system = replace(self._system, laws=dry.replace_friction(self._system.laws))
        self._q = [_rounded_formula(x) for x in state.q.tolist()]
        self._u = [formula(x) for x in state.u.tolist()]
        for entries, kept_names in ((self._q, names.coordinates), (self._u, names.speeds)):
            for index, name in kept_names.items():
                entries[index] = self._symbol(name, entries[index].value)

    def _symbol(self, name: str, value: float) -> Formula:
        self.symbols[name] = symbol = self._book.symbol(name, value)
        return symbol

    def count_terms(self, matrices: Sequence[Rows]) -> Sequence[Rows]:
        """Count the terms of matrices that will be converted, and return the matrices."""
        terms = sum(len(x.terms) for rows in matrices for row in rows for x in row)
        self._book.count_products(_PRODUCTS_PER_TERM * terms)
        return matrices

    def second_order(self) -> tuple[Rows, Rows, Rows]:
        """Matrices M, C and K."""
        linear = self._linear
        structure, p = structure_and_numbers(self._system, self._user_elements)
        input_values = self._system.inputs_at(linear.state.t).tolist()
        indices = dict(structure.inputs)
        for entry, index in indices.items():
            p[index] = input_values[entry]
        used_inputs = {
            i: indices[NUMBERS_PER_PIECE * i + 1]
            for i in self._inputs
            if NUMBERS_PER_PIECE * i + 1 in indices
        }
        kernel = fuse_linear(
            structure, self._kernels, linear.free_speed_indices, list(used_inputs.values())
        )
        outputs = self._run(kernel, p, self._u, self._accelerations())
        self._inputs |= {
            entry: outputs["P"][k :: len(used_inputs)] for k, entry in enumerate(used_inputs)
        }
        m, c, k = (_rows(outputs[name], len(linear)) for name in "MCK")
        if linear.rate_matrix is None:
            return m, c, k
        if not all(x.is_constant for x in outputs["N"]):
            raise SceneError(
                "symbolic: kept numbers affect the relation of coordinates and speeds of a hinge; "
                "linearize at rest, or leave them numbers"
            )
        g = [[formula(x) for x in row] for row in linear.rate_matrix.tolist()]
        return m, _subtract_product(c, m, g), _subtract_product(k, c, g)

    def _entry(self, push: Channel, symbol: Formula, required: list[Formula], row: int) -> Formula:
        """Effort on a free speed per unit of a disturbance or input."""
        speed = self._linear.free_speed_indices[row]
        if push.input >= 0:
            column = self._inputs[push.input]
            return -column[row] if column else formula(0.0)
        if push.speed >= 0:
            return formula(float(push.speed == speed))
        effort = factor_of_symbol(required[speed], symbol)
        return -effort if push.end else effort

    def _accelerations(self) -> list[Formula]:
        linear = self._linear
        scale = np.abs(np.linalg.solve(linear.M, np.hstack([linear.K, linear.C]))).max(initial=0)
        is_zero = np.abs(linear.state.udot) <= _MAX_ZERO_ACCELERATION * scale
        return [formula(x) for x in np.where(is_zero, 0.0, linear.state.udot).tolist()]

    def input_matrix(self, pushes: Sequence[Channel]) -> Rows:
        """Matrix V of M x'' + C x' + K x = V v + W w, or W, for the given channels.

        Each channel acts with a symbol on the tree at rest.  The required efforts are proportional
        to the symbols; their factors are the entries.
        """
        n = len(self._linear.free_speed_indices)
        if not pushes:
            return [[] for _ in range(n)]
        symbols = [self._book.symbol(channel.name, 1.0) for channel in pushes]
        structure, p = structure_and_numbers(
            self._loaded_tree(pushes, symbols), self._user_elements
        )
        zeros = [formula(0.0)] * len(self._u)
        kernel = fuse_required(structure, self._kernels)
        required = self._run(kernel, p, zeros, zeros)["required"]
        return [
            [
                self._entry(channel, symbol, required, row)
                for channel, symbol in zip(pushes, symbols, strict=True)
            ]
            for row in range(n)
        ]

    def _loaded_tree(self, pushes: Sequence[Channel], symbols: Sequence[Formula]) -> System:
        """Tree whose only gravity and loads are the symbols of `pushes`."""
        gravity: list[Any] = [0.0, 0.0, 0.0]
        loads = []
        for index, (channel, symbol) in enumerate(zip(pushes, symbols, strict=True)):
            if channel.end:
                loads.append(self._load(channel, index))
            elif channel.speed < 0 and channel.input < 0:
                gravity[channel.axis] = gravity[channel.axis] + symbol
        return replace(
            self._system, gravity=tuple(gravity), laws=(), forces=(), loads=tuple(loads),
            values=self._values(len(pushes)) if loads else None, drives=None, driven=(),
            seeded_numbers=dict(enumerate(symbols)),
        )  # fmt: skip

    def _load(self, push: Channel, place: int) -> LoadNumbers:
        body, _, offset = self._frames.end(push.end)
        components = tuple(place if axis == push.axis else -1 for axis in range(3))
        no_components = (-1, -1, -1)
        force, moment = (
            (components, no_components) if push.kind == "force" else (no_components, components)
        )
        return LoadNumbers(body, -1, INERTIAL, offset, force, moment)

    def _values(self, count: int) -> KernelIR:
        """Kernel that returns the symbols as values of expressions."""
        graph = Graph()
        ports = [*state_ports(self._frames.layout), Port(MOVING, (count,))]
        values: dict[str, object] = {"values": graph.vector(MOVING, count)}
        return graph.kernel("values", ports, [Port("values", (count,))], values)

    def _run(
        self, kernel: KernelIR, p: list[Any], u: list[Formula], a: list[Formula]
    ) -> dict[str, list[Formula]]:
        arguments = {"p": p, "t": [self._linear.state.t], "q": self._q, "u": u, "a": a}
        return evaluate_symbolically(kernel, arguments, FormulaArithmetic())


def evaluate_symbolically(
    kernel: KernelIR, given: dict[str, list[Any]], arithmetic: FormulaArithmetic
) -> dict[str, list[Formula]]:
    """Evaluate a kernel of a scene on formulas, with zero memory of its laws."""
    memory = next(port for port in kernel.inputs if port.name == "memory").length()
    return replay_kernel(kernel, given | {"memory": [0.0] * memory}, arithmetic, None)


def _rounded_formula(x: float) -> Formula:
    """Formula of a coordinate, replaced by a quarter turn or 1 if it differs by rounding."""
    for exact in (round(x / (math.pi / 2)) * (math.pi / 2), math.copysign(1.0, x)):
        if abs(x - exact) <= _MAX_ROUNDING:
            return formula(exact)
    return formula(x)


def _rows(entries: list[Formula], n: int) -> Rows:
    return [entries[n * i : n * i + n] for i in range(n)]


def _subtract_product(a: Rows, b: Rows, c: Rows) -> Rows:
    """Difference a - b c of matrices."""
    return [
        [
            sum((-x * row[j] for x, row in zip(b_row, c, strict=True)), entry)
            for j, entry in enumerate(a_row)
        ]
        for a_row, b_row in zip(a, b, strict=True)
    ]
