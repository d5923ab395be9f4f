"""Results of flexible bodies and momenta of any body, as a part of `Result`."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from mstmm.array_validation import Array
from mstmm.errors import SceneError

from . import momentum
from . import motion as observe
from .momentum import Momenta
from .section_loads import FlexibleBodies, section_loads
from .station_loads import station_loads

if TYPE_CHECKING:
    from collections.abc import Callable

    from ...engine.compiled_scene import CompiledScene
    from ..observations import Observations
    from .motion import Motion


#: Sources of bending moments and axial forces.
SOURCES = ("equilibrium", "shapes")


class FlexibleResults:
    """Quantities along beams and of flexible bodies; part of `Result`.

    `x` is a position along the beam in m, an array of m positions, or the name of an end ("tip").
    For one position the arrays are (n, ...), for several (n, m, ...). SceneError for a position off
    the beam, an unknown body, and a body without such a quantity.
    """

    model: CompiledScene
    _observations: Observations

    @cached_property
    def _flexible(self) -> FlexibleBodies:
        return FlexibleBodies(self.model, self._observations)

    @cached_property
    def _momenta(self) -> Momenta:
        return Momenta(self._flexible)

    def _evaluate_along(
        self, body: str, x: ArrayLike | str, what: str, get: Callable[[Motion, Array], Array]
    ) -> Array:
        motion = self._flexible.motion(body, what)
        if isinstance(x, str):
            x = self._end_position(motion, x, what)
        positions = observe.checked_stations(motion.body, x, what)
        values = get(motion, positions)
        return values[:, 0] if np.ndim(x) == 0 else values

    @staticmethod
    def _end_position(motion: Motion, end: str, what: str) -> float:
        observe.axis_of(motion.body, what)
        port = motion.body.ports.get(end)
        if port is None:
            known = ", ".join(motion.body.ports)
            raise SceneError(f'{what}: "{motion.body.name}" has no end "{end}"; it has {known}')
        exact = motion.body.exact
        return float(port.position[0] if exact is None else exact.data.ends[end][0])

    # --- along beams ----------------------------------------------------------------------------

    def deflection(self, body: str, x: ArrayLike | str) -> Array:
        """Elastic displacement (n, 3) in m of the axis at x in the floating frame, frame axes.

        Includes foreshortening by bending, unless the beam has stiffening = false.
        """
        return self._evaluate_along(body, x, "deflection", observe.deflection)

    def slope(self, body: str, x: ArrayLike | str) -> Array:
        """Slopes (n, 2) of the axis at x relative to the floating frame, v' and w'.

        v and w are the deflections along y and z.
        """
        return self._evaluate_along(body, x, "slope", observe.slope)

    def curvature(self, body: str, x: ArrayLike | str) -> Array:
        """Curvature (n, 2) in 1/m at x about y, -w'', and about z, v''."""
        return self._evaluate_along(body, x, "curvature", observe.curvature)

    def strain(self, body: str, x: ArrayLike | str) -> Array:
        """Strains (n, 6) of an exact beam at x beyond those at rest, section axes.

        Stretch and shear along y and z (m/m), twist rate and curvature about y and z (rad/m).
        """
        return self._evaluate_along(body, x, "strain", observe.strain)

    def section_force(self, body: str, x: ArrayLike | str) -> Array:
        """Section force (n, 3) in N at x, section axes, from equilibrium.

        Force of the part beyond x on the part before it: axial (tension positive), shear along y
        and z.
        """
        return self._evaluate_along(body, x, "section_force", lambda m, p: self._loads(m, p)[0])

    def section_moment(self, body: str, x: ArrayLike | str) -> Array:
        """Section moment (n, 3) in N*m at x, section axes, from equilibrium.

        Moment of the part beyond x on the part before it, about the deflected axis: torque, bending
        about y and z.
        """
        return self._evaluate_along(body, x, "section_moment", lambda m, p: self._loads(m, p)[1])

    def bending_moment(self, body: str, x: ArrayLike | str, source: str = "equilibrium") -> Array:
        """Bending moments (n, 2) in N*m at x about y and z, of the part beyond on the part before.

        From "equilibrium": sum of inertia, gravity and loads of the free side. From "shapes": -EI_y
        w'' and EI_z v'', no more accurate than the curvature of the shape functions.
        """
        if _require_source(source) == "equilibrium":
            return self.section_moment(body, x)[..., 1:]
        return self._evaluate_along(body, x, "bending_moment", observe.elastic_moment)

    def axial_force(self, body: str, x: ArrayLike | str, source: str = "equilibrium") -> Array:
        """Axial force (n,) in N at x, tension positive.

        From "equilibrium" as `section_force`, also where the axis does not stretch; from "shapes"
        EA s', for beams with axial modes.
        """
        if _require_source(source) == "equilibrium":
            return self.section_force(body, x)[..., 0]
        return self._evaluate_along(body, x, "axial_force", observe.elastic_force)

    def _loads(self, motion: Motion, positions: Array) -> tuple[Array, Array]:
        flexible, name = self._flexible, motion.body.name
        if name in flexible.unbalanced:
            raise SceneError(
                f'"{name}": loop loads on its ends are those of the rigid run, which do not '
                "balance its vibration, so that section loads do not follow from equilibrium; use "
                'source = "shapes" of bending_moment and axial_force, or model = "flexible"'
            )
        if motion.body.exact is not None:
            return station_loads(self._flexible, motion, positions)
        return section_loads(
            motion, positions, flexible.gravity, flexible.inboard_position(name),
            flexible.point_loads(name), flexible.line_loads(name),
        )  # fmt: skip

    def deflected_shape(self, body: str, points: int = 41) -> Array:
        """Inertial positions (n, points, 3) in m of the deflected axis, evenly spaced."""
        if points < 2:
            raise SceneError(f"shape: points = {points}: expected 2 or more")
        motion = self._flexible.motion(body, "shape")
        length = observe.axis_of(motion.body, "shape").length
        return observe.deflected_axis(motion, np.linspace(0.0, length, points))

    # --- of a flexible body ---------------------------------------------------------------------

    def modal_energy(self, body: str) -> Array:
        """Energy (n, modes) in J by mode: strain energy plus kinetic energy in the floating frame.

        1/2 eta_k (K eta)_k + 1/2 etad_k (M etad)_k.
        """
        return momentum.modal_energy(self._flexible.motion(body, "modal_energy"))

    def strain_energy(self, body: str) -> Array:
        """Strain energy (n,) in J."""
        return momentum.strain_energy(self._flexible.motion(body, "strain_energy"))

    # --- of any body ----------------------------------------------------------------------------

    def body_momentum(self, body: str) -> Array:
        """Linear momentum (n, 3) in kg*m/s of one body, rigid or flexible."""
        return self._momenta.body_momentum(body).linear

    def body_angular_momentum(self, body: str) -> Array:
        """Angular momentum (n, 3) in kg*m2/s of one body about its own mass centre."""
        return self._momenta.body_momentum(body).angular

    def center_of_mass(self, body: str) -> Array:
        """Position (n, 3) in m of the mass centre of one body in its deformed shape."""
        return self._momenta.body_momentum(body).center

    def equivalent_velocity(self, body: str) -> Array:
        """Velocity (n, 3) in m/s of a rigid body of the same mass and momentum, p/m."""
        return self._momenta.body_momentum(body).velocity

    def equivalent_angular_velocity(self, body: str) -> Array:
        """Angular velocity (n, 3) in rad/s of a rigid body of the same angular momentum.

        About the mass centre, with the inertia of the undeformed body in the axes of the floating
        frame.
        """
        return self._momenta.body_momentum(body).angular_velocity


def _require_source(source: str) -> str:
    if source not in SOURCES:
        raise SceneError(f'source = "{source}": expected "equilibrium" or "shapes"')
    return source
