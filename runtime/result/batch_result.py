"""Results of a batch: quantities of single runs with the run as first axis."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.argument_validation import require_path
from mstmm.array_validation import Array, integer
from mstmm.errors import SceneError
from mstmm.optional_packages import missing_package_error
from mstmm.risk import RUN, AssessedResult, Risk

from ..integrate.c_loop import Statistics, Status
from ..run.batch_run import BatchData
from ..run.trajectory import Trajectory
from .export import xarray_dataset
from .export.xarray_dataset import save_dataset
from .plotting.default_quantities import Candidate, default_candidates
from .plotting.panels import Panel, PlotSelection, Trace, build_panels
from .quantity_names import Quantity, column_labels
from .result_record import Record

if TYPE_CHECKING:
    from .certificate import Certificate

#: Format name in saved files.
BATCH_FORMAT = "mstmm batch"
#: Quantities that batches do not integrate.
_ABSENT_QUANTITIES = ("work",)
#: Largest number of runs drawn as lines, and percentiles of the band that replaces more.
_MAX_LINES, _BAND_PERCENTILES = 12, (5.0, 95.0)


class BatchRun(Record):
    """Single run of a batch at the output times that it reached."""

    @property
    def certificate(self) -> Certificate:
        """Raise SceneError: runs of a batch have no certificate."""
        raise SceneError("runs of a batch have no certificate; simulate this run alone")

    def default_quantities(self) -> list[Candidate]:
        """Default quantities of a plot."""
        return default_candidates(self)


class BatchResult(AssessedResult, BatchData):
    """Results of n runs, with all quantities of single runs except the work.

    Values are nan at times that a run did not reach. The runs are not checked, so a batch is never
    trusted: simulate single runs for a verdict.
    """

    @property
    def findings(self) -> Iterator[Risk]:  # type: ignore[override]
        """Findings: failed runs, and that runs of a batch are not checked."""
        for k in np.flatnonzero(~np.asarray(self.success)).tolist():
            yield Risk(
                "run-failed", f"run {k}", f"run {k} failed: {self.messages[k]}",
                "simulate this run alone", value=k,
            )  # fmt: skip
        yield Risk(
            "unexamined", RUN, "runs of a batch are not checked: their drifts and errors are "
            "unknown", "simulate single runs with certify=True",
        )  # fmt: skip

    def result(self, k: int) -> BatchRun:
        """Run k with its own model, as a result with names and quantities but no certificate.

        Raises SceneError for an invalid index, and for models with one-way bodies.
        """
        count = len(self.q)
        expected = f"the index of a run, 0 to {count - 1}"
        k = integer("run", k, -count, expected)
        if k >= count:
            raise SceneError(f"run = {k}: expected {expected}")
        k %= count
        model, reached = self.models.model_of_run(k), self._finite_samples(k)
        expanded = model.packed_scene.expanded
        rigid = None if expanded is None else expanded.rigidified
        if rigid is not None and rigid.one_way:
            raise SceneError(
                'bodies of flexibility "one-way" respond in single runs only: simulate this run '
                'alone, or use flexibility = "coupled"'
            )
        count, no_work = int(reached.sum()), np.full(int(reached.sum()), np.nan)
        statistics: dict[str, Any] = dict.fromkeys(Statistics.__dataclass_fields__, 0)
        statistics["evaluations"] = int(self.evaluations[k])
        status = Status.FINISHED if self.success[k] else Status.RHS_FAILED
        trajectory = Trajectory(
            self.t[reached],
            self.q[k, reached],
            self.u[k, reached],
            self.memory[k, reached],
            no_work,
            np.zeros(count, dtype=np.int64),
            status,
            self.messages[k],
            self.settings,
            Statistics(**statistics),
        )
        return BatchRun(model, trajectory)

    def quantity_names(self) -> tuple[str, ...]:
        """Names accepted by `quantity` and `plot`."""
        return tuple(
            name for name in self.result(0).quantity_names() if name not in _ABSENT_QUANTITIES
        )

    def quantity(self, name: str) -> Quantity:
        """Values (n, m) or (n, m, k) with unit; SceneError with the nearest name if unknown."""
        return self._quantities([name])[0]

    def to_xarray(self) -> Any:
        """`xarray.Dataset` as of a single run, with the dimension run before time (extra: io).

        Data that do not depend on time, such as shape functions of beams, are those of the first
        run.
        """
        try:
            import xarray
        except ImportError as error:
            raise missing_package_error("io", "an xarray Dataset", error) from None
        first = self.result(0)
        variables, labels = xarray_dataset.dataset_variables(first)
        labels["time"] = (labels["time"][0], self.t, labels["time"][2])
        stacked: dict[str, Any] = {}
        for k in range(len(self.q)):
            run_variables, reached = (
                xarray_dataset.dataset_variables(self.result(k))[0] if k else variables,
                self._finite_samples(k),
            )
            for name, (dims, values, attributes) in run_variables.items():
                if name in _ABSENT_QUANTITIES or dims[:1] != ("time",):
                    continue
                if name not in stacked:
                    shape = (len(self.q), len(self.t), *np.shape(values)[1:])
                    stacked[name] = (("run", *dims), np.full(shape, np.nan), attributes)
                stacked[name][1][k, reached] = values
        constant_variables = {
            name: variable for name, variable in variables.items() if variable[0][:1] != ("time",)
        }
        run_variables_and_scene = {
            "success": (("run",), self.success.astype(int), {"long_name": "1 for a success"}),
            "message": (("run",), np.array(self.messages, dtype=object), {"long_name": "its end"}),
            "scene": ((), first.model.scene.to_toml(), {"long_name": "scene as TOML"}),
        }
        attributes = {"format": BATCH_FORMAT, "engine": self.engine, "method": self.settings.method,
                 "tolerances": json.dumps([self.settings.rtol, self.settings.atol])}  # fmt: skip
        return xarray.Dataset(
            constant_variables | stacked | run_variables_and_scene, labels, attributes
        )

    def save(self, path: str | Path) -> Path:
        """Write ".nc" (NetCDF, extra: io); returns the path."""
        path = require_path("batch", path)
        if path.suffix.lower() != ".nc":
            raise SceneError(f'batch "{path}": expected a name that ends in .nc')
        return save_dataset(self.to_xarray, path)

    def plot(
        self,
        *names: str,
        path: str | Path | None = None,
        title: str | None = None,
        ax: Any = None,
        band: bool | None = None,
    ) -> Any:
        """`matplotlib` figure of quantities over time, as `Result.plot` (extra: plot).

        A line for each run, or, for more than twelve, the median and a band from 5 to 95 %; `band`
        overrides this choice.
        """
        from .plotting.figure import compose_panels, draw_runs

        selection, run_indices = (
            PlotSelection(names),
            [k for k in range(len(self.q)) if self._finite_samples(k).any()],
        )
        _reject_absent(names)
        if not run_indices:
            raise SceneError("nothing to plot: no run has a state; see messages")
        if band if band is not None else len(self.q) > _MAX_LINES:
            figure = compose_panels(self._bands(selection, run_indices), title, ax)
        else:
            figure = draw_runs(
                {f"run {k}": self.result(k) for k in run_indices}, selection, title, ax
            )
        if path is not None:
            figure.write(Path(path))
        return figure.figure

    def _bands(self, selection: PlotSelection, there: Sequence[int]) -> list[Panel]:
        longest = max(there, key=lambda k: self._finite_samples(k).sum())
        panel_list = build_panels({"run": self.result(longest)}, selection)
        quantities = iter(self._quantities([name for panel in panel_list for name in panel.names]))
        band_label = (
            f"median and {_BAND_PERCENTILES[0]:g} to {_BAND_PERCENTILES[1]:g} % of "
            f"{len(self.q)} runs"
        )
        return [
            replace(
                panel, more="; ".join(filter(None, (band_label, panel.more))),
                traces=tuple(_band_traces(self.t, [next(quantities) for _ in panel.names])),
            )
            for panel in panel_list
        ]  # fmt: skip

    def _finite_samples(self, k: int) -> Any:
        """Mask (m,) of the output times at which run k has a finite state."""
        return np.isfinite(self.q[k]).all(axis=1) & np.isfinite(self.u[k]).all(axis=1)

    def _quantities(self, names: Sequence[str]) -> list[Quantity]:
        """Quantities of all runs, read run by run to limit memory."""
        _reject_absent(names)
        if not len(self.q):
            raise SceneError("a batch of no runs has no quantities")
        templates: list[Quantity] = []
        values: list[Array] = []
        for k in range(len(self.q)):
            run, reached = self.result(k), self._finite_samples(k)
            quantities = [run.quantity(name) for name in names]
            if not k:
                templates = quantities
                shapes = [
                    (len(self.q), len(self.t), *quantity.values.shape[1:])
                    for quantity in quantities
                ]
                values = [np.full(shape, np.nan) for shape in shapes]
            for array, quantity in zip(values, quantities, strict=True):
                array[k, reached] = quantity.values
        return [
            replace(template, values=array, rates=None)
            for template, array in zip(templates, values, strict=True)
        ]


def _reject_absent(names: Sequence[str]) -> None:
    for name in names:
        if name in _ABSENT_QUANTITIES:
            raise SceneError(f'"{name}": not integrated in batches; simulate single runs')


def _band_traces(t: Array, quantities: Sequence[Quantity]) -> Iterator[Trace]:
    """Median of every column with a band of its quantiles over the runs."""
    colour = 0
    for quantity in quantities:
        values = quantity.values.reshape(*quantity.values.shape[:2], -1)
        low, median, high = _quantiles(values)
        for k, label in enumerate(column_labels(quantity)):
            yield Trace(label, t, median[:, k], colour, 0, low[:, k], high[:, k])
            colour += 1


def _quantiles(values: Array) -> Array:
    """Quantiles (3, m, k) over the runs; nan at times that no run has reached."""
    result = np.full((3, *values.shape[1:]), np.nan)
    is_finite = np.isfinite(values).any(axis=(0, 2))
    result[:, is_finite] = np.nanpercentile(
        values[:, is_finite], [_BAND_PERCENTILES[0], 50.0, _BAND_PERCENTILES[1]], axis=0
    )
    return result
