"""Random rigid, beam and elastic bodies of particles with all the inputs of their kernels."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np

from tests.support.classical.discrete_bodies import (
    DIGITS,
    Array,
    ParticleBody,
    cross,
    definite,
    random_matrix,
    turn,
)

PARTICLES = 4


def random_body(
    rng: np.random.Generator, planar: bool, kind: str, modes: int, planes: str = ""
) -> ParticleBody:
    """A body of the kind rigid, beam or elastic, with a random motion, predictor and time map."""
    with mpmath.workdps(DIGITS):
        masses = [mpmath.mpf(m) for m in rng.uniform(0.5, 2.0, PARTICLES)]
        places = [_place(rng, planar, kind) for _ in masses]
        shapes = [_shape(rng, planar, kind, modes, planes) for _ in masses]
        values = _moments(planar, kind, modes, planes, (masses, places, shapes))
        values |= _ends(rng, planar, kind, modes) | _motion(rng, planar, modes)
        if modes:
            values |= {"K_f": 10 * definite(rng, modes), "D_f": definite(rng, modes)}
        return ParticleBody(planar, modes, masses, places, shapes, values)


def _place(rng: np.random.Generator, planar: bool, kind: str) -> Array:
    place = random_matrix(rng, 3)
    if kind == "beam":
        return mpmath.matrix([mpmath.mpf(rng.uniform(0, 1)), 0, 0])
    if planar:
        place[2] = 0
    return place


def _shape(rng: np.random.Generator, planar: bool, kind: str, modes: int, planes: str) -> Array:
    if not modes:
        return mpmath.zeros(3, 1)
    shape = random_matrix(rng, 3, modes)
    for k in range(modes):
        along = "xyz".index(planes[k]) if planes else 1
        for i in range(3):
            if (kind == "beam" and i != along) or (planar and i == 2):
                shape[i, k] = 0
    return shape


Particles = tuple[list[Any], list[Array], list[Array]]


def _moments(
    planar: bool, kind: str, modes: int, planes: str, particles: Particles
) -> dict[str, Array]:
    masses, places, shapes = particles
    first = sum((m * r for m, r in zip(masses, places, strict=True)), mpmath.zeros(3, 1))
    inertia = mpmath.zeros(3)
    for m, r in zip(masses, places, strict=True):
        inertia += m * ((r.T * r)[0] * mpmath.eye(3) - r * r.T)
    values = {"m": mpmath.matrix([mpmath.fsum(masses)])}
    if planar:
        values |= {"S_0": first[:2, 0], "I_0": mpmath.matrix([inertia[2, 2]])}
    else:
        values |= {"S_0": first, "J_0": inertia}
    if not modes:
        return values
    shift, gram = mpmath.zeros(3, modes), mpmath.zeros(modes)
    for m, phi in zip(masses, shapes, strict=True):
        shift += m * phi
        gram += m * (phi.T * phi)
    if planar:
        return values | _planar_modal(kind, modes, particles, (shift, gram))
    return values | _spatial_modal(kind, modes, planes, particles, shift)


def _planar_modal(
    kind: str, modes: int, particles: Particles, sums: tuple[Array, Array]
) -> dict[str, Array]:
    masses, places, shapes = particles
    shift, gram = sums
    along, crossed = mpmath.zeros(modes, 1), mpmath.zeros(modes, 1)
    skew = mpmath.zeros(modes)
    for m, r, phi in zip(masses, places, shapes, strict=True):
        along += m * (phi.T * r)
        for k in range(modes):
            crossed[k] += m * (r[0] * phi[1, k] - r[1] * phi[0, k])
            for j in range(modes):
                skew[k, j] += m * (phi[0, k] * phi[1, j] - phi[1, k] * phi[0, j])
    values = {"S_c": crossed, "M_f": gram}
    if kind == "beam":
        return values | {"s": shift[1, :].T}
    return values | {"S_t": shift[:2, :], "S_r": along, "G_f": skew}


def _spatial_modal(
    kind: str, modes: int, planes: str, particles: Particles, shift: Array
) -> dict[str, Array]:
    masses, places, shapes = particles
    if kind == "beam":
        along = ["xyz".index(plane) for plane in planes]
        e, gram = mpmath.zeros(modes, 1), mpmath.zeros(modes)
        for m, r, phi in zip(masses, places, shapes, strict=True):
            for k in range(modes):
                e[k] += m * r[0] * phi[along[k], k]
                for j in range(modes):
                    gram[k, j] += m * phi[along[k], k] * phi[along[j], j]
        s = mpmath.matrix([shift[along[k], k] for k in range(modes)])
        return {"s": s, "e": e, "M_phi": gram}
    pairs = [(k, j) for k in range(modes) for j in range(k, modes)]
    first, second = mpmath.zeros(3, 3 * modes), mpmath.zeros(3, 3 * len(pairs))
    for m, r, phi in zip(masses, places, shapes, strict=True):
        for k in range(modes):
            first[:, 3 * k : 3 * k + 3] = first[:, 3 * k : 3 * k + 3] + m * r * phi[:, k].T
        for place, (k, j) in enumerate(pairs):
            block = slice(3 * place, 3 * place + 3)
            second[:, block] = second[:, block] + m * phi[:, k] * phi[:, j].T
    return {"S_t": shift, "E": first, "F": second}


def _ends(rng: np.random.Generator, planar: bool, kind: str, modes: int) -> dict[str, Array]:
    shifts, turns = (2, 1) if planar else (3, 3)
    if kind == "beam" and planar:
        return {
            "L": mpmath.matrix([mpmath.mpf(rng.uniform(0.5, 1.5))]),
            "phi_O": random_matrix(rng, 1, modes),
            "Theta_O": random_matrix(rng, 1, modes),
            "Theta_I": random_matrix(rng, 1, modes),
        }
    values = {"r_e": random_matrix(rng, shifts)}
    if modes:
        values |= {
            "Phi_O": random_matrix(rng, shifts, modes),
            "Theta_O": random_matrix(rng, turns, modes),
        }
        values |= {"Theta_I": random_matrix(rng, turns, modes)}
    return values


def _motion(rng: np.random.Generator, planar: bool, modes: int) -> dict[str, Array]:
    shifts, turns = (2, 1) if planar else (3, 3)
    values = {
        "A": mpmath.matrix([mpmath.mpf(rng.uniform(5, 20))]),
        "C": mpmath.matrix([mpmath.mpf(rng.uniform(2, 5))]),
        "B_r": random_matrix(rng, shifts), "r_p": random_matrix(rng, shifts),
        "q_p": random_matrix(rng, shifts), "g": random_matrix(rng, shifts),
        "f_r": random_matrix(rng, shifts), "f_m": random_matrix(rng, turns),
    }  # fmt: skip
    if planar:
        values |= {name: random_matrix(rng, 1) for name in ("B_theta", "D_theta", "theta_p")}
    else:
        values |= {"B_w": random_matrix(rng, 3), "D_w": random_matrix(rng, 3), "R_p": turn(rng)}
        values["T"] = mpmath.eye(3) + random_matrix(rng, 3, 3) / 10
    if modes:
        values |= {name: random_matrix(rng, modes) for name in ("B_eta", "D_eta", "eta_p", "f_eta")}
        if not planar:
            values |= {
                "m_p": random_matrix(rng, 3),
                "m_pI": random_matrix(rng, 3),
                "K_g": random_matrix(rng, modes, modes),
            }
    return values


__all__ = ["cross", "random_body"]
