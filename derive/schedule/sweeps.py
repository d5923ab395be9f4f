"""Sweeps: sequences of passes for accelerations, efforts and solutions."""

from __future__ import annotations

from dataclasses import replace

from .approximate_tangent import LAWS_ALONE, LAWS_SOLUTION, RATES_CHANGE
from .couplings import COUPLINGS_ANSWERED, COUPLINGS_LOADED
from .flexible import DRAG, MOMENTUM, SECTION_MOTION, STRAIN
from .forward_kinematics import DRIVES, FORWARD, HINGE_MOTION, POSES, PRESCRIBED
from .inverse_dynamics import REQUIRED
from .iterative_refinement import RESTATED, RESTATED_OF_TREE
from .links import LINK_CONDENSE, LINK_FORWARD, LINK_RECOVER, LINK_TURN
from .loads import DRIVE_POWER, EFFORTS, EFFORTS_POWER, FORCES, LAWS, LOADS
from .loop_closure import (
    ANSWERED,
    CARRIED,
    CLOSURES,
    CLOSURES_ANSWERED,
    CLOSURES_LOADED,
    ROW_CLOSED,
    ROW_FOUND,
    UNLOADED,
)
from .mass_matrix import COMPOSITION, EXERTED, FELT_BY
from .mass_matrix_solve import COLUMN, COLUMN_ANSWERED, COLUMN_CARRIED, FACTORISE
from .pass_steps import Pass, Run, Sweep
from .planar_passes import planar_sweep
from .qr_sweep import QR_CONDENSE, QR_OWN
from .riccati_sweep import CONDENSE, RECOVER
from .tangent_sweep import (
    APPLIED_SLOPE,
    BROUGHT,
    DIRECTIONAL,
    LAGGED,
    TANGENT,
    TANGENT_BEYOND,
    TANGENT_SOLUTION,
)

_GIVEN_RUNS = (
    Run(whole=PRESCRIBED),
    Run(hook="drive_values", when="driven"),
    Run(whole=DRIVES, when="driven"),
    Run(hook="expression_values", when="valued"),
)
GIVEN = Sweep(
    "given", "Driven coordinates, and the values of the scene's expressions.", _GIVEN_RUNS
)
_LOAD_RUNS = (
    Run(whole=DRAG, when="posed flexible"),
    Run(whole=LOADS, when="posed"),
    Run(whole=FORCES, when="posed"),
)

#: Closing of rows and computation of multipliers, in place of `condense` and `recover`.
_CLOSURE_RUNS = (
    Run(hook="rows_begun"),
    Run(whole=CLOSURES),
    Run(hook="rows_asked"),
    Run(whole=CARRIED),
    Run(whole=ROW_CLOSED),
    Run(whole=ROW_FOUND),
    Run(whole=ANSWERED),
    Run(whole=CLOSURES_ANSWERED),
)


ACCELERATIONS = Sweep(
    "accelerations", "Rates of the coordinates and accelerations.",
    (
        *_GIVEN_RUNS,
        Run(hook="links_forward", when="linked"),
        Run(whole=FORWARD, when="!linked"),
        Run(whole=QR_OWN, when="qr"),
        Run(whole=EFFORTS_POWER, when="balance efforts"),
        Run(whole=EFFORTS),
        Run(whole=LAWS),
        Run(whole=RESTATED, when="refined looped"),
        Run(whole=RESTATED_OF_TREE, when="refined !looped"),
        Run(whole=STRAIN, when="balance flexible"),
        Run(whole=POSES, when="posed"),
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
        Run(whole=COUPLINGS_ANSWERED, when="couplings"),
        Run(hook="product_compared", when="product"),
    ),
)  # fmt: skip

#: For planar scenes with closed loops, without observation.
ACCELERATIONS_IN_PLANE = planar_sweep(ACCELERATIONS)

INVERSE_DYNAMICS = Sweep(
    "inverse_dynamics", "Efforts required by given accelerations in addition to those of the laws.",
    (
        *_GIVEN_RUNS,
        Run(whole=FORWARD),
        Run(whole=EFFORTS),
        Run(whole=LAWS),
        Run(whole=STRAIN, when="balance flexible"),
        Run(whole=POSES, when="posed"),
        *_LOAD_RUNS,
        Run(hook="couplings_valued", when="couplings residual"),
        Run(whole=COUPLINGS_LOADED, when="couplings residual"),
        Run(whole=CLOSURES_LOADED, when="looped residual"),
        Run(whole=REQUIRED),
    ),
)  # fmt: skip

CORRECTION = Sweep(
    "correction",
    "Smallest change, weighted by inertia, that removes position gaps or velocity errors of closed"
    " loops, and the contribution of an impact.",
    (
        Run(whole=PRESCRIBED),
        Run(hook="drive_values", when="driven"),
        Run(whole=DRIVES, when="driven"),
        Run(whole=FORWARD),
        Run(whole=POSES),
        Run(whole=UNLOADED),
        Run(hook="struck"),
        Run(whole=CONDENSE, when="!looped"),
        Run(whole=RECOVER, when="!looped"),
        *(replace(run, when="looped") for run in _CLOSURE_RUNS),
    ),
)

MOTION = Sweep(
    "motion", "Poses and velocities of all bodies.",
    (*_GIVEN_RUNS, Run(whole=FORWARD), Run(whole=POSES)),
)  # fmt: skip
POSED = Sweep("posed", "Poses only, after a sweep.", (Run(whole=POSES),))

FACTORISATION = Sweep(
    "factorisation",
    "The mass matrix of the tree factored, at rest and without loads.",
    (Run(whole=PRESCRIBED), Run(whole=FORWARD), Run(whole=FACTORISE)),
)
SOLUTION = Sweep(
    "solution",
    "One right-hand side: accelerations due to given efforts only.",
    (Run(whole=COLUMN), Run(whole=COLUMN_CARRIED), Run(whole=COLUMN_ANSWERED)),
)

SWEEPS = (GIVEN, ACCELERATIONS, ACCELERATIONS_IN_PLANE, INVERSE_DYNAMICS, CORRECTION, MOTION,
          POSED, FACTORISATION, SOLUTION, DIRECTIONAL, APPLIED_SLOPE, TANGENT, BROUGHT,
          TANGENT_SOLUTION, TANGENT_BEYOND, LAWS_ALONE, LAWS_SOLUTION, COMPOSITION)  # fmt: skip

#: Passes that the looped engine's C runs for single subjects: links and bodies between runs of
#: links, observations, paths to the root.
SINGLY: tuple[Pass, ...] = (
    FORWARD, CONDENSE, RECOVER, HINGE_MOTION, SECTION_MOTION, MOMENTUM, LAGGED, RATES_CHANGE,
    EXERTED, FELT_BY, LINK_TURN, LINK_FORWARD, LINK_CONDENSE, LINK_RECOVER,
)  # fmt: skip
