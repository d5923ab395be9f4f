"""Default quantities of a plot: those that move most of each kind, and a note on the others."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from mstmm.array_validation import Array

from ...engine.quantity_registry import EULER_KIND
from ..flexible.motion import axis_of
from ..quantity_names import Quantity, column_labels

if TYPE_CHECKING:
    from ...packing.coordinate_layout import HingeSlots
    from ..result_record import Record


class Candidate(NamedTuple):
    """Candidate for a plot: name, unit, and range of its values."""

    name: str
    unit: str
    moved: float


class QuantitySource(Protocol):
    """Quantities by name."""

    def quantity(self, name: str) -> Quantity:
        """Quantity of this name; SceneError with the nearest name if there is none."""
        ...


class PlotSource(QuantitySource, Protocol):
    """Quantities by name over the times `t` (n,) in s."""

    @property
    def t(self) -> Array: ...

    def default_quantities(self) -> list[Candidate]:
        """Candidates for default quantities, the most informative kinds first."""
        ...


# --- choice of the quantities ---------------------------------------------------------------------

#: Largest numbers of curves in a panel and of panels in a plot.
MAX_CURVES, MAX_PANELS = 6, 4

#: A tip that moves by less than this part of the middle is fixed by the floating frame.
_ZERO_TIP_RATIO = 1e-9

#: Largest numbers of hinges considered, of ball and free hinges whose angles are computed, and of
#: beams.
_MAX_HINGES, _MAX_QUATERNION_HINGES, _MAX_BEAMS = 10_000, 60, 60


@dataclass(frozen=True)
class DefaultPanel:
    """Names in one panel, in the order of the scene.

    `more` describes what is left out, "" if nothing, and `other` is the name of one of these
    quantities.
    """

    names: tuple[str, ...]
    unit: str
    more: str = ""
    other: str = ""

    @property
    def sentence(self) -> str:
        """Note on what is left out, and how to get it; "" if nothing."""
        return (
            f"{self.more}: give other quantities by name, such as {self.other}" if self.more else ""
        )


def rate_candidates(shown: QuantitySource, names: Iterable[str]) -> Iterator[Candidate]:
    """Candidates of quantities by name."""
    for name in names:
        quantity = shown.quantity(name)
        finite_values = quantity.values[np.isfinite(quantity.values)]
        yield Candidate(
            name, quantity.unit, float(np.ptp(finite_values)) if len(finite_values) else 0.0
        )


def choose_panels(
    shown: PlotSource, lines: int = MAX_CURVES, panels: int = MAX_PANELS
) -> list[DefaultPanel]:
    """Choose the candidates that move most, grouped by unit in their order."""
    units: dict[str, list[tuple[str, float]]] = {}
    for name, unit, excursion in shown.default_quantities():
        units.setdefault(unit, []).append((name, excursion))
    return [_default_panel(unit, some, lines) for unit, some in islice(units.items(), panels)]


def _default_panel(unit: str, some: list[tuple[str, float]], lines: int) -> DefaultPanel:
    order = sorted(range(len(some)), key=lambda k: -some[k][1])
    names = tuple(some[k][0] for k in sorted(order[:lines]))
    if len(some) <= lines:
        return DefaultPanel(names, unit)
    first = some[order[lines]]
    omission = f"{len(some) - lines} more that move by {first[1]:.2g} {unit or '1'} or less"
    return DefaultPanel(names, unit, omission, first[0])


def default_candidates(result: Record) -> list[Candidate]:
    """Candidates for default quantities of a plot.

    Outputs of the scene; without any, coordinates of hinges, Euler angles of those with
    quaternions, and deflections of flexible bodies; where nothing moves, the last end.
    """
    outputs = result._quantities.outputs()
    if outputs:
        quantities = [result.quantity(name) for name in outputs]
        return list(
            rate_candidates(
                result, [text for quantity in quantities for text in column_labels(quantity)]
            )
        )
    hinges = list(islice(result.model.coordinate_layout.hinges.values(), _MAX_HINGES))
    quaternion_hinges = [hinge.name for hinge in hinges if hinge.quaternion is not None]
    angles = [
        f"{name}.{angle}"
        for name in quaternion_hinges[:_MAX_QUATERNION_HINGES]
        for angle in EULER_KIND.labels
    ]
    result_candidates = [
        *_coordinate_candidates(result, hinges),
        *rate_candidates(result, (*angles, *_deflection_names(result))),
    ]
    return result_candidates or list(rate_candidates(result, _last_end_names(result)))


def _coordinate_candidates(result: Record, hinges: Sequence[HingeSlots]) -> Iterator[Candidate]:
    """Candidates among coordinates with a unit, which quaternions lack; all at once for speed."""
    finite_states = result.q[np.isfinite(result.q).all(axis=1)]
    excursions = (
        np.ptp(finite_states, axis=0) if len(finite_states) else np.zeros(result.q.shape[1])
    )
    for hinge in hinges:
        for k, (name, unit) in enumerate(zip(hinge.q_names, hinge.q_units, strict=True)):
            if unit:
                yield Candidate(f"{hinge.name}.{name}", unit, float(excursions[hinge.q + k]))


def _last_end_names(result: Record) -> list[str]:
    body = result.model.scene.skeleton.bodies[-1]
    end = ".".join([body.name, *list(body.ends)[-1:]])
    return [f"{end}.{axis}" for axis in "xyz"]


def _deflection_names(result: Record) -> Iterator[str]:
    """Larger tip deflection of each beam, else the first modal coordinate.

    The modal coordinate is used for a body whose frame follows its tip or that is not a beam.
    """
    for name, body in islice(result.model.flexible_bodies.items(), _MAX_BEAMS):
        if not body.has_axis:
            yield f"{name}.{body.modes[0]}"
            continue
        x = np.array([0.5, 1.0]) * axis_of(body, "deflection").length
        deflection = np.abs(np.nan_to_num(result.deflection(name, x)))
        middle, tip = np.max(deflection[:, :, 1:], axis=0, initial=0.0)
        if tip.max() <= _ZERO_TIP_RATIO * middle.max():
            yield f"{name}.{body.modes[0]}"
        else:
            yield f"{name}.tip.deflection.{'yz'[int(tip.argmax())]}"
