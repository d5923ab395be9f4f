"""Normal modes of a linear model: frequencies, damping, shapes and energy shares."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array, finite_float
from mstmm.display import PublicMembers, abbreviate_names
from mstmm.errors import SceneError
from mstmm.risk import Risk, information

from ..engine.compiled_scene import scene_length
from ..result.checks.shape_range import motion_range_risks, shape_limits
from . import energy_shares
from .file_formats import SavedResult, xarray
from .rotors import frame_of, whirl

if TYPE_CHECKING:
    from ..result.scene3d.view import SceneView
    from .linear_equations import LinearEquations

#: Default number of shapes in a figure.
_PANELS = 6
#: Names of the risks of single inputs and outputs; modes have neither.
INPUT_RISKS, OUTPUT_LEFT_OUT = ("changing-input", "input-without-effect"), "output-left-out"
CHANNEL_RISKS = (*INPUT_RISKS, OUTPUT_LEFT_OUT)

Complex = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Modes(PublicMembers, SavedResult):
    """k modes x(t) = Re(shape exp(eigenvalue t)) about an operating point, by ascending omega.

    Attributes:
        linear: the linear model.
        eigenvalues: (k,) complex, 1/s; of a conjugate pair the one with positive imaginary part.
        shapes: (n, k), real with unit modal mass without damping and gyroscopic terms, else complex
            with the largest entry 1.
        is_complete: whether no mode below the last one is missing; None if not counted.
        count: requested number of modes; None for all.
    """

    member_groups: ClassVar[Mapping[str, str]] = {
        "Modes": "eigenvalues omega frequency damping_ratio shapes whirl unstable "
        "is_undamped is_complete count frame linear lowest",
        "Participation": "dominant_coordinates kinetic_energy_shares strain_energy_shares "
        "participation_factors effective_modal_mass displaced_state",
        "Verdict": "trusted verdict risks warnings",
        "Output": "plot plot_eigenvalues view save to_xarray to_dict",
    }

    linear: LinearEquations = field(repr=False)
    eigenvalues: Complex
    shapes: NDArray[Any] = field(repr=False)
    is_complete: bool | None
    count: int | None = field(default=None, repr=False, kw_only=True)

    def __repr__(self) -> str:
        if not len(self):
            return "<Modes: none>"
        about = f"{len(self)}, {self.omega[0]:.6g} to {self.omega[-1]:.6g} rad/s"
        return f"<Modes: {about}{', rotating frame' if self.frame == 'rotating' else ''}>"

    def __len__(self) -> int:
        return len(self.eigenvalues)

    @property
    def findings(self) -> Iterator[Risk]:  # type: ignore[override]
        """Risks of the modes.

        They are those of the linear model except of its inputs and outputs, unstable and
        unrestrained modes, and modes above the frequency limit of the shape functions.
        """
        yield from (risk for risk in self.linear.risks if risk.name not in CHANNEL_RISKS)
        yield from self.motion_risks()
        yield from self._range_risks()

    def _range_risks(self) -> Iterator[Risk]:
        """Risks of modes above the frequency limit of the shape functions of flexible bodies.

        They are objections if a number of modes was requested, or if no vibration is below the
        limit: among all modes, the highest are never accurate.
        """
        limit = min(shape_limits(self.linear.model).values(), default=np.inf)
        fast = np.flatnonzero(self.omega > limit)
        if len(fast):
            first = np.flatnonzero(self.omega > 0)[:1]
            is_objection = self.count is not None or any(self._range_risks_of(first))
            for risk in self._range_risks_of(fast):
                yield replace(risk, invalidates=is_objection)

    def _range_risks_of(self, mode_indices: NDArray[np.intp]) -> Iterator[Risk]:
        some = replace(
            self, eigenvalues=self.eigenvalues[mode_indices], shapes=self.shapes[:, mode_indices]
        )
        return motion_range_risks(self.linear.model, some.omega, some.strain_energy_shares())

    def motion_risks(self) -> Iterator[Risk]:
        """Risks of unstable and unrestrained modes."""
        growing = self.eigenvalues.real.max(initial=0)
        if growing > 0:
            k = int(self.eigenvalues.real.argmax())
            moving = abbreviate_names(self.dominant_coordinates(k))
            yield information(
                "unstable", moving,
                f"unstable: a motion of {moving} grows at a rate of {growing:.4g} 1/s",
                "linearise about a stable state",
            )  # fmt: skip
        free = np.flatnonzero(self.omega == 0)
        if len(free):
            moved = list(
                dict.fromkeys(name for k in free for name in self.dominant_coordinates(int(k)))
            )
            yield information(
                "unrestrained", abbreviate_names(moved),
                f"no stiffness acts on {abbreviate_names(moved)}: modes of frequency 0",
                "add a stiffness, unless they are meant to move freely",
            )  # fmt: skip

    @cached_property
    def frame(self) -> str:
        """Frame of the frequencies, "fixed" or "rotating"; see `Linear.frame`."""
        return frame_of(self.linear)

    @cached_property
    def whirl(self) -> Array:
        """Whirl direction (k,) of each mode about the axis of the fastest spin, in its frame.

        1 is forward and -1 backward on circles, values between are ellipses, 0 is in a plane.
        """
        return whirl(self.linear, self.shapes)

    @property
    def omega(self) -> Array:
        """|eigenvalue| (k,) in rad/s: the angular frequency if undamped."""
        return np.abs(self.eigenvalues)

    @property
    def frequency(self) -> Array:
        """Frequency (k,) of the oscillation in Hz; 0 without oscillation."""
        return np.abs(self.eigenvalues.imag) / (2 * np.pi)

    @property
    def damping_ratio(self) -> Array:
        """Damping ratio (k,); negative for unstable modes, 0 where omega is 0."""
        omega = self.omega
        rates = 0.0 - self.eigenvalues.real
        return np.divide(rates, omega, out=np.zeros_like(omega), where=omega > 0)

    def lowest(self, count: int) -> Modes:
        """The first `count` modes."""
        return replace(self, eigenvalues=self.eigenvalues[:count], shapes=self.shapes[:, :count])

    @cached_property
    def _units(self) -> Array:
        """Modal masses (k,), x* M x, of the shapes."""
        linear, x = self.linear, self.shapes
        loops = linear.constrained_motion is not None
        moved = linear.M @ x if loops else energy_shares.operator_products(linear.operators.mass, x)
        return np.real(np.einsum("ik,ik->k", np.conj(self.shapes), moved))

    @cached_property
    def _lengths(self) -> Array:
        """Weights (n,) to compare coordinates: 1 for m, the scene length for rad."""
        turns = [unit == "rad" for unit in self.linear.coordinate_units]
        return np.where(turns, scene_length(self.linear.model), 1.0)

    @cached_property
    def participation_factors(self) -> NDArray[Any]:
        """Modal excitation (k, disturbances) per unit of each disturbance: x* W / modal mass.

        For accelerations of the ground these are the participation factors with opposite sign.
        """
        pushed = np.conj(self.shapes).T @ self.linear.W
        return np.asarray(pushed / self._units[:, None])

    @property
    def effective_modal_mass(self) -> Array:
        """Effective modal mass (k, disturbances): |x* W|^2 / modal mass.

        It is in kg for accelerations of the ground; the sum over all undamped modes of a scene is
        the moving mass.
        """
        return np.asarray(np.abs(self.participation_factors) ** 2 * self._units[:, None])

    def kinetic_energy_shares(self) -> dict[str, Array]:
        """Share (k,) of each body in the kinetic energy x* M x of each shape.

        The rotors of a hinge count with its outboard body.
        """
        return energy_shares.kinetic(self.linear, self.shapes)

    def strain_energy_shares(self) -> dict[str, Array]:
        """Share (k,) of each owner in the elastic energy of each shape.

        Owners are hinges with laws, flexible bodies, and "springs" for all springs together, if
        there are any.  nan for a shape without elastic energy.
        """
        return energy_shares.strain_shares(self.linear, self.shapes)

    def displaced_state(self, k: int, amplitude: float) -> Array:
        """Coordinates q (nq,) of the state displaced by `amplitude` times Re(shape k)."""
        return self.linear.displaced_state(
            finite_float("amplitude", amplitude) * np.real(self._shape(k))
        )

    def _shape(self, k: int) -> NDArray[Any]:
        if isinstance(k, bool) or not isinstance(k, (int, np.integer)) or not 0 <= k < len(self):
            raise SceneError(f"shape {k!r}: expected the index of one of {len(self)} modes, from 0")
        return self.shapes[:, k]

    def dominant_coordinates(self, k: int) -> list[str]:
        """Dominant coordinates of mode k: at least a tenth of the largest, largest first.

        A radian counts as one length of the scene.
        """
        size = np.abs(self._shape(k)) * self._lengths
        large_entries = np.flatnonzero(size > 0.1 * size.max(initial=0))
        order = large_entries[np.argsort(-size[large_entries], kind="stable")]
        return [self.linear.coordinate_names[j] for j in order]

    def to_dict(self) -> dict[str, Any]:
        """All data as a dictionary for JSON; one row per shape."""
        return {
            "omega": self.omega.tolist(), "frequency": self.frequency.tolist(),
            "damping": self.damping_ratio.tolist(), "complete": self.is_complete,
            "frame": self.frame, "whirl": self.whirl.tolist(),
            "eigenvalues": [[x.real, x.imag] for x in self.eigenvalues.tolist()],
            "coordinates": list(self.linear.coordinate_names),
            "units": list(self.linear.coordinate_units),
            "shapes": {
                "real": np.real(self.shapes).T.tolist(),
                "imag": np.imag(self.shapes).T.tolist(),
            },
            "kinetic": {name: row.tolist() for name, row in self.kinetic_energy_shares().items()},
            "strain": {
                name: [None if np.isnan(x) else x for x in row.tolist()]
                for name, row in self.strain_energy_shares().items()
            },
            **self.assessment(),
        }  # fmt: skip

    def to_xarray(self) -> Any:
        """`xarray.Dataset` with real and imaginary parts; EnvironmentFailure without the extra."""
        kinetic, strain = self.kinetic_energy_shares(), self.strain_energy_shares()
        arrays: dict[str, Any] = {
            "omega": ("mode", self.omega, {"units": "rad/s"}),
            "frequency": ("mode", self.frequency, {"units": "Hz"}),
            "damping": ("mode", self.damping_ratio),
            "growth": ("mode", self.eigenvalues.real, {"units": "1/s"}),
            "whirl": ("mode", self.whirl),
            "shape": (("coordinate", "mode"), np.real(self.shapes)),
            "shape_imaginary": (("coordinate", "mode"), np.imag(self.shapes)),
            "kinetic": (("body", "mode"), np.array(list(kinetic.values()))),
            "strain": (("owner", "mode"), np.array(list(strain.values()))),
        }
        names = {
            "mode": np.arange(1, len(self) + 1), "coordinate": list(self.linear.coordinate_names),
            "body": list(kinetic), "owner": list(strain),
        }  # fmt: skip
        about = {"complete": str(self.is_complete), "frame": self.frame}
        return xarray().Dataset(arrays, names, about)

    def _rows(self) -> Iterator[tuple[str, ...]]:
        """Header, then one row per mode."""
        parts = [np.real] if self.is_undamped else [np.real, np.imag]
        named = [name + " imaginary" * (part is np.imag) for part in parts
                 for name in self.linear.coordinate_names]  # fmt: skip
        whose = (
            ("kinetic energy", self.kinetic_energy_shares()),
            ("strain energy", self.strain_energy_shares()),
        )
        shared = [f"{kind} of {name}" for kind, part in whose for name in part]
        yield "mode", "omega [rad/s]", "frequency [Hz]", "damping", "growth [1/s]", *named, *shared
        about = self.omega, self.frequency, self.damping_ratio, self.eigenvalues.real
        for k, shape in enumerate(self.shapes.T):
            numbers = [*(x[k] for x in about), *(x for part in parts for x in part(shape)),
                       *(row[k] for _, part in whose for row in part.values())]  # fmt: skip
            yield str(k + 1), *(repr(float(x)) for x in numbers)

    def plot(self, path: str | Path | None = None, which: Sequence[int] | None = None) -> Any:
        """Mode shapes as a `matplotlib.figure.Figure`, written to `path` if given.

        It shows the scene at the state and displaced by the real part of each shape of `which`
        (indices from 0, by default the first six), in the coordinate plane with the largest view of
        the motion.

        Raises SceneError for an unknown shape, EnvironmentFailure without the extra `plot`.
        """
        from .plots.mode_shapes import shapes

        which = self._shape_indices(which)
        return shapes(self.linear, self.eigenvalues, self.shapes, which, path)

    def _shape_indices(self, which: Sequence[int] | None) -> Sequence[int]:
        """Indices of the requested shapes, by default the first; SceneError for an unknown one."""
        if which is None:
            return range(min(_PANELS, len(self)))
        if isinstance(which, str) or not isinstance(which, Sequence) or not 0 < len(which) <= 12:
            raise SceneError(
                f"which = {which!r}: expected a list of 1 to 12 shapes, such as [0, 2]"
            )
        for k in which:
            self._shape(k)
        return which

    def view(
        self,
        path: str | Path | None = None,
        *,
        which: Sequence[int] | None = None,
        amplitude: float | None = None,
        title: str = "Normal modes",
    ) -> SceneView:
        """Animated mode shapes on one page, written to `path` if given; see `Result.view`.

        `which` are indices from 0 of the modes to choose from, by default the first six with
        nonzero frequency.  The largest displacement is `amplitude` (default 0.08) times the size
        of the scene, and no rotation exceeds 0.8 rad; loops stay closed.

        Raises SceneError for an unknown shape, EnvironmentFailure without the extras.
        """
        from .plots.mode_animation import view

        if amplitude is not None and not 0 < finite_float("amplitude", amplitude) <= 1:
            raise SceneError(f"amplitude = {amplitude:g}: expected a fraction of the size, 0 to 1")
        if which is None:
            which = np.flatnonzero(self.omega > 0)[:_PANELS].tolist() or None
        which = self._shape_indices(which)
        animation = view(self.linear, self.eigenvalues, self.shapes, which, amplitude, title)
        if path is not None:
            animation.save(path)
        return animation

    def plot_eigenvalues(self, path: str | Path | None = None) -> Any:
        """Eigenvalue plot as a `matplotlib.figure.Figure`, written to `path` if given.

        The axes are the growth rate in 1/s and the angular frequency in rad/s, with lines of equal
        damping ratio.

        Raises EnvironmentFailure without the extra `plot`.
        """
        from .plots.mode_shapes import eigenvalues

        return eigenvalues(self.eigenvalues, path)

    @property
    def unstable(self) -> NDArray[np.bool_]:
        """Mask (k,) of unstable modes."""
        return self.eigenvalues.real > 0

    @property
    def is_undamped(self) -> bool:
        """Whether the modes have neither damping nor gyroscopic terms."""
        return not np.iscomplexobj(self.shapes)
