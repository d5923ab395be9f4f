"""Drake: accelerations inside its own integrator, because its wheel has no C++ headers."""

from __future__ import annotations

import numpy as np
from pydrake.all import (
    BallRpyJoint,
    FixedOffsetFrame,
    MultibodyPlant,
    ResetIntegratorFromFlags,
    RevoluteJoint,
    RigidTransform,
    RotationMatrix,
    Simulator,
    SpatialInertia,
    UnitInertia,
)
from scipy.spatial.transform import Rotation

from .links import Tree

EVALUATIONS_PER_STEP = 3


def plant_of(tree: Tree) -> MultibodyPlant:
    """A continuous plant.  Drake's ball joint has angles as coordinates."""
    plant = MultibodyPlant(0.0)
    bodies = [plant.world_body()]
    for link in tree.links:
        carrier = bodies[link.parent + 1]
        # A massless body gets a mass: in the Puma it is on an axis fixed in space.
        mass = link.mass or 1.0
        unit = link.inertia / mass
        central = UnitInertia(*np.diag(unit), unit[0, 1], unit[0, 2], unit[1, 2])
        about_origin = central.ShiftFromCenterOfMass(link.center)
        spatial = SpatialInertia(mass, link.center, about_origin, skip_validity_check=True)
        body = plant.AddRigidBody(link.name, spatial)
        pose = RigidTransform(RotationMatrix(link.orientation), link.position)
        frame = plant.AddFrame(FixedOffsetFrame(f"{link.name}_on", carrier.body_frame(), pose))
        if link.kind == "pin":
            joint = plant.AddJoint(RevoluteJoint(link.name, frame, body.body_frame(), link.axis))
            if link.armature:
                actuator = plant.AddJointActuator(link.name, joint)
                actuator.set_default_rotor_inertia(link.armature)
                actuator.set_default_gear_ratio(1.0)
        elif link.kind == "ball":
            plant.AddJoint(BallRpyJoint(link.name, frame, body.body_frame()))
        bodies.append(body)
    plant.mutable_gravity_field().set_gravity_vector(tree.gravity)
    plant.Finalize()
    return plant


def inboard_speeds(angles: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Drake's speeds of a chain of balls: angular velocities in the axes of the inboard frame."""
    rotations = Rotation.from_euler("ZYX", angles.reshape(-1, 3)[:, ::-1])
    return rotations.apply(u.reshape(-1, 3)).ravel()


class DrakeRun:
    """One of its Runge-Kutta integrators from one state: fixed steps, or error control."""

    def __init__(
        self,
        tree: Tree,
        q: np.ndarray,
        u: np.ndarray,
        step: float = 1e-5,
        scheme: str = "runge_kutta3",
        tolerance: float = 0.0,
    ) -> None:
        self.plant, self.step = plant_of(tree), step
        self.simulator = Simulator(self.plant)
        self.context = self.simulator.get_mutable_context()
        self.state = np.concatenate([q, u])
        self.plant.SetPositionsAndVelocities(self.context, self.state)
        integrator = ResetIntegratorFromFlags(self.simulator, scheme, step)
        integrator.set_fixed_step_mode(tolerance == 0)
        if tolerance:
            integrator.set_target_accuracy(tolerance)
            integrator.set_requested_minimum_step_size(1e-8)
            integrator.set_throw_on_minimum_step_size_violation(True)
        self.simulator.Initialize()

    def accelerations(self, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """udot of one state (q and u of Drake)."""
        self.plant.SetPositionsAndVelocities(self.context, np.concatenate([q, u]))
        return self.plant.get_generalized_acceleration_output_port().Eval(self.context)

    def run(self, steps: int) -> None:
        """Integrate `steps` fixed steps from the first state."""
        self.context.SetTime(0.0)
        self.plant.SetPositionsAndVelocities(self.context, self.state)
        self.simulator.Initialize()
        self.simulator.AdvanceTo(steps * self.step)
