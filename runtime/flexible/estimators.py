"""How far a flexible body went from where its model holds, from what it did.

Per body: slope kappa, spin ratio, stiffening gamma, share of the last shape, bending that the
shapes could not follow, coupling chi, shear.  Thresholds and reasons stand beside the numbers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .observe import Motion, tilde
from .observe_energy import frequencies, modal_energy, modal_mass

if TYPE_CHECKING:
    from .modal_body import ModalBody

Array = NDArray[np.float64]

#: Sections of a beam that are looked at.
SECTIONS = 33


def largest_slope(motion: Motion) -> float:
    """kappa = max |phi' eta|: slope of the deflected axis against the frame; of an elastic body the
    largest rotation of an end across its frame."""
    return max((float(np.max(np.hypot(t[..., 1], t[..., 2]), initial=0.0))
                for t in _all_turns(motion)), default=0.0)  # fmt: skip


def largest_turn(motion: Motion) -> float:
    """max |Psi| in rad of a section or an end against the frame, twist included."""
    return max((float(np.max(np.linalg.norm(t, axis=-1), initial=0.0))
                for t in _all_turns(motion)), default=0.0)  # fmt: skip


def _all_turns(motion: Motion) -> list[Array]:
    """Rotation vectors (n, m, 3) of sections along a beam, or of the ends of an elastic body."""
    body = motion.body
    if body.shapes is not None:
        places = np.linspace(0.0, body.shapes.length, SECTIONS)
        return [np.einsum("mak,tk->tma", body.shapes.at(places).theta, motion.eta)]
    return [np.einsum("ak,tk->ta", p.theta, motion.eta)[:, None] for p in body.ports.values()]


def cross_spin(motion: Motion) -> float:
    """Largest spin in rad/s of the frame about what lies across a beam; about any axis else.

    Spin about a beam's own axis neither stretches nor bends it.
    """
    first = 1 if motion.body.shapes is not None else 0
    return float(np.max(np.linalg.norm(motion.frame_spin[:, first:], axis=1), initial=0.0))


def stiffness_from_loads(
    motion: Motion, gravity: Array, ports: dict[str, Array], second_order: ModalBody
) -> Array:
    """(n, modes, modes) K_g of the loads on the undeformed body.

    K_g = - int rho (a - g)_a g_a + sum_ports F_a g_a(port), with the acceleration a = a_o + W r0 of
    the rigid motion, W = wd~ + w~ w~, and g the second-order displacement: for a beam
    (w_y^2 + w_z^2) G1 - a_x G0 + (end load, as a tension) G(L).  `ports` are forces (n, 3) in N on
    the ends, inertial axes; `second_order` holds G, X and the ports' shortening (not zero).
    """
    force = motion.frame_acceleration - motion.inward(np.broadcast_to(gravity, motion.spin.shape))
    spin = tilde(motion.frame_spin)
    turning = tilde(motion.frame_spin_rate) + spin @ spin
    total = -np.einsum("ta,akl->tkl", force, second_order.G)
    total -= np.einsum("tab,bakl->tkl", turning, second_order.X)
    for name, load in ports.items():
        total += np.einsum("ta,akl->tkl", motion.inward(load), second_order.ports[name].shortening)
    return total


def load_ratios(stiffness: Array, from_loads: Array) -> tuple[float, float]:
    """(smallest, largest) eigenvalue of K^-1 K_g over the samples.

    gamma is the larger of the two in size; at -1 the loads alone buckle the body.
    """
    lower = np.linalg.cholesky(stiffness)
    half = np.linalg.solve(lower, from_loads)
    both = np.linalg.solve(lower, np.swapaxes(half, -1, -2))
    values = np.linalg.eigvalsh((both + np.swapaxes(both, -1, -2)) / 2)
    return float(values.min(initial=0.0)), float(values.max(initial=0.0))


def last_shape_share(motion: Motion) -> tuple[float, str]:
    """Largest share of the energy of all modes that a family's last shape held, and its name.

    Families are the mode names without their number: y, z, twist, axial.  A family that holds less
    than a thousandth of the energy throughout does not count, nor one with a single shape.
    """
    energy = modal_energy(motion)
    total = float(np.max(energy.sum(axis=1), initial=0.0))
    families: dict[str, list[int]] = {}
    for k, name in enumerate(motion.body.modes):
        families.setdefault(name.rstrip("0123456789"), []).append(k)
    worst = (0.0, "")
    for members in families.values():
        own = float(np.max(energy[:, members].sum(axis=1), initial=0.0))
        if len(members) < 2 or total <= 0 or own < 1e-3 * total:
            continue
        share = float(np.max(energy[:, members[-1]], initial=0.0)) / own
        worst = max(worst, (share, motion.body.modes[members[-1]]))
    return worst


def spin_ratio(motion: Motion) -> float:
    """Largest spin across the body over its first frequency in the frame."""
    return cross_spin(motion) / float(frequencies(motion.body)[0])


def coupling(body: ModalBody, hinge_rows: Array, hinge_inertia: Array) -> Array:
    """(modes,) chi_i = M_ri^T D^-1 M_ri / M_ii: share of the inertia at a hinge held by shape i.

    `hinge_rows` (modes, nu) and `hinge_inertia` (nu, nu) of the hinge, what hangs outboard free to
    move, the modes held.
    """
    inertia = np.diag(modal_mass(body))
    carried = np.linalg.solve(hinge_inertia, hinge_rows.T)
    return np.einsum("kj,jk->k", hinge_rows, carried) / inertia


def shear_error(highest: float, gyration: float, rotary: bool) -> float:
    """Relative error of the highest bending frequency without shear (and rotary inertia).

    1/2 (beta r)^2 (1 + E/(k G)) of Timoshenko's correction with beta the wave number in 1/m, r the
    section's radius of gyration in m, E/(k G) = 3.1 (a rectangle of nu = 0.3); the 1 is rotary
    inertia, left out where the model has it.  Not meant above about a half.
    """
    return 0.5 * (highest * gyration) ** 2 * (_SHEAR + (0.0 if rotary else 1.0))


#: E / (k G) of a rectangular section, nu = 0.3, k = 5/6.
_SHEAR = 2 * (1 + 0.3) * 6 / 5
