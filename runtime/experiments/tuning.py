"""Tuned constants of the experiments.

Brackets name the folder of benchmarks/ whose scenes set a constant.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ErrorControlTuning:
    """Constants of the search for a target error."""

    rounding_rtol: float = 5e-12
    """Tolerance below which differences may be rounding, so that two runs show no decrease of
    errors (error_control)."""
    sum_per_rtol: float = 15.0
    """Sum of local errors relative to the tolerance where it is not known (error_control)."""
    power_share: float = 0.9
    """Share of an observed power that is used (error_control)."""
    power_noise: float = 0.5
    """Observed power of explicit runs, which scatters, above which the typical one is used
    (error_control)."""
    two_run_factor: float = 2.0
    """Factor on the distance of only two runs, which may be near each other by chance
    (error_control)."""
    power_between_methods: float = 0.5
    """Power between runs by different methods; the exponential one shows nothing about others
    (error_control)."""
    min_power: float = 0.25
    """Power of errors that hardly decrease (error_control)."""
    target_share: float = 0.5
    """Share of the target error at which a next explicit tolerance aims after a comparison: a
    further run costs more than tighter steps of high order (error_control)."""
    target_share_others: float = 0.6
    """The same for other methods (error_control)."""
    max_first_ratio: float = 0.3
    """Largest ratio of the second tolerance to the first (error_control)."""
    max_later_ratio: float = 0.1
    """Largest ratio of a later tolerance to the one before (error_control)."""
    min_explicit_share: float = 1e-4
    """Smallest ratio of the first explicit tolerance after other kinds to the typical first one
    (error_control)."""
    max_diverged_ratio: float = 0.1
    """Largest ratio of a next tolerance to the one before, where runs have diverged
    (error_control)."""
    min_diverged_ratio: float = 0.01
    """Smallest ratio of a next tolerance to the one before, where runs have diverged
    (error_control)."""
    growth_per_radian: float = 0.25
    """Error relative to the sum of local errors, per radian of vibration that implicit steps
    resolve: its phase error persists (error_control)."""
    late_divergence: float = 0.8
    """Share of the time after which a divergence of runs shows the growth of errors
    (error_control)."""
    growth_safety: float = 10.0
    """Factor on the estimate by that growth (error_control)."""
    rtol_per_radian: float = 10.0
    """First implicit tolerance relative to the target error, times the radians of vibration to
    resolve (error_control)."""
    min_calm_ratio: float = 0.1
    """Smallest ratio of a next tolerance to the one before for calm runs whose tolerance is near
    the target error, so that errors may not decrease (error_control)."""
    near_target: float = 100.0
    """Ratio to the target error up to which a tolerance is near it (error_control)."""
    min_calm_ratio_far: float = 3e-3
    """The same for tolerances further above the target error (error_control)."""
    slow_decay_rtol: float = 1e-7
    """Tolerance above which errors may be constant for a while: of implicit methods while they do
    not resolve vibrations, of long explicit steps by chance (error_control)."""
    max_runs: int = 8
    """Largest number of runs (error_control)."""
    max_coordinates: int = 64
    """Largest number of coordinates and speeds for which all motions are computed
    (error_control)."""
    slow_radians: float = 10.0
    """Motions with fewer radians over a run are slow, and part of the wanted motion
    (error_control)."""
    far_above: float = 100.0
    """Ratio to the target error from which amplitudes are far above it (error_control)."""
    weight_power: float = 0.7
    """Power of the weight of smaller amplitudes (error_control)."""
    fast_share: float = 0.5
    """Share of the largest rate from which motions count as the fastest (error_control)."""
    unresolved_step: float = 2.0
    """Radians per step from which explicit steps do not resolve a motion (error_control)."""
    max_beam_speeds: int = 6
    """Largest number of speeds of a vibrating beam on one hinge (error_control)."""
    max_rigid_speeds: int = 1
    """Largest number of its speeds that do not belong to shapes (error_control)."""
    excitation_share: float = 1e-3
    """Acceleration of a shape, relative to the largest one, that counts as excitation
    (error_control)."""
    loose_error: float = 1e-3
    """Target error to which the following |lambda| T refer (error_control)."""
    stiff_unknown: float = 700.0
    """|lambda| T from which the first run is implicit, without knowledge of the motions at the
    start (error_control)."""
    stiff_unknown_power: float = 0.25
    """Power of its growth for smaller errors (error_control)."""
    stiff_known: float = 450.0
    """The same with that knowledge (error_control)."""
    stiff_known_power: float = 0.09
    """Power of its growth for smaller errors (error_control)."""
    radian_weight: float = 4.5
    """Factor on the radians of relevant vibration, which add to it: they grow with the order of
    implicit steps (error_control)."""
    radian_weight_power: float = 0.06
    """Power of its growth for smaller errors (error_control)."""
    well_above: float = 3.0
    """Ratio to the target error from which vibration is well above it (error_control)."""
    low_order_rtol: float = 1e-4
    """Tolerance down to which the explicit method of lower order costs less (error_control)."""
    low_order_limited_rtol: float = 1e-6
    """The same if stability limits the steps, because that method then damps its errors: for damped
    motions, or amplitudes far above the target error (error_control)."""
    damping_ratio: float = 0.03
    """Damping ratio above which motions count as damped (error_control)."""
    exponential_min_error: float = 1e-6
    """Smallest target error for the exponential method (error_control)."""
    exponential_steps: int = 15
    """Steps after which its first run is stopped (error_control)."""
    exponential_steps_per_radian: float = 1 / 20
    """Further such steps per |lambda| T (error_control)."""
    exponential_max_radians: float = 4.0
    """Largest |lambda| T for it, relative to that for implicit methods (error_control)."""
    exponential_radians: float = 250.0
    """Smallest |lambda| T per speed for it (error_control)."""
    exponential_power: float = 0.16
    """Power of its growth for smaller errors (error_control)."""
    resolved_weight: float = 2.0
    """Weight of radians that explicit steps have to resolve more finely (error_control)."""
    limited_share: float = 0.1
    """Share of stability-limited steps from which a run counts as limited by stability
    (error_control)."""
    stiff_steps: int = 500
    """Smallest number of steps of an explicit run that may exceed that of an implicit one
    (error_control)."""
    pilot_steps: int = 3000
    """Steps after which a first explicit run is stopped, if the method is free, and repeated by
    `auto`, which switches methods in stiff scenes (error_control)."""
    stable_step: float = 4.0
    """h |lambda| of explicit steps at the stability limit (error_control)."""
    resolved_step: float = 0.8
    """h |lambda| of explicit steps that resolve a vibration at the following tolerance
    (error_control)."""
    resolved_rtol: float = 1e-7
    """Tolerance of these steps (error_control)."""
    resolved_order: float = 9.0
    """Order of their decrease (error_control)."""
    uncertainty: float = 2.0
    """Factor on the estimated steps of explicit runs, which other kinds predict poorly
    (error_control)."""
    exponential_order: float = 3.0
    """Order of the growth of exponential steps (error_control)."""
    expected_rtol: float = 1 / 20
    """Tolerance relative to the target error at which an explicit method is expected to reach it
    (error_control)."""
    free_shape_factor: float = 8.0
    """Largest increase of the frequency of a shape by the free motion of its body
    (error_control)."""
    default_samples: int = 201
    """Number of samples without given output times (error_control)."""
    compared_samples: int = 101
    """Number of samples added for comparison (error_control)."""
    sufficient_samples: int = 50
    """Number of output times from which none are added (error_control)."""
    growth_length: float = 5e-3
    """Deflections (m) over which the error of flexible bodies is the sum of their local errors
    (error_control)."""
    max_shape_growth: float = 20.0
    """Largest error of flexible bodies relative to that sum (error_control)."""
    damped_share: float = 0.1
    """Reduction of it where steps damp errors (error_control)."""
    growth_of_speeds: float = 0.2
    """Error relative to that sum where steps do not resolve the fastest motions (error_control)."""
    first_step_ratio: float = 0.3
    """First step of a run relative to the smallest step of the one before (error_control)."""


@dataclass(frozen=True)
class ChartTuning:
    """Constants of the work-precision chart, its reference and its time budget."""

    min_shares: float = 6.0
    """A run may take the remaining time over this number (scene_suite)."""
    curves_per_share: float = 5.0
    """It may take the remaining time over the number of waiting curves per this number, which is
    less if more than thirty curves wait (scene_suite)."""
    reference_growth: float = 4.0
    """Largest expected growth of CPU time for a tolerance a hundred times tighter (scene_suite)."""
    level_rtol: float = 1e-8
    """Relative tolerance of the runs with method "auto" that measure the errors of model levels
    (scene_suite)."""
    step_size_rtol: float = 1e-6
    """Relative tolerance of the run whose steps show where the motion is fast (scene_suite)."""
    accurate_level_factor: float = 1e3
    """Model levels with errors below this many times `level_rtol` use the setting of the reference
    (scene_suite)."""
    level_budget: float = 0.45
    """Fraction of the budget after which the errors of the model levels must be known
    (scene_suite)."""
    max_count_factor: int = 4
    """Largest number of times, relative to the equidistant ones (scene_suite)."""
    fast_step_count: int = 4
    """Steps between two equidistant times that indicate fast motion; every run begins with two or
    three short steps, which do not (scene_suite)."""
    growth: float = 2.0
    """Estimated growth of CPU time from one setting to the next after one point (scene_suite)."""
    max_growth: float = 10.0
    """Largest growth of CPU time assumed after two points (scene_suite)."""
    min_growth: float = 1.0
    """Smallest growth of CPU time assumed after two points (scene_suite)."""
    loading_limit: float = 1.0
    """CPU time (s) beyond which the loading of a method is negligible (scene_suite)."""
    level_error_factor: float = 1.1
    """A curve ends once its error is within this factor of the error of its model level
    (scene_suite)."""
    min_runs: float = 50.0
    """Runs that take more than the remaining time over this number are not repeated: their times
    vary little, and they would leave too little time for the others (scene_suite)."""
    round_cpu_s: float = 5e-3
    """CPU time (s) up to which a short run is called repeatedly in each round (scene_suite)."""
    max_calls: int = 5
    """Largest number of these calls (scene_suite)."""


@dataclass(frozen=True)
class ReductionTuning:
    """Constants of the search for the smallest sufficient model."""

    model_error: float = 0.9
    """Largest error of a model as a fraction of the target error; the rest is for the integration,
    and for times between the samples (advice)."""
    one_way_budget: float = 0.3
    """Fraction of the budget for a run with one-way coupling (advice)."""
    min_remainder: float = 0.3
    """The error of a split reference is subtracted from the target error if at least this fraction
    of the target error remains (advice)."""
    total_error: float = 0.95
    """Largest error of model and integration, as a fraction of the target error; the rest is
    reserved for times between the samples (advice)."""
    method_budget: float = 0.3
    """Fraction of the budget for the selection of the method (advice)."""
    max_finalists: int = 3
    """Number of models for which methods are compared: the one found, and others that suffice
    (advice)."""
    time_factor: float = 1.5
    """Largest CPU time of these others, relative to that of the model found (advice)."""
    accurate_time_factor: float = 4.0
    """The same for accurate ones (advice)."""
    accurate_error: float = 0.3
    """Fraction of the target error below which a model is accurate (advice)."""
    rigid_error: float = 0.5
    """Largest error, as a fraction of the target error, for making hinges rigid (advice)."""
    omission_error: float = 0.1
    """Largest error, as a fraction of the target error, for omitting springs (advice)."""
    omission_growth: float = 1.1
    """Growth of the error up to which springs are omitted, too (advice)."""
    max_rise: float = 100.0
    """Largest factor on the errors of a window for deflections that grow after it (advice)."""
    max_change: float = 0.5
    """Beams are halved until the result changes by less than this fraction of the target error
    (advice)."""
    error_reduction: float = 4.0
    """The error of the finer parts is smaller than this change by this factor (advice)."""
    part_counts: tuple[int, ...] = (2, 4, 8, 16)
    """Numbers of parts that are tried (advice)."""
    preparation_error: float = 0.3
    """Largest error, as a fraction of the target error, of the changes that make a beam splittable
    (advice)."""
    recoil: float = 3.0
    """Error of one-way coupling by recoil and phase, in d chi / (1 - chi) (advice)."""
    max_one_way: float = 2.0
    """Its largest value, in d: out of phase, with a recoil as large as the deflection (advice)."""
    integration_error: float = 0.5
    """Target error of the integration as a fraction of the error that the model leaves (advice)."""
    sufficient_error: float = 0.3
    """Fraction of the target error below which tighter settings are not tried (advice)."""
    repeated_settings: int = 8
    """Number of settings whose timing is repeated (advice)."""
    min_whole_run_budget: float = 0.3
    """Smallest fraction of the budget for the tolerance over the whole run (advice)."""
    first_rtol: float = 0.1
    """First tolerance for it, relative to the relative target error (advice)."""
    verification_ratio: float = 1e-2
    """Ratio of the tolerance of its verification (advice)."""
    target_fraction: float = 0.3
    """Error that its next tolerance aims at, as a fraction of the allowed error (advice)."""
    max_whole_run_trials: int = 6
    """Largest number of its tolerances (advice)."""
    search_budget: float = 0.6
    """Fraction of the budget after which the search for smaller models ends (advice)."""
    planar_error: float = 0.01
    """Largest error of a planar scene, as a fraction of the target error: its motion must be the
    same (advice)."""
    max_change_estimate: float = 5.0
    """Changes with an estimated error above this many times the allowed one are not tried
    (advice)."""
    sufficient_estimate: float = 0.5
    """A model is expected to suffice if its estimated error is below this fraction of the allowed
    one (advice)."""
    max_estimate: float = 50.0
    """A model is not tried if its estimated error is above this many times the allowed one
    (advice)."""
    max_one_way_estimate: float = 3.0
    """The same for one-way coupling, which takes more time (advice)."""
    joint_fraction: float = 0.1
    """Bodies get richer models together if their estimates are above this fraction of the largest
    (advice)."""
    rtol_fraction: float = 1e-3
    """Relative tolerance of trial runs as a fraction of the relative target error (advice)."""
    loosest_rtol: float = 1e-6
    """Largest relative tolerance of trial runs (advice)."""
    tightest_rtol: float = 1e-12
    """Tightest relative tolerance (advice)."""
    reference_ratio: float = 1e-2
    """Ratio of the tolerance of the reference to that of trial runs (advice)."""
    max_difference: float = 0.05
    """Largest difference of the two runs of the reference as a fraction of the target error
    (advice)."""
    probe_fraction: float = 1 / 20
    """Fraction of the run that is simulated to estimate its CPU time (advice)."""
    reference_budget: float = 0.35
    """Fraction of the budget for runs of the reference over the whole run (advice)."""
    window_budget: float = 0.1
    """Fraction of the budget for runs of the reference over a window (advice)."""
    model_budget: float = 0.2
    """Fraction of the remaining budget for the run of one model (advice)."""
    short_run: float = 0.03
    """Runs shorter than this (s) are repeated; the smallest time counts (advice)."""
    repeats: int = 3
    """Number of runs of such a setting (advice)."""
    equal_time_ratio: float = 1.15
    """Models count as equally fast up to this ratio of CPU times, because timings scatter
    (advice)."""
    retimed_below: float = 0.5
    """Runs below this time (s) are timed again if a model seems slower (advice)."""
    retimings: int = 5
    """Largest number of these repetitions (advice)."""


ERROR_CONTROL, CHART, REDUCTION = ErrorControlTuning(), ChartTuning(), ReductionTuning()
