"""Chains in discrete-time form two ways: the product of classical matrices, and the Riccati steps.

The steps (absorb, re-base, condense, hinge) work on the linear form that `discrete_bodies` gets by
differences; the product multiplies the generated kernels' matrices, both at 80 digits.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import mpmath
import numpy as np

from mstmm.derive.classical.catalogue import CLASSICAL
from mstmm.derive.lower.kernel_lowering import lower
from mstmm.derive.verification.kernel_evaluation import evaluate
from mstmm.ir import KernelIR
from tests.support.classical.discrete_bodies import (
    DIGITS,
    Array,
    ParticleBody,
    cross,
    kernel_inputs,
    random_matrix,
    stack_columns,
)
from tests.support.classical.random_bodies import random_body

#: Names of the generated bodies by (planar, kind).
BODIES = {
    (True, "rigid"): "body_planar_discrete", (True, "beam"): "beam_planar_discrete",
    (False, "rigid"): "body_spatial_discrete", (False, "beam"): "beam_spatial_discrete",
}  # fmt: skip
MODES = {True: 3, False: 2}
SPRINGS = ("spring", "elastic")


@cache
def kernel(name: str) -> KernelIR:
    """A classical matrix, lowered."""
    return lower(CLASSICAL[name](), "transfer")


def outputs(name: str, inputs: dict[str, list[Any]]) -> dict[str, Array]:
    """Matrices that a classical kernel gives."""
    ir = kernel(name)
    values = evaluate(ir, inputs, digits=DIGITS)
    found = {}
    for port in ir.outputs:
        rows, columns = (int(extent) for extent in port.shape)
        found[port.name] = mpmath.matrix(
            [values[port.name][i * columns : (i + 1) * columns] for i in range(rows)]
        )
    return found


@dataclass
class Link:
    """A hinge and the body behind it."""

    kind: str
    body: ParticleBody
    rigid: bool
    values: dict[str, Array] = field(default_factory=dict)


@dataclass
class Chain:
    """Links from the ground, where the root's section is given, to the free tip."""

    planar: bool
    links: list[Link]
    ground: Array

    @property
    def shifts(self) -> int:
        return 2 if self.planar else 3

    @property
    def size(self) -> int:
        return 3 if self.planar else 6


def random_chain(rng: np.random.Generator, planar: bool, plan: list[tuple[str, str]]) -> Chain:
    """A chain of (hinge, rigid or beam) with random data; the predictor is not closed."""
    links = []
    with mpmath.workdps(DIGITS):
        for kind, what in plan:
            modes = MODES[planar] if what == "beam" else 0
            body = random_body(rng, planar, what, modes, "yz" if not planar and modes else "")
            links.append(Link(kind, body, what == "rigid", _hinge_values(rng, planar, kind)))
        chain = Chain(planar, links, random_matrix(rng, 3 if planar else 6))
        if not planar:
            chain.ground[3:6, 0] = mpmath.zeros(3, 1)
        return chain


def _hinge_values(rng: np.random.Generator, planar: bool, kind: str) -> dict[str, Array]:
    shifts, turns = (2, 1) if planar else (3, 3)
    if kind == "fixed":
        return {"gamma" if planar else "beta": random_matrix(rng, turns)}
    if kind in ("smooth", "ball"):
        return {"tau": random_matrix(rng, turns)}
    if kind == "pin":
        axis = random_matrix(rng, 3)
        axis /= mpmath.norm(axis)
        return {
            "a": axis,
            "beta": random_matrix(rng, 3),
            "tau": random_matrix(rng, 1),
            "m_n": random_matrix(rng, 3),
        }
    values = {
        "k_t": 5 * mpmath.eye(shifts) + random_matrix(rng, shifts, shifts),
        "c_t": random_matrix(rng, shifts, shifts), "C": 3 + random_matrix(rng, 1),
        "d_s": random_matrix(rng, shifts), "q_s": random_matrix(rng, shifts),
    }  # fmt: skip
    if planar:
        names = ("k_3", "c_r", "D_phi", "phi_0", "phi_s", "theta_s")
        return (
            values
            | {name: random_matrix(rng, 1) for name in names}
            | {"k_1": 4 + random_matrix(rng, 1)}
        )
    values |= {"k_r": 5 * mpmath.eye(3) + random_matrix(rng, 3, 3), "c_r": random_matrix(rng, 3, 3)}
    return values | {"m_s": random_matrix(rng, 3)}


# --- sections at the predictor ----------------------------------------------------------------


def _zero(body: ParticleBody) -> Array:
    return mpmath.zeros(body.rigid_count + body.modes, 1)


def predicted_section(chain: Chain, k: int, end: str) -> Array:
    """Position and angle of the section at the end I or O of body k (k = -1: the ground)."""
    if k < 0:
        return chain.ground
    body = chain.links[k].body
    place = body.values["r_p"]
    if end == "O":
        place = place + body.arm(_zero(body))
    if not chain.planar:
        return stack_columns(place, mpmath.zeros(3, 1))
    angle = body.values["theta_p"]
    if body.modes:
        angle = angle + body.slopes(end) * body.values["eta_p"]
    return stack_columns(place, angle)


# --- the product ------------------------------------------------------------------------------


def by_product(chain: Chain) -> list[tuple[Array, Array]]:
    """(z_I, z_O) of every body, from the overall transfer equation."""
    with mpmath.workdps(DIGITS):
        steps, total = [], mpmath.eye(2 * chain.size + 1)
        for k in range(len(chain.links)):
            hinge, body = _matrices(chain, k)
            steps.append((hinge, body))
            total = body * hinge * total
        return _chain_states(chain, steps, total)


def _matrices(chain: Chain, k: int) -> tuple[Array, Array]:
    link = chain.links[k]
    name = BODIES[chain.planar, "rigid" if link.rigid else "beam"]
    own = outputs(name, kernel_inputs(link.body, kernel(name)))
    inboard = "rigid" if k == 0 or chain.links[k - 1].rigid else "beam"
    outboard = "rigid" if link.rigid else "beam"
    plane = "planar" if chain.planar else "spatial"
    name = f"hinge_{link.kind}_{plane}_{inboard}_{outboard}"
    values = hinge_values(chain, k) | {k: v for k, v in own.items() if k in "UW"}
    inputs = {port.name: list(values[port.name]) for port in kernel(name).inputs}
    return outputs(name, inputs)["U_h"], own["U"]


def hinge_values(chain: Chain, k: int) -> dict[str, Array]:
    """Everything that the kernel of hinge k could ask for."""
    link = chain.links[k]
    values = dict(link.values)
    slopes = "Theta" if chain.planar else "S"
    if link.body.modes:
        values[f"{slopes}_O"] = link.body.slopes("I")
        values["eta_pO"] = link.body.values["eta_p"]
        values["S_N"] = link.body.slopes("O")
    if k > 0 and chain.links[k - 1].body.modes:
        values[f"{slopes}_I"] = chain.links[k - 1].body.slopes("O")
        values["eta_pI"] = chain.links[k - 1].body.values["eta_p"]
    turns = chain.size - chain.shifts
    if k + 1 < len(chain.links):
        behind = chain.links[k + 1].values
        return values | {
            "tau_n": behind.get("tau"),
            "a_n": behind.get("a"),
            "m_n": behind.get("m_n"),
        }
    own_axis = values.get("a", mpmath.zeros(3, 1))
    return values | {
        "tau_n": mpmath.zeros(1 if link.kind == "pin" else turns, 1), "a_n": own_axis,
        "m_n": mpmath.zeros(3, 1),
    }  # fmt: skip


def _chain_states(
    chain: Chain, steps: list[tuple[Array, Array]], total: Array
) -> list[tuple[Array, Array]]:
    size, turns = chain.size, chain.size - chain.shifts
    start = stack_columns(chain.ground, mpmath.zeros(size, 1), mpmath.matrix([1]))
    known = total * start
    rows = [[total[size + i, size + j] for j in range(size)] for i in range(size)]
    right = [-known[size + i] for i in range(size)]
    condition = _root_condition(chain)
    if condition is not None:
        rows += [[row[j] for j in range(size)] for row in condition[0]]
        right += condition[1]
    loads = mpmath.lu_solve(mpmath.matrix(rows), mpmath.matrix(right))
    assert len(loads) == size and turns
    state = stack_columns(chain.ground, loads, mpmath.matrix([1]))
    found = []
    for hinge, body in steps:
        inner = hinge * state
        state = body * inner
        found.append((inner, state))
    return found


def _root_condition(chain: Chain) -> tuple[list[list[Any]], list[Any]] | None:
    """The root hinge's own efforts, rows on (m, q) of the ground."""
    link, turns = chain.links[0], chain.size - chain.shifts
    if link.kind in ("smooth", "ball"):
        rows = [[int(i == j) for j in range(chain.size)] for i in range(turns)]
        return rows, list(link.values["tau"])
    if link.kind == "pin":
        return [[*link.values["a"], 0, 0, 0]], [link.values["tau"][0]]
    return None


# --- the Riccati steps ------------------------------------------------------------------------


@dataclass(frozen=True)
class _Affine:
    """x -> matrix x + constant."""

    matrix: Array
    constant: Array

    def __call__(self, x: Array) -> Array:
        return self.matrix * x + self.constant


def by_steps(chain: Chain) -> list[tuple[Array, Array]]:
    """(z_I, z_O) of every body: absorb, re-base, condense, hinge; then outwards again."""
    with mpmath.workdps(DIGITS):
        load = _Affine(mpmath.zeros(chain.size), mpmath.zeros(chain.size, 1))
        stack: list[tuple[_Affine, _Affine, _Affine, Array]] = []
        for k in reversed(range(len(chain.links))):
            body = chain.links[k].body
            inner, modal, basis = _condense_body(body, load)
            relation, across = _hinge(chain, k, inner)
            stack.append((relation, modal, load, basis))
            load = across
        return _outwards(chain, stack[::-1])


def _condense_body(body: ParticleBody, load: _Affine) -> tuple[_Affine, _Affine, Array]:
    """f_I = S a_I + e, eta's step of a_I, and the base change, of a body with f_O = S a_O + e."""
    impedance, rest = body.linear()
    ports = body.output_map()
    z = impedance + ports.T * load.matrix * ports
    f = rest + ports.T * load.constant
    p, n, size = body.rigid_count, body.modes, body.rigid_count + body.modes
    basis = mpmath.eye(size)
    if not n:
        return _Affine(z, f), _Affine(mpmath.zeros(1, p), mpmath.zeros(1, 1)), basis
    basis[body.shifts : p, p:] = -body.slopes("I")
    z, f = basis.T * z * basis, basis.T * f
    both = mpmath.zeros(n, p + 1)
    both[:, :p] = z[p:, :p]
    both[:, p] = f[p:, 0]
    solved = mpmath.inverse(z[p:, p:]) * both
    modal = _Affine(-solved[:, :p], -solved[:, p])
    stiff = z[:p, :p] + z[:p, p:] * modal.matrix
    return _Affine(stiff, f[:p, 0] + z[:p, p:] * modal.constant), modal, basis


def _hinge(chain: Chain, k: int, load: _Affine) -> tuple[_Affine, _Affine]:
    """a_C of a_P, and f_P of a_P, for f_C = load(a_C)."""
    link, size = chain.links[k], chain.size
    gap = predicted_section(chain, k - 1, "O") - predicted_section(chain, k, "I")
    one = mpmath.eye(size)
    if link.kind in SPRINGS:
        return _spring_hinge(chain, k, load, gap)
    gap[chain.shifts :, 0] = gap[chain.shifts :, 0] + link.values.get(
        "gamma", link.values.get("beta", mpmath.zeros(size - chain.shifts, 1))
    )
    if link.kind == "fixed":
        carried = _Affine(one, gap)
        return carried, _Affine(load.matrix, load(gap))
    free, turned = _free_directions(chain, link)
    pivot = mpmath.inverse(free.T * load.matrix * free)
    through = _Affine(
        -pivot * (free.T * load.matrix + turned), -pivot * (free.T * load(gap) - link.values["tau"])
    )
    carried = _Affine(one + free * through.matrix, gap + free * through.constant)
    return carried, _Affine(load.matrix * carried.matrix, load(carried.constant))


def _free_directions(chain: Chain, link: Link) -> tuple[Array, Array]:
    """H, and the rows on a_P by which H turns under the load that the hinge carries."""
    size, shifts = chain.size, chain.shifts
    if link.kind != "pin":
        free = mpmath.zeros(size, size - shifts)
        free[shifts:, :] = mpmath.eye(size - shifts)
        return free, mpmath.zeros(size - shifts, size)
    free, turned = mpmath.zeros(6, 1), mpmath.zeros(1, 6)
    free[3:, 0] = link.values["a"]
    if chain.links[0] is not link:
        turned[0, 3:] = cross(link.values["a"], link.values["m_n"]).T
    return free, turned


def _spring_hinge(chain: Chain, k: int, load: _Affine, gap: Array) -> tuple[_Affine, _Affine]:
    size = chain.size
    law, lever = (
        (_planar_law(chain, k), _planar_lever) if chain.planar else (_spatial_law, _spatial_lever)
    )
    values, shifts = chain.links[k].values, chain.shifts

    def elongation(a_p: Array, a_c: Array) -> Array:
        return (a_c - a_p - gap)[:shifts, 0]

    def efforts(pair: Array) -> Array:
        a_p, a_c = pair[:size, 0], pair[size:, 0]
        return law(values, elongation(a_p, a_c), a_p[shifts:, 0], a_c[shifts:, 0])

    def inboard_load(pair: Array) -> Array:
        a_p, a_c = pair[:size, 0], pair[size:, 0]
        return lever(values, elongation(a_p, a_c), load(a_c))

    whole = _affine(efforts, 2 * size)
    pivot = mpmath.inverse(load.matrix - whole.matrix[:, size:])
    carried = _Affine(pivot * whole.matrix[:, :size], pivot * (whole.constant - load.constant))
    felt = _affine(lambda a_p: inboard_load(stack_columns(a_p, carried(a_p))), size)
    return carried, felt


def _affine(function: Callable[[Array], Array], size: int) -> _Affine:
    """Matrix and constant of an affine function."""
    constant = function(mpmath.zeros(size, 1))
    columns = []
    for k in range(size):
        unit = mpmath.zeros(size, 1)
        unit[k] = 1
        columns.append(function(unit) - constant)
    matrix = mpmath.matrix([[c[i] for c in columns] for i in range(len(constant))])
    return _Affine(matrix, constant)


Values = dict[str, Array]


def _planar_law(chain: Chain, k: int) -> Callable[..., Array]:
    start = predicted_section(chain, k - 1, "O")[2]
    between = predicted_section(chain, k, "I")[2] - start

    def law(v: Values, d: Array, s_p: Array, s_c: Array) -> Array:
        turn = start + s_p[0] - v["theta_s"][0]
        across = mpmath.matrix([[0, -1], [1, 0]])
        change = d - v["d_s"] - turn * (across * v["d_s"])
        force = v["q_s"] + turn * (across * v["q_s"])
        force -= (v["k_t"] + v["C"][0] * v["c_t"]) * change
        phi = between + s_c[0] - s_p[0]
        x = v["phi_s"][0] - v["phi_0"][0]
        at_rest = v["k_1"][0] * x + v["k_3"][0] * x**3
        at_rest += v["c_r"][0] * (v["C"][0] * v["phi_s"][0] + v["D_phi"][0])
        slope = v["k_1"][0] + 3 * v["k_3"][0] * x**2 + v["C"][0] * v["c_r"][0]
        moment = -at_rest - slope * (phi - v["phi_s"][0])
        return stack_columns(force, mpmath.matrix([moment]))

    return law


def _planar_lever(v: Values, d: Array, f: Array) -> Array:
    change = d - v["d_s"]
    moment = f[2] + v["d_s"][0] * f[1] - v["d_s"][1] * f[0]
    moment += change[0] * v["q_s"][1] - change[1] * v["q_s"][0]
    return mpmath.matrix([f[0], f[1], moment])


def _spatial_law(v: Values, d: Array, s_p: Array, s_c: Array) -> Array:
    change = d - v["d_s"] - cross(s_p, v["d_s"])
    force = v["q_s"] + cross(s_p, v["q_s"]) - (v["k_t"] + v["C"][0] * v["c_t"]) * change
    moment = v["m_s"] + cross(s_p, v["m_s"])
    moment -= (v["k_r"] + v["C"][0] * v["c_r"]) * (s_c - s_p)
    return stack_columns(force, moment)


def _spatial_lever(v: Values, d: Array, f: Array) -> Array:
    force = f[:3, 0]
    moment = f[3:, 0] + cross(v["d_s"], force) + cross(d - v["d_s"], v["q_s"])
    return stack_columns(force, moment)


def _outwards(
    chain: Chain, steps: list[tuple[_Affine, _Affine, _Affine, Array]]
) -> list[tuple[Array, Array]]:
    found = []
    a_p = mpmath.zeros(chain.size, 1)
    for link, (relation, modal, load, basis) in zip(chain.links, steps, strict=True):
        body = link.body
        a_i = relation(a_p)
        motion = a_i if not body.modes else stack_columns(a_i, modal(a_i))
        inner, _, _ = _condense_body(body, load)
        step = basis * motion
        a_p = body.output_map() * step
        found.append((_state(body, step, inner(a_i), "I"), _state(body, step, load(a_p), "O", a_p)))
    return found


def _state(
    body: ParticleBody, step: Array, loads: Array, end: str, a_o: Array | None = None
) -> Array:
    """The classical state of the body at an end."""
    shifts, v = body.shifts, body.values
    place = v["r_p"] + step[:shifts, 0]
    if end == "O" and a_o is not None:
        place = v["r_p"] + body.arm(_zero(body)) + a_o[:shifts, 0]
    angle = step[shifts : body.rigid_count, 0]
    if body.planar:
        angle = angle + v["theta_p"]
    parts = [place, angle, loads[shifts:, 0], loads[:shifts, 0]]
    if body.modes:
        parts.append(body.eta(step))
    return stack_columns(*parts, mpmath.matrix([1]))
