"""Plots of modes: shapes of the scene, and eigenvalues in the complex plane.

The scene is a wireframe: bodies from hinge to ends, beams along their axes, springs. Its
displacements are those of the linear model: every point moves along a straight line, by the scaled
difference of two adjacent poses.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.scene import split_reference

from ...engine.looped_engine import Probe
from ...figures import figure_style, new_figure, write_figure
from ...result.flexible import motion as observe
from ...result.scene3d.geometry import still_motion
from .linear_plots import require_columns

if TYPE_CHECKING:
    from ..linear_equations import LinearEquations

# --- wireframe ------------------------------------------------------------------------------------

#: Number of speeds of a hinge without constraints.
_FREE = 6
#: Number of points along a beam.
_FINE = 61
#: Largest perturbation of a coordinate between adjacent poses: rounding and curvature are small.
_STEP = 1e-6


@dataclass(frozen=True)
class Outline:
    """Lines of a scene in m, inertial axes.

    `bodies` and `springs` are lines (m, 3), `joints` (k, 3) the hinge positions on outboard bodies,
    `ground` (k, 3) those of hinges on the ground.
    """

    bodies: list[Array]
    springs: list[Array]
    joints: Array
    ground: Array

    @property
    def points(self) -> Array:
        """Points (n, 3) of all lines, joints and ground hinges, m."""
        return np.concatenate([*self.bodies, *self.springs, self.joints, self.ground])

    def displace(self, outline: Outline, scale: float) -> Outline:
        """Outline with every point moved by `scale` times its displacement to the other outline."""

        def displace_points(points: Array, there: Array) -> Array:
            return points + scale * (there - points)

        def displace_lines(lines: list[Array], there: list[Array]) -> list[Array]:
            return [displace_points(*pair) for pair in zip(lines, there, strict=True)]

        return Outline(
            displace_lines(self.bodies, outline.bodies),
            displace_lines(self.springs, outline.springs),
            displace_points(self.joints, outline.joints),
            displace_points(self.ground, outline.ground),
        )  # fmt: skip


def deformed_outlines(
    linear: LinearEquations, shapes: Array, part: float
) -> tuple[Outline, list[Outline]]:
    """Outline at the operating point, and outlines displaced by each of the real shapes (n, k).

    The largest displacement of a point is `part` times the size of the scene.
    """
    rest, near, scales = _small_displacements(linear, shapes, _steps(shapes), part)
    return rest, [
        rest.displace(outline, scale) for outline, scale in zip(near, scales, strict=True)
    ]


def amplitudes(linear: LinearEquations, shapes: Array, part: float) -> Array:
    """Factors (k,) of real shapes (n, k) for a largest displacement of `part` times the size.

    0 where no point moves.
    """
    steps = _steps(shapes)
    return steps * np.array(_small_displacements(linear, shapes, steps, part)[2])


def _steps(shapes: Array) -> Array:
    return _STEP / np.maximum(np.abs(shapes).max(axis=0, initial=0), 1e-300)


def _small_displacements(
    linear: LinearEquations, shapes: Array, steps: Array, part: float
) -> tuple[Outline, list[Outline], list[float]]:
    """Outline at the operating point, outlines displaced by small steps, and scale factors.

    A scale factor enlarges the largest displacement to `part` times the size of the scene.
    """
    states = [linear.state.q, *(linear.displaced_state(x) for x in (shapes * steps).T)]
    rest, *near = outlines(linear, np.array(states))
    size = float(np.linalg.norm(np.ptp(rest.points, axis=0)))
    largest = [
        float(np.linalg.norm(outline.points - rest.points, axis=1).max()) for outline in near
    ]
    scales = [
        part * (size or 1.0) / far if far > _MIN_DISPLACEMENT * _STEP * size else 0.0
        for far in largest
    ]
    return rest, near, scales


#: Negligible displacements, relative to those of a rotation of the whole scene by the same step.
_MIN_DISPLACEMENT = 1e-7


def outlines(linear: LinearEquations, q: Array) -> list[Outline]:
    """Outlines of the scene at each of the coordinates q (n, nq)."""
    sight = _SceneObservation(linear, q)
    bodies, springs = list(sight.bodies()), list(sight.springs())
    joints, ground = sight.joints(), sight.ground()
    return [
        Outline([x[k] for x in bodies], [x[k] for x in springs], joints[:, k], ground)
        for k in range(len(q))
    ]


class _SceneObservation:
    """Positions of all bodies and ends at n states, each observed once."""

    def __init__(self, linear: LinearEquations, q: Array) -> None:
        self.model, self.q = linear.model, q
        self.packed = linear.model.looped.packed
        self.scene = linear.model.scene.skeleton
        hinges = self.scene.hinges
        self.hinges = [hinges[k] for k in range(len(hinges))]
        self.outboard_references = {
            split_reference(hinge.outboard)[0]: hinge.outboard for hinge in reversed(self.hinges)
        }
        names = [self.scene.bodies.name(k) for k in range(len(self.scene.bodies))]
        ends = [f"{name}.{end}" for name in names for end in self.scene.bodies.ends(name) or ()]
        self.names = names
        self.motions = dict(
            zip([*names, *ends], self._observe_references([*names, *ends]), strict=True)
        )

    def _observe_references(self, references: Sequence[str]) -> Array:
        """Motion (references, n, 24) of bodies and ends; columns of `Observation.points`."""
        return self._observe([Probe(*self.packed.end(reference)) for reference in references])

    def _observe(self, probes: list[Probe]) -> Array:
        engine, q = self.model.looped.inertia_only, self.q
        memory = np.tile(engine.start_memory(), (len(q), 1))
        still = np.zeros((len(q), engine.nu))
        seen = engine.observe(np.zeros(len(q)), q, still, memory, probes, parts=("points",))
        return np.moveaxis(seen.points, 1, 0)

    def bodies(self) -> Iterator[Array]:
        """Lines (n, m, 3) of bodies, and lines from inboard to outboard ends of hinges."""
        for name in self.names:
            flexible = self.model.flexible_bodies.get(name)
            if flexible is not None and flexible.has_axis:
                yield self._axis(name)
            else:
                yield from self._star(name)
        for hinge in self.hinges:
            if hinge.inboard != "ground":
                yield self._line(hinge.inboard, hinge.outboard)

    def _line(self, first_end: str, second_end: str) -> Array:
        return np.stack([self.motions[first_end][:, 0:3], self.motions[second_end][:, 0:3]], axis=1)

    def _star(self, name: str) -> Iterator[Array]:
        """Lines from the hinge of a body to its other ends, or without such to its mass centre."""
        held = self.outboard_references.get(name, name)
        ends = [f"{name}.{end}" for end in self.scene.bodies.ends(name) or ()]
        free_ends = [end for end in ends if end != held]
        for end in free_ends:
            yield self._line(held, end)
        if not free_ends:
            pose = self.motions[name]
            body = self.scene.bodies.by_name[name]
            offset = pose[:, 15:24].reshape(-1, 3, 3) @ np.array(body.center_of_mass, float)
            yield np.stack([self.motions[held][:, 0:3], pose[:, 0:3] + offset], axis=1)

    def _axis(self, name: str) -> Array:
        """Deflected axis (n, m, 3) of a beam."""
        pose, body = self.motions[name], self.model.flexible_bodies[name]
        eta = self.q[:, self.model.coordinate_layout.modal[name].q_slice]
        frame = pose[:, 0:3], pose[:, 15:24].reshape(-1, 3, 3)
        motion = still_motion(body, np.zeros(len(eta)), eta, *frame)
        return observe.deflected_axis(motion, np.linspace(0.0, motion.length, _FINE))

    def springs(self) -> Iterator[Array]:
        """Lines (n, 2, 3) of springs and bushings."""
        for force in self.packed.system.forces:
            ends = self._observe([Probe(*end) for end in force.ends])
            yield np.moveaxis(ends[:, :, 0:3], 0, 1)

    def joints(self) -> Array:
        """Positions (k, n, 3) of hinges on their outboard bodies."""
        return np.array([self.motions[hinge.outboard][:, 0:3] for hinge in self.hinges])

    def ground(self) -> Array:
        """Positions (k, 3) of hinges that constrain bodies to the ground."""
        slots = self.model.coordinate_layout.hinges
        positions = [
            hinge.position for hinge in self.hinges
            if hinge.inboard == "ground" and slots[hinge.name].nu < _FREE
        ]  # fmt: skip
        return np.array(positions, float).reshape(-1, 3)


# --- shapes ---------------------------------------------------------------------------------------

Complex = NDArray[np.complex128]

#: Largest displacement drawn, relative to the size of the scene.
_PART = 0.15
#: Largest number of hinges drawn as dots; largest number drawn as large dots, and also at rest,
#: where more dots would hide the shape.
_DOTTED, _FEW = 60, 12
_BLUE, _GREY, _RED = "#0072B2", "#9a9a9a", "#D55E00"
#: Number of eigenvalues with a label; damping ratios of the lines of constant damping.
_NUMBERED, _RATIOS = 40, (0.01, 0.05, 0.2)
#: Ratio of largest to smallest frequency above which both axes are logarithmic.
_SPREAD = 50.0
#: Distance, relative to the axes, below which only the first of several eigenvalues is labelled.
_CLOSE = 0.03


@figure_style()
def shapes(
    linear: LinearEquations,
    eigenvalues: Complex,
    shapes: NDArray[Any],
    which: Sequence[int],
    path: str | Path | None,
) -> Any:
    """Plot a panel for each mode of `which`: the scene at rest (grey, dashed) and displaced."""
    require_columns(shapes)
    columns = min(3, len(which)) if len(which) != 4 else 2
    rows = -(-len(which) // columns)
    drawing = new_figure(3.4 * columns if columns > 1 else 5.0, 2.6 * rows + 0.3)
    panels = drawing.subplots(rows, columns, squeeze=False).ravel()
    rest, moved = deformed_outlines(linear, np.real(shapes[:, list(which)]), _PART)
    for panel, k, outline in zip(panels, which, moved, strict=False):
        _panel(panel, rest, outline)
        panel.set_title(f"{k + 1}: {eigenvalue_text(complex(eigenvalues[k]))}", fontsize=9)
    for panel in panels[len(which) :]:
        panel.set_visible(False)
    return write_figure(drawing, path)


def eigenvalue_text(value: complex) -> str:
    """Text of frequency and damping ratio, or of growth rate, for an eigenvalue, 1/s."""
    if value == 0:
        return "0 Hz, unrestrained"
    if value.imag == 0:
        return f"{'growth' if value.real > 0 else 'decay'} rate {abs(value.real):.4g} 1/s"
    text = f"{value.imag / (2 * np.pi):.4g} Hz"
    if value.real > 0:
        return f"{text}, growth rate {value.real:.3g} 1/s"
    return text + (f", damping {-value.real / abs(value):.2%}" if value.real else "")


def _panel(axis: Any, rest: Outline, moved: Outline) -> None:
    across, up = _plane(rest.points, moved.points)
    _draw(axis, rest, (across, up), _GREY, "--", 0.9)
    _draw(axis, moved, (across, up), _BLUE, "-", 1.6)
    axis.plot(rest.ground[:, across], rest.ground[:, up], "^", color="0.2", ms=6, zorder=4)
    if not np.abs(moved.points - rest.points).max(initial=0):
        axis.text(0.5, 0.03, "rotation about its own axis", transform=axis.transAxes, ha="center",
                  fontsize=8, color="0.4")  # fmt: skip
    axis.set_aspect("equal", adjustable="datalim")
    axis.margins(0.08)
    axis.set_xlabel(f"{'xyz'[across]} in m", fontsize=8)
    axis.set_ylabel(f"{'xyz'[up]} in m", fontsize=8)
    axis.tick_params(labelsize=7)
    axis.locator_params(nbins=5)


def _draw(
    axis: Any, outline: Outline, plane: tuple[int, int], colour: str, style: str, width: float
) -> None:
    from matplotlib.collections import LineCollection

    columns = list(plane)
    lines = [line[:, columns] for line in outline.bodies]
    axis.add_collection(
        LineCollection(lines, colors=colour, linestyles=style, linewidths=width, zorder=2)
    )
    springs = [line[:, columns] for line in outline.springs]
    axis.add_collection(LineCollection(springs, colors=colour, linestyles=":", linewidths=1.0))
    few, at_rest = len(outline.joints) <= _FEW, style == "--"
    if few or (len(outline.joints) <= _DOTTED and not at_rest):
        size = 3.5 if few else 2.0
        hollow: dict[str, Any] = {"mfc": "none", "ms": 6.5} if at_rest else {"ms": size}
        axis.plot(*outline.joints[:, columns].T, "o", color=colour, zorder=3, **hollow)
    axis.update_datalim(outline.points[:, columns])
    axis.autoscale_view()


def _plane(rest: Array, moved: Array) -> tuple[int, int]:
    """Axes of the plane to draw, in the order x, y, z.

    These are the axis of the largest displacement, and of the others that with the largest extent
    of the scene; for a point-like scene, of its displacement.
    """
    moves = np.abs(moved - rest).max(axis=0)
    reach = np.ptp(rest, axis=0)
    first = int(np.argmax(moves)) if moves.any() else int(np.argmax(reach))
    other_axes = [k for k in range(3) if k != first]
    second = max(other_axes, key=lambda k: (round(reach[k], 12), moves[k]))
    low, high = sorted((first, second))
    return low, high


@figure_style()
def eigenvalues(values: Complex, path: str | Path | None) -> Any:
    """Plot eigenvalues in the complex plane; unstable ones are red."""
    require_columns(values[None])
    drawing = new_figure(7.5, 5.0)
    axis = drawing.subplots()
    growing = values.real > 0
    for some, colour in ((~growing, _BLUE), (growing, _RED)):
        axis.plot(values[some].real, values[some].imag, "x", color=colour, ms=7, mew=1.6)
    wide = _frequency_spread(values.imag) > _SPREAD
    (_use_log_axes if wide else _widen_limits)(axis, values.real, values.imag)
    for k in _separate_indices(axis, values[:_NUMBERED]):
        position = values[k].real, values[k].imag
        axis.annotate(str(k + 1), position, xytext=(6, 3), fontsize=8, textcoords="offset points",
                      color="0.35")  # fmt: skip
    if (values.real < 0).any():
        _rays(axis, _decade_below(values.imag[values.imag > 0]) if wide else 0.0)
    axis.axvline(0, color="0.4", lw=0.9)
    axis.set_xlabel("growth in 1/s")
    axis.set_ylabel("angular frequency in rad/s")
    return write_figure(drawing, path)


def _frequency_spread(imaginary: Array) -> float:
    """Ratio of the largest to the smallest positive frequency."""
    positive = imaginary[imaginary > 0]
    return float(positive.max() / positive.min()) if len(positive) else 1.0


def _use_log_axes(axis: Any, real: Array, imaginary: Array) -> None:
    """Make both axes logarithmic, but linear below the decade of the smallest value."""
    slowest, least = _decade_below(imaginary[imaginary > 0]), _decade_below(np.abs(real[real != 0]))
    axis.set_xscale("symlog", linthresh=least)
    axis.set_yscale("symlog", linthresh=slowest)
    left, right = min(float(real.min()), 0.0), max(float(real.max()), 0.0)
    axis.set_xlim(2 * left - least, 2 * right + least)
    axis.set_ylim(-0.3 * slowest, 2 * float(imaginary.max()))


def _decade_below(numbers: Array) -> float:
    return float(10.0 ** np.floor(np.log10(numbers.min(initial=1.0))))


def _widen_limits(axis: Any, real: Array, imaginary: Array) -> None:
    """Set axis limits that include the imaginary axis."""
    top = max(float(imaginary.max(initial=0)), 0.0) or 1.0
    left, right = min(float(real.min()), 0.0), max(float(real.max()), 0.0)
    width = (right - left) or 0.1 * top
    axis.set_xlim(left - 0.1 * width, right + 0.15 * width)
    axis.set_ylim(-0.04 * top, 1.08 * top)


def _separate_indices(axis: Any, values: Complex) -> list[int]:
    """Indices of eigenvalues that do not overlap an earlier one in the plot."""
    positions = (axis.transScale + axis.transLimits).transform(
        np.column_stack([values.real, values.imag])
    )
    kept: list[int] = []
    for k, position in enumerate(positions):
        if all(np.abs(position - positions[j]).max() > _CLOSE for j in kept):
            kept.append(k)
    return kept


def _rays(axis: Any, slowest: float) -> None:
    """Draw lines of constant damping ratio across the plot.

    `slowest` is the frequency above which the axis is logarithmic, or 0 for a linear axis.
    """
    left, _ = axis.get_xlim()
    _, top = axis.get_ylim()
    for ratio in _RATIOS:
        slope = ratio / np.sqrt(1 - ratio**2)
        height = min(top, -left / slope)
        along = np.geomspace(slowest, height, 60) if slowest else np.array([0.0, height])
        axis.plot(-slope * along, along, color="0.8", lw=0.8, ls="--", zorder=0)
        if slowest or 0.12 * -left < slope * height:
            axis.annotate(
                f"{ratio:.0%}", (-slope * height, height), fontsize=8, color="0.5", ha="left",
                va="top", xytext=(3, -2), textcoords="offset points",
            )  # fmt: skip
