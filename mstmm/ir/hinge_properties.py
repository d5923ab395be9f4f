"""Kinematic properties of a hinge, derived from its motion subspace H and its rates.

Code never depends on the name of a hinge: frames of beams, warnings, links and results use these
properties, which built-in and user-defined hinges have in the same form.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass, replace
from functools import cache
from importlib.resources import files
from typing import Any

from .interpreter import GuardFailure, evaluate_floats
from .kernel import KernelIR, kernel_from_data, kernel_to_data
from .statements import Assign, Constant, Element, Operand, Store, Temporary


@dataclass(frozen=True)
class Param:
    """Named number of an element: SI unit, default and inclusive bounds (None: no bound)."""

    name: str
    unit: str = ""
    description: str = ""
    default: float | None = None
    minimum: float | None = None
    maximum: float | None = None


Vector = tuple[float, float, float]

#: Orientations of the frame of a hinge in the axes of its ends, by keys of the scene: as the ends;
#: z along `axis`; z along `axis` inboard and along `axis2` outboard, x normal to both; z along the
#: normal `axis` and x along `axis2`.
FRAMES = ("own", "axis", "crossing", "plane")

#: Largest difference between entries of two rotations that count as equal.
_MAX_ROTATION_DIFFERENCE = 1e-9
#: Value of an entry of H that is never stored.
_ZERO = Constant("0")


@dataclass(frozen=True)
class HingeProperties:
    """Kinematic properties of a hinge type; vectors and columns of H are in its outboard axes.

    Attributes:
        allows: short description of the motions that it allows.
        coordinates, speeds: names and SI units of the entries of q and u.
        parameters: numbers of its kernel, in order; those named in `keys` are keys of the scene.
        frame: one of FRAMES.  keys: keys of the scene that it reads besides the common ones.
        runs_as: name of the element with its kernels; another name where two hinges share them.
        quaternion: index in q of the first entry (w) of a unit quaternion, None without one.
        straight: whether the speeds are the rates of the coordinates.
        in_place: whether, for any parameters, the kernel neither rotates nor shifts the ends at
            the start values: they coincide as in the scene.
        varies: per speed, six letters for the rows v, w of H: "0" zero and "1" one in every
            position, "p" depends only on parameters, "q" any other.
        start_motion: kernel p -> H (6 nu) at the start values of the coordinates.
        rates: kernel p, q, u -> rates of the coordinates; None where these are the speeds, and for
            definitions generated before this kernel was introduced.
    """

    name: str
    allows: str
    coordinates: tuple[Param, ...]
    speeds: tuple[Param, ...]
    parameters: tuple[Param, ...]
    frame: str
    keys: tuple[str, ...]
    runs_as: str
    quaternion: int | None
    straight: bool
    in_place: bool
    varies: tuple[str, ...]
    start_motion: KernelIR
    rates: KernelIR | None = None

    @property
    def start(self) -> tuple[float, ...]:
        """Default q: zero, with the quaternion of no rotation."""
        return default_coordinates(len(self.coordinates), self.quaternion)

    @property
    def welds(self) -> bool:
        """Whether the hinge is a weld: no speeds, and both ends coincide."""
        return not self.speeds and self.in_place

    @property
    def turns(self) -> tuple[int, ...]:
        """Indices of speeds that rotate the outboard body."""
        return tuple(k for k, rows in enumerate(self.varies) if rows[3:] != "000")

    @property
    def slides(self) -> tuple[int, ...]:
        """Indices of speeds that move the hinge point."""
        return tuple(k for k, rows in enumerate(self.varies) if rows[:3] != "000")

    @property
    def free_body(self) -> bool:
        """Whether all six motions are free."""
        return len(self.speeds) == 6

    @property
    def constant_subspace(self) -> bool:
        """Whether H is constant in outboard axes, the same in every position."""
        return not any("q" in rows for rows in self.varies)

    @property
    def is_free(self) -> bool:
        """Whether two or more translations of the hinge point are free."""
        return len(self.slides) > 1

    @property
    def axial(self) -> bool:
        """Whether it moves only about and along z, in the same way in every position."""
        is_along_z = all(rows[:2] == "00" and rows[3:5] == "00" for rows in self.varies)
        return bool(self.speeds) and is_along_z and self.constant_subspace

    @property
    def keeps_z(self) -> bool:
        """Whether it moves only in planes normal to z and rotates only about z."""
        return all(rows[2:5] == "000" for rows in self.varies)

    def extra_parameters(self) -> tuple[Param, ...]:
        """Parameters that a scene gives in the table `parameters` of the hinge."""
        frame_parameter_count = 1 if self.frame == "crossing" else 0
        return tuple(p for p in self.parameters[frame_parameter_count:] if p.name not in self.keys)

    def start_motion_columns(self, p: Sequence[float] = ()) -> list[tuple[Vector, Vector]]:
        """(translation, rotation) per unit of each speed at the start values.

        `p` holds the parameters of the kernel.  ValueError if H depends on them and their number
        is wrong.
        """
        nu = len(self.speeds)
        if any("p" in rows for rows in self.varies) and len(p) != len(self.parameters):
            raise ValueError(f"{self.name}: expected {len(self.parameters)} parameters")
        inputs = {"p": list(p) or [0.0] * len(self.parameters)}
        h = evaluate_floats(self.start_motion, inputs)["H"] if nu else []
        columns = [[h[row * nu + k] for row in range(6)] for k in range(nu)]
        return [((a, b, c), (d, e, f)) for a, b, c, d, e, f in columns]


def default_coordinates(count: int, quaternion: int | None) -> tuple[float, ...]:
    """Default coordinates: `count` zeros, with the quaternion of no rotation."""
    return tuple(1.0 if i == quaternion else 0.0 for i in range(count))


def effort_unit(speed_unit: str) -> str:
    """Unit of the effort that does work on a speed: N for m/s, N*m for rad/s."""
    return {"m/s": "N", "rad/s": "N*m", "1/s": "J"}.get(speed_unit, f"W/({speed_unit or '1'})")


# --- from the kernel ------------------------------------------------------------------------------


def hinge_properties(
    hinge: KernelIR,
    name: str,
    coordinates: tuple[Param, ...],
    speeds: tuple[Param, ...],
    parameters: tuple[Param, ...],
    frame: str = "axis",
    keys: tuple[str, ...] = ("axis",),
    allows: str = "",
) -> HingeProperties:
    """Derive the properties of a hinge from its kernel "hinge": H, R, qdot over p, q, u."""
    nu, values = len(speeds), _stored_operands(hinge)
    dependence = _Dependence(hinge)
    quaternion = _find_quaternion(hinge, len(coordinates), nu)
    subspace_dependence = tuple(
        "".join(dependence.letter(values.get(("H", row * nu + k), _ZERO)) for row in range(6))
        for k in range(nu)
    )
    speeds_are_rates = len(coordinates) == nu and all(
        values.get(("qdot", k)) == Element("u", (k,)) for k in range(nu)
    )
    start = default_coordinates(len(coordinates), quaternion)
    return HingeProperties(
        name,
        allows,
        coordinates,
        speeds,
        parameters,
        frame,
        keys,
        name,
        quaternion,
        speeds_are_rates,
        _is_aligned_at_start(hinge, start, frame),
        subspace_dependence,
        _start_kernel(hinge, start),
        None if speeds_are_rates else _output_kernel(hinge, "qdot", "rates"),
    )


def is_same_motion(one: KernelIR, other: KernelIR) -> bool:
    """Whether two hinges have the same kernel, whatever their names."""

    def kernel_content(kernel: KernelIR) -> tuple[Any, ...]:
        ports = [(p.name, p.shape) for p in (*kernel.inputs, *kernel.outputs)]
        return (*ports, kernel.statements)

    return kernel_content(one) == kernel_content(other)


def _stored_operands(kernel: KernelIR) -> dict[tuple[str, int], Operand]:
    """Stored operands by (output, row-major index)."""
    ports = {port.name: port for port in kernel.outputs}
    return {
        (s.port, ports[s.port].offset(s.index)): s.value
        for s in kernel.statements
        if isinstance(s, Store)
    }


class _Dependence:
    """Dependence of the values of a kernel on parameters and coordinates."""

    def __init__(self, kernel: KernelIR) -> None:
        self._letters: dict[int, str] = {}
        for statement in kernel.statements:
            if isinstance(statement, Assign):
                letters = {self._reads(argument) for argument in statement.args}
                self._letters[statement.number] = max(letters, default="")

    def _reads(self, operand: Operand) -> str:
        """Dependence: "" none, "p" on parameters only, "q" on coordinates or speeds too."""
        if isinstance(operand, Temporary):
            return self._letters[operand.number]
        if isinstance(operand, Element):
            return "p" if operand.port == "p" else "q"
        return ""

    def letter(self, operand: Operand) -> str:
        """Letter of an operand in `HingeProperties.varies`."""
        if isinstance(operand, Constant) and operand.text in "01":
            return operand.text
        return self._reads(operand) or "p"


def _start_kernel(kernel: KernelIR, start: Sequence[float]) -> KernelIR:
    """Kernel p -> H at the coordinates `start`, at zero speed."""

    def substitute_start(operand: Operand) -> Operand:
        if isinstance(operand, Element) and operand.port in "qu":
            value = start[operand.index[0]] if operand.port == "q" else 0.0  # type: ignore[index]
            return Constant(str(int(value)))
        return operand

    subspace_kernel = _output_kernel(kernel, "H", "start_motion")
    p = next(port for port in kernel.inputs if port.name == "p")
    statements = tuple(
        replace(statement, args=tuple(map(substitute_start, statement.args)))
        if isinstance(statement, Assign)
        else replace(statement, value=substitute_start(statement.value))
        for statement in subspace_kernel.statements
        if isinstance(statement, (Assign, Store))
    )
    return replace(subspace_kernel, inputs=(p,), statements=statements)


def _output_kernel(kernel: KernelIR, output: str, name: str) -> KernelIR:
    """Part of a kernel that computes one of its outputs."""
    port = next(port for port in kernel.outputs if port.name == output)
    statements: list[Assign | Store] = []
    needed_numbers: set[int] = set()
    for statement in reversed(kernel.statements):
        if isinstance(statement, Store) and statement.port == output:
            statements.append(statement)
            needed_numbers |= _temporary_numbers([statement.value])
        elif isinstance(statement, Assign) and statement.number in needed_numbers:
            statements.append(statement)
            needed_numbers |= _temporary_numbers(statement.args)
    return KernelIR(name, kernel.inputs, (port,), tuple(reversed(statements)))


def _temporary_numbers(operands: Sequence[Operand]) -> set[int]:
    return {operand.number for operand in operands if isinstance(operand, Temporary)}


def _find_quaternion(hinge: KernelIR, nq: int, nu: int) -> int | None:
    """Index of the first of four coordinates that form a quaternion, None without one.

    The rotation must not depend on their common length.
    """
    if nq != nu + 1:
        return None
    sizes = {port.name: port.length() for port in hinge.inputs}
    q = [0.3 + 0.17 * k for k in range(nq)]
    other_inputs = {"p": [0.7 + 0.1 * k for k in range(sizes["p"])], "u": [0.0] * sizes["u"]}

    def rotation(q: Sequence[float]) -> list[float]:
        try:
            return evaluate_floats(hinge, {"q": q, **other_inputs})["R"]
        except GuardFailure:  # not defined there
            return [math.nan] * 9

    for first in range(nq - 3):  # by trial: N(q) u = qdot may be written in many ways
        scaled_q = [2 * x if first <= k < first + 4 else x for k, x in enumerate(q)]
        rotated_q = [x + 0.1 if k == first else x for k, x in enumerate(q)]
        ignores_length = (
            _max_difference(rotation(q), rotation(scaled_q)) <= _MAX_ROTATION_DIFFERENCE
        )
        if (
            ignores_length
            and _max_difference(rotation(q), rotation(rotated_q)) > _MAX_ROTATION_DIFFERENCE
        ):
            return first
    return None


def _is_aligned_at_start(hinge: KernelIR, start: Sequence[float], frame: str) -> bool:
    """Whether, for any parameters, R and d at `start` leave the ends as in the scene."""
    sizes = {port.name: port.length() for port in hinge.inputs}
    for first in (0.7, 1.1):
        p = [first + 0.1 * k for k in range(sizes["p"])]
        try:
            outputs = evaluate_floats(hinge, {"q": start, "p": p, "u": [0.0] * sizes["u"]})
        except GuardFailure:  # not defined there
            return False
        c, s = (math.cos(p[0]), math.sin(p[0])) if frame == "crossing" else (1.0, 0.0)
        expected_rotation = [
            1.0,
            0.0,
            0.0,
            0.0,
            c,
            -s,
            0.0,
            s,
            c,
        ]  # the axes of a crossing frame differ
        difference = _max_difference(
            [*outputs["R"], *outputs["d"]], [*expected_rotation, 0.0, 0.0, 0.0]
        )
        if not difference <= _MAX_ROTATION_DIFFERENCE:
            return False
    return True


def _max_difference(one: Sequence[float], other: Sequence[float]) -> float:
    return max(abs(a - b) for a, b in zip(one, other, strict=True))


# --- stored form ----------------------------------------------------------------------------------


def hinge_properties_to_data(facts: HingeProperties) -> dict[str, Any]:
    """Convert properties to lists, numbers and texts; `hinge_properties_from_data` is the
    inverse."""
    groups = {
        key: [list(astuple(p)) for p in getattr(facts, key)]
        for key in ("coordinates", "speeds", "parameters")
    }
    rates = {} if facts.rates is None else {"rates": kernel_to_data(facts.rates)}
    return {
        "name": facts.name, "allows": facts.allows, **groups, "frame": facts.frame,
        "keys": list(facts.keys), "runs_as": facts.runs_as, "quaternion": facts.quaternion,
        "straight": facts.straight, "in_place": facts.in_place, "varies": list(facts.varies),
        "start_motion": kernel_to_data(facts.start_motion), **rates,
    }  # fmt: skip


def hinge_properties_from_data(data: dict[str, Any]) -> HingeProperties:
    """Restore properties from the result of `hinge_properties_to_data`."""
    groups: dict[str, Any] = {
        key: tuple(Param(*entry) for entry in data[key])
        for key in ("coordinates", "speeds", "parameters")
    }
    fields = {key: data[key] for key in ("name", "allows", "frame", "runs_as", "quaternion")}
    return HingeProperties(
        **fields, **groups, keys=tuple(data["keys"]), straight=data["straight"],
        in_place=data["in_place"],
        varies=tuple(data["varies"]), start_motion=kernel_from_data(data["start_motion"]),
        rates=kernel_from_data(data["rates"]) if "rates" in data else None,
    )  # fmt: skip


@cache
def builtin_hinges() -> dict[str, HingeProperties]:
    """Properties of the built-in hinges by name, in the order of the user's listing."""
    text = files("mstmm.generated").joinpath("hinges.json").read_text(encoding="utf-8")
    return {data["name"]: hinge_properties_from_data(data) for data in json.loads(text)}
