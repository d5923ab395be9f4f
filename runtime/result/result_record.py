"""Record of a run: named, labelled quantities over time, with units."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.risk import Risk
from mstmm.scene.checks.flexible_bodies import short_beam_warnings

from ..engine.compiled_scene import CompiledScene
from ..integrate.achieved_error import AchievedError
from ..integrate.c_loop import Statistics, Status
from ..integrate.settings import Settings
from ..packing.coordinate_layout import HingeSlots
from ..run.checkpoint import Checkpoint
from ..run.error_estimate import ErrorEstimate
from ..run.step_stability import StepCheck, check_step
from ..run.trajectory import MethodSegment, Trajectory
from .certificate import Certificate
from .flexible.quantities import FlexibleResults
from .observations import Observations
from .quantities import Quantities
from .quantity_names import Quantity

#: Size limit of all stored mesh files of a scene, bytes.
_MAX_MESH_BYTES = 50_000_000

#: States below this have finite energies in any realistic scene.
_MAX_SAFE_MAGNITUDE = 1e60


class Record(FlexibleResults, ABC):
    """States of a run and all derived quantities over the sample times.

    See `Result` for the attributes; it adds the certificate and the export.
    """

    model: CompiledScene
    trajectory: Trajectory
    q: Array
    u: Array
    meshes: Mapping[str, bytes]
    checkpoint: Checkpoint | None
    status: Status | None
    statistics: Statistics | None
    settings: Settings

    def __init__(
        self, model: CompiledScene, run: Trajectory, error: ErrorEstimate | None = None
    ) -> None:
        self.model, self.trajectory, self._error = model, run, error
        self.meshes = {}
        self.checkpoint = None
        self.t, self.q, self.u, self.event = run.t, run.q, run.u, run.event
        self.status = run.status
        self.statistics, self.settings = run.statistics, run.settings
        self._observations = Observations(model, run)
        self._quantities = Quantities(self._observations, self)
        self._measures: dict[object, Any] = {}  # of checks

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the model, the run and meshes; derived quantities are computed again."""
        return (
            type(self),
            (self.model, self.trajectory, self._error),
            {"meshes": self.mesh_contents()},
        )

    def mesh_contents(self) -> dict[str, bytes]:
        """Contents of the mesh files of the scene's shapes by path.

        As stored with the result, else as they are now. Unreadable files are left out; all of them
        are if they are too large to store.
        """
        files = dict(self.meshes)
        names = {shape.file for shape in self.model.scene.shape if shape.file is not None}
        present = [path for name in names - set(files) if (path := Path(name)).is_file()]
        if sum(path.stat().st_size for path in present) > _MAX_MESH_BYTES:
            return files
        for path in present:
            try:
                files[str(path)] = path.read_bytes()
            except OSError:
                continue
        return files

    @property
    def success(self) -> bool:
        """True if the run reached its end or a requested event with finite values.

        Finite are states, energies and momenta of every sample. Bounces that come to rest end a run
        early, which is no success. It does not imply that the result is accurate: see `trusted`.
        """
        return self.is_comparable and self.status is not Status.CAME_TO_REST

    @property
    def is_comparable(self) -> bool:
        """True if the run can be compared with others of the scene.

        A success, or a run that ended early because bounces came to rest.
        """
        return self.trajectory.is_comparable and not self._unusable

    @property
    def message(self) -> str:
        """Reason why the run ended, as a sentence, and which of its samples cannot be used."""
        text, unusable = self.trajectory.message, self._unusable
        if not unusable or not self.trajectory.is_comparable:
            return text
        text = f"{text}, but {unusable}"
        return text if self._step is None else self._step.explain_failure(text)

    @cached_property
    def _step(self) -> StepCheck | None:
        """Check of the fixed step at the start, made here so that a run does not pay for it."""
        run = self.trajectory
        if run.start is None and not len(run.t):
            return None
        return check_step(self.model.looped, run.settings, *run.first[1:])

    @cached_property
    def _unusable(self) -> str:
        """Reason why samples with finite states cannot be used, or ""."""
        run = self.trajectory
        if (
            not self.model.flexible_bodies
            and max(_max_abs(run.q), _max_abs(run.u), _max_abs(run.work)) < _MAX_SAFE_MAGNITUDE
        ):
            return ""
        sums = self._observations.part("sums")
        failing = np.isnan(sums).any(axis=1)
        if self._observations.failures and failing.any():
            count = f"{failing.sum()} of {len(sums)} samples cannot be evaluated"
            return f"{count}: {self._observations.failures[0]}"
        finite = np.isfinite(sums).all() and np.isfinite(run.work).all()
        return "" if finite else "its energies or momenta overflow"

    @property
    def method_history(self) -> tuple[MethodSegment, ...]:
        """Segments of method="auto": method, start (s), reason and fastest motion (1/s).

        Empty for a run with a given method.
        """
        return self.trajectory.methods

    @property
    def achieved_error(self) -> AchievedError | None:
        """Achieved error for the target `simulate(error=...)`; None without a target."""
        return self.trajectory.achieved_error

    @property
    def last_state(self) -> tuple[float, Array, Array]:
        """Last valid state (t, q, u): the end, or the last one before a failure."""
        state = self.trajectory.last_state
        return (float(self.t[-1]), self.q[-1], self.u[-1]) if state is None else state

    @property
    @abstractmethod
    def certificate(self) -> Certificate:
        """Quality report of the run."""

    @property
    def risks(self) -> tuple[Risk, ...]:
        """Findings about the scene, before the run and in its result; empty for a clean run.

        Objections first, then notes.
        """
        certificate_risks = self.certificate.risks
        texts = {str(risk) for risk in certificate_risks}
        return (
            *certificate_risks,
            *(risk for risk in self.model.scene.risks if str(risk) not in texts),
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """Findings, one sentence each, and notes on secondary failures.

        Findings are left out if the run was to ignore them.
        """
        risks = self.risks if self.trajectory.reported_risks else ()
        notes, failures = self.trajectory.notes, self._observations.failures
        return tuple(dict.fromkeys((*map(str, risks), *notes, *failures)))

    def _model_risks(self) -> tuple[Risk, ...]:
        """Findings about models of the scene that are outside their range in any run."""
        return tuple(short_beam_warnings(self.model.scene))

    # --- bodies and ends ------------------------------------------------------------------------

    def position(self, reference: str) -> Array:
        """Position (n, 3) in m of "rod1" (its origin) or "rod1.tip".

        Here and below: SceneError, with the nearest name, for an unknown name.
        """
        return self._quantities.body_quantity(reference, "position")

    def velocity(self, reference: str) -> Array:
        """Velocity (n, 3) in m/s."""
        return self._quantities.body_quantity(reference, "velocity")

    def acceleration(self, reference: str) -> Array:
        """Acceleration (n, 3) in m/s2, gravity not subtracted."""
        return self._quantities.body_quantity(reference, "acceleration")

    def orientation(self, reference: str) -> Array:
        """Unit quaternion (n, 4), w, x, y, z, of the user's axes to inertial axes.

        Its sign is continuous over time and w >= 0 in the first sample.
        """
        return self._quantities.body_quantity(reference, "orientation")

    def angular_velocity(self, reference: str) -> Array:
        """Angular velocity (n, 3) in rad/s."""
        return self._quantities.body_quantity(reference, "angular_velocity")

    def angular_acceleration(self, reference: str) -> Array:
        """Angular acceleration (n, 3) in rad/s2."""
        return self._quantities.body_quantity(reference, "angular_acceleration")

    # --- hinges ---------------------------------------------------------------------------------

    def coordinates(self, hinge: str) -> Array:
        """Coordinates (n, nq) of one hinge; of a flexible body the modal coordinates."""
        return self.q[:, self._quantities.slots(hinge).q_slice]

    def speeds(self, hinge: str) -> Array:
        """Speeds (n, nu) of one hinge; of a flexible body the modal speeds."""
        return self.u[:, self._quantities.slots(hinge).u_slice]

    def force(self, hinge: str) -> Array:
        """Force (n, 3) in N of the inboard on the outboard side of a hinge, inertial axes."""
        return self._quantities.hinge_quantity(hinge, "force")

    def moment(self, hinge: str) -> Array:
        """Moment (n, 3) in N*m of the inboard on the outboard side about P, inertial axes."""
        return self._quantities.hinge_quantity(hinge, "moment")

    def effort(self, hinge: str) -> Array:
        """Efforts (n, nu) in N, N*m along the speeds of a hinge, of its law or its drive."""
        return self._quantities.effort(hinge)

    def coordinate_info(self, hinge: str) -> HingeSlots:
        """Names, units and slots of a hinge's coordinates and speeds."""
        return self._quantities.slots(hinge)

    @property
    def udot(self) -> Array:
        """Accelerations (n, nu) of the hinge speeds, m/s2, rad/s2."""
        return self._observations.part("udot")

    # --- sums -----------------------------------------------------------------------------------

    def energy(self) -> Array:
        """Total energy (n,) in J: kinetic, gravity (zero at the inertial origin), springs."""
        return self._quantities.sum("energy")

    def energy_components(self) -> dict[str, Array]:
        """Parts of the energy, (n,) each in J: kinetic, gravity, springs."""
        names = ("kinetic", "gravity", "springs")
        return {name: self._quantities.sum(f"energy.{name}") for name in names}

    def power(self) -> Array:
        """Power (n,) in W of all non-conservative loads: dampers, efforts, loads, drives."""
        return self._quantities.sum("power")

    @property
    def work(self) -> Array:
        """Integral (n,) of `power` in J from the start."""
        return self.trajectory.work

    def momentum(self) -> Array:
        """Linear momentum (n, 3) in kg*m/s of the whole scene."""
        return self._quantities.sum("momentum")

    def angular_momentum(self) -> Array:
        """Angular momentum (n, 3) in kg*m2/s of the whole scene about the inertial origin."""
        return self._quantities.sum("angular_momentum")

    def outputs(self) -> dict[str, Array]:
        """Outputs of the scene by name, (n,) each or (n, 3), (n, 4) for vectors."""
        return {name: self.quantity(name).values for name in self._quantities.outputs()}

    # --- by name --------------------------------------------------------------------------------

    def quantity_names(self) -> tuple[str, ...]:
        """All names that `quantity`, `plot` and `table` accept."""
        return tuple(self._quantities.names())

    def quantity(self, name: str) -> Quantity:
        """Values with unit by name: "shoulder.angle", "rod1.tip.vx", "shoulder.force", "energy"."""
        return self._quantities.get(name)


def _max_abs(values: Array) -> float:
    return float(np.max(np.abs(values), initial=0.0))
