"""Result of a run: quantities, certificate, export, plots and views."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from mstmm.argument_validation import require_path
from mstmm.display import NotebookDisplay, PublicMembers, table

from .certificate import Certificate
from .result_record import Record

if TYPE_CHECKING:
    from .plotting.default_quantities import Candidate, PlotSource
    from .scene3d.view import SceneView


class Result(PublicMembers, Record, NotebookDisplay):
    """Result of a run: states and derived quantities at the sample times.

    Arrays have the time as their first axis, SI units, radians; vectors are in inertial axes.
    Quantities other than q and u are computed in one batch on first use and cached (their arrays
    are read-only). Samples that cannot be evaluated are nan and listed in `warnings`.

    Attributes:
        model: the model of the run.
        t: (n,) s. Equal neighbours are the states just before and just after an event.
        q: (n, nq) hinge coordinates, hinges in the scene's order; m, rad, unit quaternions.
        u: (n, nu) hinge speeds; m/s, rad/s, of ball and free hinges in outboard axes.
        event: (n,) 0; -(i + 1) just before and i + 1 just after event i.
        status: why it ended; None if it was interrupted.
        statistics: counts of the integrator; None for runs of other integrators.
        settings: settings of the run.
        meshes: contents of the mesh files of shapes by their paths, of a loaded result.
        checkpoint: the file that stores the run until its result is saved; None without one.
    """

    member_groups: ClassVar[Mapping[str, str]] = {
        "Run": "model settings success status message statistics method_history "
        "achieved_error last_state checkpoint",
        "Samples": "t q u udot event coordinates speeds coordinate_info",
        "Motion": "position velocity acceleration orientation angular_velocity "
        "angular_acceleration center_of_mass",
        "Loads": "force moment effort",
        "Energy and momentum": "energy energy_components work power momentum angular_momentum "
        "body_momentum body_angular_momentum",
        "Flexible bodies": "deflection slope curvature deflected_shape bending_moment axial_force "
        "section_force section_moment strain_energy modal_energy "
        "equivalent_velocity equivalent_angular_velocity",
        "Quantities by name": "quantity quantity_names default_quantities "
        "picture_names outputs table",
        "Verdict": "trusted certificate risks warnings",
        "Output": "plot view report save to_xarray meshes",
    }

    @property
    def trusted(self) -> bool:
        """True if the quality of the result was checked and no check objects.

        A success whose balances and estimated error (certify=True) are within bounds and whose
        models stayed within their range. `certificate.verdict(accuracy, balance)` accepts other
        bounds and gives the reasons.
        """
        return self.certificate.trusted

    @cached_property
    def certificate(self) -> Certificate:
        """Quality report of a run: balances, conditioning, estimated error.  Printable."""
        from .checks.run_checks import build_certificate

        return build_certificate(self, self._error)

    def picture_names(self) -> tuple[str, ...]:
        """Names of the shape panels that `plot` accepts.

        "shape" (all flexible bodies), "blade.shape", "blade.deflection" (along the beam),
        "blade.modal_energy".
        """
        from .flexible.shape_panels import panel_names

        return tuple(panel_names(self))

    def default_quantities(self) -> list[Candidate]:
        """Default quantities of `plot` and `table`."""
        from .plotting.default_quantities import default_candidates

        return default_candidates(self)

    # --- export ---------------------------------------------------------------------------------

    def to_xarray(self) -> Any:
        """`xarray.Dataset` of every quantity with dimensions, units and provenance (extra: io)."""
        from .export.xarray_dataset import to_dataset

        return to_dataset(self)

    def save(self, path: str | Path) -> Path:
        """Write ".nc" (NetCDF, extra: io), ".csv" or ".mat" (MATLAB); returns the path.

        ".csv" has a column and ".mat" a variable for every scalar. The file appears under its name
        when it is complete; then the checkpoint of a run that has ended is removed.
        EnvironmentFailure if the extra is missing or the file cannot be written.
        """
        from .export.xarray_dataset import save_result

        saved = save_result(self, require_path("result file", path))
        if self.checkpoint is not None and self.status is not None:
            self.checkpoint.remove()
        return saved

    def table(self, *names: str, rows: int = 12) -> str:
        """Text table of some samples; by default of every hinge coordinate and the energy."""
        from .export.column_files import text_table

        return text_table(self, names, rows)

    def plot(
        self,
        *names: str,
        path: str | Path | None = None,
        title: str | None = None,
        ax: Any = None,
        against: str | None = None,
        kind: str = "time",
        beside: Mapping[str, PlotSource] | None = None,
        label: str = "this run",
    ) -> Any:
        """`matplotlib` figure of quantities by name, one panel per unit (extra: plot).

        Names of `picture_names` draw flexible bodies. Without names: the shapes of flexible bodies,
        and of the outputs of the scene, or else of coordinates, Euler angles and deflections, those
        that move most; the legend notes what was left out. With `path`, also written there (.png,
        .svg, .pdf).

        Args:
            ax: axes of an existing figure to draw into, or a list with one for each panel.
            against: a quantity on the x axis, instead of the time.
            kind: "time"; "phase", the rate of each quantity over itself; "spectrum", amplitudes
                over the frequency in Hz (Hann's window, mean subtracted).
            beside: other runs by their labels, drawn into the same panels; `label` is that of this
                one. They may be files of columns, or of other scenes.

        Raises SceneError for unknown names, kinds and files, and for quantities without a phase or
        spectrum.
        """
        from .plotting.figure import plot_of

        return plot_of(
            self, names, path=path, title=title, ax=ax, against=against, kind=kind, beside=beside,
            label=label,
        )  # fmt: skip

    def view(
        self,
        path: str | Path | None = None,
        *,
        trails: Sequence[str] = (),
        speed: float | None = None,
        title: str | None = None,
    ) -> SceneView:
        """Three-dimensional view of the run; with `path` also written there, see `SceneView.save`.

        Bodies are drawn by their ends, mass centres and inertia, or by the shapes given in the
        scene; deflections of beams are not scaled. `trails` are ends whose paths are drawn; `speed`
        is the number of seconds of the run per second of film, by default 1, or, for runs below 1.5
        s or above 20 s, chosen for a film of some seconds. SceneError for an unknown end and for a
        run without samples.
        """
        from .scene3d.view import make_view

        if title is None:
            title = Path(path).stem if isinstance(path, str | Path) else "A run"
        scene_view = make_view(self, title, trails, speed)
        if path is not None:
            scene_view.save(path)
        return scene_view

    def report(
        self,
        path: str | Path,
        *,
        title: str | None = None,
        quantities: Sequence[str] = (),
        trails: Sequence[str] = (),
    ) -> Path:
        """Write a self-contained report; see `mstmm.write_report`, which this calls."""
        # by name: the equations come from derive, which this package must not import
        report = import_module("mstmm").write_report
        report_path: Path = report(self, path, title=title, quantities=quantities, trails=trails)
        return report_path

    def _repr_html_(self) -> str:
        certificate = self.certificate
        samples = f"{len(self.t)}, t = {self.t[0]:g} to {self.t[-1]:g} s" if len(self.t) else "none"
        rows = [("samples", samples), ("method", self.settings.method), *certificate.as_pairs()]
        return table(rows)

    def __repr__(self) -> str:
        return f"<Result: {self.trajectory.message}; {len(self.t)} samples>"
