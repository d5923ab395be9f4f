"""Sweeps: sequences of passes for accelerations, efforts and solutions."""

from __future__ import annotations

from dataclasses import replace

from .approximate_tangent import APPROXIMATE_SOLUTION, APPROXIMATE_TANGENT, RATES_CHANGE
from .flexible import DRAG, MOMENTUM, SECTION_MOTION, STRAIN
from .forward_kinematics import DRIVES, FORWARD, HINGE_MOTION, POSES, PRESCRIBED_ACCELERATIONS
from .inverse_dynamics import (
    COLUMN,
    COLUMN_BACKWARD,
    COLUMN_FORWARD,
    COMPOSITION,
    FACTORISE,
    HINGE_EFFORTS,
    OUTBOARD_LOAD,
    REQUIRED_EFFORTS,
)
from .loads import (
    COUPLING_LOADS,
    COUPLING_MULTIPLIERS,
    DRIVE_POWER,
    EFFORTS,
    EFFORTS_POWER,
    FORCES,
    LAWS,
    LOADS,
)
from .loop_closure import (
    CLEAR_LOADS,
    CLOSURE_ACCELERATIONS,
    CLOSURE_LOADS,
    CLOSURES,
    CONDENSE_WITH_ROWS,
    RECOVER_WITH_ROWS,
    ROW_ELIMINATION,
    ROW_MULTIPLIER,
)
from .pass_steps import Pass, Run, Sweep
from .planar_passes import planar_sweep
from .riccati_sweep import (
    CONDENSE,
    LINK_CONDENSE,
    LINK_FORWARD,
    LINK_RECOVER,
    LINK_TURN,
    QR_CONDENSE,
    QR_OWN,
    RECOVER,
    ROTOR_RESIDUAL,
    ROTOR_RESIDUAL_OF_TREE,
)
from .tangent_sweep import (
    APPLIED_SLOPE,
    CONTRIBUTIONS,
    COORDINATE_INCREMENT,
    DIRECTIONAL,
    TANGENT,
    TANGENT_SOLUTION,
    TANGENT_WITH_INCREMENTS,
)

_PRESCRIBED_RUNS = (
    Run(whole=PRESCRIBED_ACCELERATIONS),
    Run(hook="drive_values", when="driven"),
    Run(whole=DRIVES, when="driven"),
    Run(hook="expression_values", when="expressions"),
)
PRESCRIBED_VALUES = Sweep(
    "prescribed_values", "Driven coordinates and values of expressions.", _PRESCRIBED_RUNS
)
_LOAD_RUNS = (
    Run(whole=DRAG, when="poses flexible"),
    Run(whole=LOADS, when="poses"),
    Run(whole=FORCES, when="poses"),
)

#: Closing of rows and computation of multipliers, in place of `condense` and `recover`.
_CLOSURE_RUNS = (
    Run(hook="begin_rows"),
    Run(whole=CLOSURES),
    Run(hook="set_row_targets"),
    Run(whole=CONDENSE_WITH_ROWS),
    Run(whole=ROW_ELIMINATION),
    Run(whole=ROW_MULTIPLIER),
    Run(whole=RECOVER_WITH_ROWS),
    Run(whole=CLOSURE_ACCELERATIONS),
)


ACCELERATIONS = Sweep(
    "accelerations", "Rates of the coordinates and accelerations.",
    (
        *_PRESCRIBED_RUNS,
        Run(hook="links_forward", when="linked"),
        Run(whole=FORWARD, when="!linked"),
        Run(whole=QR_OWN, when="qr"),
        Run(whole=EFFORTS_POWER, when="balance efforts"),
        Run(whole=EFFORTS),
        Run(whole=LAWS),
        Run(whole=ROTOR_RESIDUAL, when="refined looped"),
        Run(whole=ROTOR_RESIDUAL_OF_TREE, when="refined !looped"),
        Run(whole=STRAIN, when="balance flexible"),
        Run(whole=POSES, when="poses"),
        Run(hook="product_before_loads", when="product"),
        *_LOAD_RUNS,
        Run(hook="product", when="product"),
        Run(hook="links_condense", when="linked"),
        Run(hook="links_recover", when="linked"),
        Run(whole=CONDENSE, when="!linked !qr !looped"),
        Run(whole=QR_CONDENSE, when="qr"),
        Run(whole=RECOVER, when="!linked !looped"),
        *(replace(run, when="looped") for run in _CLOSURE_RUNS),
        Run(whole=DRIVE_POWER, when="balance"),
        Run(whole=COUPLING_MULTIPLIERS, when="couplings"),
        Run(hook="compare_product", when="product"),
    ),
)  # fmt: skip

#: For planar scenes with closed loops, without observation.
ACCELERATIONS_IN_PLANE = planar_sweep(ACCELERATIONS)

INVERSE_DYNAMICS = Sweep(
    "inverse_dynamics", "Efforts required by given accelerations in addition to those of the laws.",
    (
        *_PRESCRIBED_RUNS,
        Run(whole=FORWARD),
        Run(whole=EFFORTS),
        Run(whole=LAWS),
        Run(whole=STRAIN, when="balance flexible"),
        Run(whole=POSES, when="poses"),
        *_LOAD_RUNS,
        Run(hook="evaluate_couplings", when="couplings residual"),
        Run(whole=COUPLING_LOADS, when="couplings residual"),
        Run(whole=CLOSURE_LOADS, when="looped residual"),
        Run(whole=REQUIRED_EFFORTS),
    ),
)  # fmt: skip

CORRECTION = Sweep(
    "correction",
    "Smallest change, weighted by inertia, that removes position gaps or velocity errors of closed"
    " loops, and the contribution of an impact.",
    (
        Run(whole=PRESCRIBED_ACCELERATIONS),
        Run(hook="drive_values", when="driven"),
        Run(whole=DRIVES, when="driven"),
        Run(whole=FORWARD),
        Run(whole=POSES),
        Run(whole=CLEAR_LOADS),
        Run(hook="apply_impact"),
        Run(whole=CONDENSE, when="!looped"),
        Run(whole=RECOVER, when="!looped"),
        *(replace(run, when="looped") for run in _CLOSURE_RUNS),
    ),
)

MOTION = Sweep(
    "motion", "Poses and velocities of all bodies.",
    (*_PRESCRIBED_RUNS, Run(whole=FORWARD), Run(whole=POSES)),
)  # fmt: skip
POSES_ONLY = Sweep("poses_only", "Poses only, after a sweep.", (Run(whole=POSES),))

FACTORISATION = Sweep(
    "factorisation",
    "The mass matrix of the tree factored, at rest and without loads.",
    (Run(whole=PRESCRIBED_ACCELERATIONS), Run(whole=FORWARD), Run(whole=FACTORISE)),
)
SOLUTION = Sweep(
    "solution",
    "One right-hand side: accelerations due to given efforts only.",
    (Run(whole=COLUMN), Run(whole=COLUMN_BACKWARD), Run(whole=COLUMN_FORWARD)),
)

SWEEPS = (
    PRESCRIBED_VALUES, ACCELERATIONS, ACCELERATIONS_IN_PLANE, INVERSE_DYNAMICS, CORRECTION,
    MOTION, POSES_ONLY, FACTORISATION, SOLUTION, DIRECTIONAL, APPLIED_SLOPE, TANGENT, CONTRIBUTIONS,
    TANGENT_SOLUTION, TANGENT_WITH_INCREMENTS, APPROXIMATE_TANGENT, APPROXIMATE_SOLUTION,
    COMPOSITION,
)  # fmt: skip

#: Passes that the looped engine's C runs for single subjects: links and bodies between runs of
#: links, observations, paths to the root.
SINGLY: tuple[Pass, ...] = (
    FORWARD, CONDENSE, RECOVER, HINGE_MOTION, SECTION_MOTION, MOMENTUM, COORDINATE_INCREMENT,
    RATES_CHANGE, OUTBOARD_LOAD, HINGE_EFFORTS, LINK_TURN, LINK_FORWARD, LINK_CONDENSE,
    LINK_RECOVER,
)  # fmt: skip
