"""Results of a batch: quantities of single runs with the run as first axis."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.arguments import path_of
from mstmm.arrays import Array, whole
from mstmm.errors import SceneError
from mstmm.extras import missing
from mstmm.risk import RUN, Assessed, Risk

from ..integrate.loop import Statistics, Status
from ..run.batch.batch import BatchResult
from ..run.trajectory import Trajectory
from .names import Quantity, columns
from .output import dataset
from .output.storage import save_dataset
from .plotting.choice import candidates
from .plotting.panels import Panel, Trace, Wanted, panels
from .plotting.shown import Candidate
from .record import Record

if TYPE_CHECKING:
    from .certificate import Certificate

#: Format name in saved files.
BATCH = "mstmm batch"
#: Quantities that batches do not integrate.
_NOT_THERE = ("work",)
#: Runs up to which each is a line; and the edges of the band that stands for more.
_LINES, _BAND = 12, (5.0, 95.0)


class BatchRun(Record):
    """Single run of a batch at the output times that it reached."""

    @property
    def certificate(self) -> Certificate:
        """Raise SceneError: runs of a batch have no certificate."""
        raise SceneError("runs of a batch have no certificate; simulate this one alone")

    def candidates(self) -> list[Candidate]:
        """Default quantities of a plot."""
        return candidates(self)


class Batch(Assessed, BatchResult):
    """Results of n runs, with all quantities of single runs except the work.

    Values are nan at times that a run did not reach.  Its runs are not examined, so that a batch is
    never trusted: simulate single runs for a verdict.
    """

    @property
    def findings(self) -> Iterator[Risk]:  # type: ignore[override]
        """Findings: failed runs, and that runs of a batch are not checked."""
        for k in np.flatnonzero(~np.asarray(self.success)).tolist():
            yield Risk(
                "run-failed", f"run {k}", f"run {k} failed: {self.messages[k]}",
                "simulate it alone", figure=k,
            )  # fmt: skip
        yield Risk(
            "unexamined", RUN, "runs of a batch are not examined: their balances and errors are "
            "unknown", "simulate single runs with certify=True",
        )  # fmt: skip

    def run(self, k: int) -> BatchRun:
        """Run k with its own model, as a result that has names and quantities but no certificate.

        Raises SceneError for a number that is none, and for models with one-way bodies.
        """
        count = len(self.q)
        expected = f"the number of one of {count} runs, from 0 on"
        k = whole("run", k, -count, expected)
        if k >= count:
            raise SceneError(f"run = {k}: expected {expected}")
        k %= count
        model, there = self.models.of(k), self._reached(k)
        expanded = model.packed.expanded
        rigid = None if expanded is None else expanded.rigidified
        if rigid is not None and rigid.one_way:
            raise SceneError(
                'bodies of flexibility "one-way" respond to single runs: simulate this one alone, '
                'or use flexibility = "coupled"'
            )
        count, nothing = int(there.sum()), np.full(int(there.sum()), np.nan)
        known: dict[str, Any] = dict.fromkeys(Statistics.__dataclass_fields__, 0)
        known["evaluations"] = int(self.evaluations[k])
        status = Status.FINISHED if self.success[k] else Status.RHS_FAILED
        found = Trajectory(
            self.t[there], self.q[k, there], self.u[k, there], self.memory[k, there], nothing,
            np.zeros(count, dtype=np.int64), status, self.messages[k], self.settings,
            Statistics(**known),
        )  # fmt: skip
        return BatchRun(model, found)

    def names(self) -> tuple[str, ...]:
        """Names accepted by `quantity` and `plot`."""
        return tuple(name for name in self.run(0).names() if name not in _NOT_THERE)

    def quantity(self, name: str) -> Quantity:
        """Values (n, m) or (n, m, k) with their unit; SceneError with the nearest name if there is
        no such quantity."""
        return self._quantities([name])[0]

    def to_xarray(self) -> Any:
        """`xarray.Dataset` as of a single run with the dimension run before the time (extra: io).

        What does not go by time, such as shapes of beams, is that of the first run.
        """
        try:
            import xarray
        except ImportError as error:
            raise missing("io", "an xarray Dataset", error) from None
        first = self.run(0)
        variables, labels = dataset.variables(first)
        labels["time"] = (labels["time"][0], self.t, labels["time"][2])
        made: dict[str, Any] = {}
        for k in range(len(self.q)):
            some, there = dataset.variables(self.run(k))[0] if k else variables, self._reached(k)
            for name, (dims, values, about) in some.items():
                if name in _NOT_THERE or dims[:1] != ("time",):
                    continue
                if name not in made:
                    shape = (len(self.q), len(self.t), *np.shape(values)[1:])
                    made[name] = (("run", *dims), np.full(shape, np.nan), about)
                made[name][1][k, there] = values
        fixed = {name: one for name, one in variables.items() if one[0][:1] != ("time",)}
        told = {
            "success": (("run",), self.success.astype(int), {"long_name": "1 for a success"}),
            "message": (("run",), np.array(self.messages, dtype=object), {"long_name": "its end"}),
            "scene": ((), first.model.scene.to_toml(), {"long_name": "scene as TOML"}),
        }
        about = {"format": BATCH, "engine": self.engine, "method": self.settings.method,
                 "tolerances": json.dumps([self.settings.rtol, self.settings.atol])}  # fmt: skip
        return xarray.Dataset(fixed | made | told, labels, about)

    def save(self, path: str | Path) -> Path:
        """Write ".nc" (NetCDF, extra: io); returns the path."""
        path = path_of("batch", path)
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
        """`matplotlib` figure of quantities over time, as `Result.plot` (extra: plot): a line for
        each run, or, for more than twelve or as `band` says, the median and a band from 5 to 95 %.
        """
        from .plotting.figure import compose, drawn

        wanted, there = Wanted(names), [k for k in range(len(self.q)) if self._reached(k).any()]
        _refuse_absent(names)
        if not there:
            raise SceneError("there is nothing to plot: no run has a state; see messages")
        if band if band is not None else len(self.q) > _LINES:
            made = compose(self._bands(wanted, there), title, ax)
        else:
            made = drawn({f"run {k}": self.run(k) for k in there}, wanted, title, ax)
        if path is not None:
            made.write(Path(path))
        return made.figure

    def _bands(self, wanted: Wanted, there: Sequence[int]) -> list[Panel]:
        longest = max(there, key=lambda k: self._reached(k).sum())
        found = panels({"run": self.run(longest)}, wanted)
        quantities = iter(self._quantities([name for panel in found for name in panel.names]))
        told = f"median and {_BAND[0]:g} to {_BAND[1]:g} % of {len(self.q)} runs"
        return [
            replace(
                panel, more="; ".join(filter(None, (told, panel.more))),
                traces=tuple(_bands(self.t, [next(quantities) for _ in panel.names])),
            )
            for panel in found
        ]  # fmt: skip

    def _reached(self, k: int) -> Any:
        """Mask (m,) of the output times at which run k has a finite state."""
        return np.isfinite(self.q[k]).all(axis=1) & np.isfinite(self.u[k]).all(axis=1)

    def _quantities(self, names: Sequence[str]) -> list[Quantity]:
        """Of all runs, run by run, so that no more than one is kept beside the values."""
        _refuse_absent(names)
        if not len(self.q):
            raise SceneError("a batch of no runs has no quantities")
        abouts: list[Quantity] = []
        values: list[Array] = []
        for k in range(len(self.q)):
            run, there = self.run(k), self._reached(k)
            some = [run.quantity(name) for name in names]
            if not k:
                abouts = some
                shapes = [(len(self.q), len(self.t), *one.values.shape[1:]) for one in some]
                values = [np.full(shape, np.nan) for shape in shapes]
            for array, one in zip(values, some, strict=True):
                array[k, there] = one.values
        return [
            replace(about, values=array, rates=None)
            for about, array in zip(abouts, values, strict=True)
        ]


def _refuse_absent(names: Sequence[str]) -> None:
    for name in names:
        if name in _NOT_THERE:
            raise SceneError(f'"{name}": batches do not integrate it; simulate one alone')


def _bands(t: Array, quantities: Sequence[Quantity]) -> Iterator[Trace]:
    """Median of every column with a band of its quantiles over the runs."""
    colour = 0
    for quantity in quantities:
        values = quantity.values.reshape(*quantity.values.shape[:2], -1)
        low, middle, high = _quantiles(values)
        for k, label in enumerate(columns(quantity)):
            yield Trace(label, t, middle[:, k], colour, 0, low[:, k], high[:, k])
            colour += 1


def _quantiles(values: Array) -> Array:
    """(3, m, k) over the runs; nan at times that none has reached."""
    found = np.full((3, *values.shape[1:]), np.nan)
    known = np.isfinite(values).any(axis=(0, 2))
    found[:, known] = np.nanpercentile(values[:, known], [_BAND[0], 50.0, _BAND[1]], axis=0)
    return found
