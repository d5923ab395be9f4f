"""Differentiated kernels that form the tangents of the sweep.

For a kernel `name` in the table, `name_slope` gives the derivatives of its outputs along a
direction; it is the IR of the kernel differentiated operation by operation (one-sided at kinks of a
law), so the equations of an element are stated once.  It reads the inputs of the kernel and
`d_PORT` for each port that varies, and gives `d_PORT` for the outputs.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from mstmm.ir import KernelIR
from mstmm.ir.differentiation import differentiate, jacobian

from .combined_hinge_kernels import across_kernels

#: Suffix of the name of a differentiated kernel.
SLOPE = "_slope"
#: Kernels of full derivatives of an output by a port, one row per entry of the port: name ->
#: (kernel, port, output), by kind of the element.
_JACOBIANS = {
    "body": {"load_by_motion": ("bias_load", "motion", "e")},
    "hinge": {
        "rates_by_coordinates": ("hinge", "q", "qdot"),
        "rates_by_speeds": ("hinge", "u", "qdot"),
    },
}

#: kernel -> (ports that vary, outputs; "" for all), by kind and name of the element. "generic"
#: means the steps for any hinge; "hinge", "body" and "force" mean every element of that kind.
_DIFFERENTIATED: dict[str, dict[str, tuple[str, str]]] = {
    "hinge": {"hinge": ("q u", "")},
    "body": {"bias_load": ("motion", "")},
    "force": {"wrench": ("t A_F x_F v_F w_F A_T x_T v_T w_T effort", "F M")},
    "laws": {
        "linear": ("q u effort", "tau"),
        "full": ("q u effort", "tau"),
        "rotation": ("q u effort", "tau"),
        "six": ("q u effort", "tau"),
    },
    "generic": {
        "forward": ("R d H v w c s motion_I", ""),
        "effort": ("H f", ""),
        "complement": ("H", ""),
        "add_known_part": ("y z", ""),
        "add_multiplier_effort": ("y x", ""),
    },
    "frames": {
        "pose": ("A_I x_I Rc r", ""),
        "velocity": ("Rc r v_I w_I v_rel", ""),
        "point": ("A x v motion", "x_K v_K"),
        "angular_motion": ("A motion", "w_K"),
        "end_frame": ("A", ""),
        "applied_load": ("A A_F F M", ""),
        "reaction_wrench": ("x_F x_T F M", ""),
        "length": ("x_F x_T v_F v_T", ""),
        "transport": ("Rc r e", ""),
        "driven_effort": ("load udot tau", ""),
    },
    "loops": {
        "relative_pose": ("A_C x_C A_B x_B Rc r", ""),
        "slip": ("R_C d v_C w_C v_B w_B", ""),
        "drift": ("R_C d slip motion_C motion_B", ""),
        "row": ("w R_C Rc r_A", ""),
        "known_parts": ("W relative", ""),
        "apply_effort": ("J tau", ""),
        "apply_multiplier": ("K x", ""),
        "distance": ("d", "W"),
        "distance_drift": ("d slip", ""),
        "plane": ("d", "W"),
        "rolling": ("R_C d", "W"),
        "rolling_drift": ("R_C slip", ""),
    },
    "modal": {
        "residual": ("eta etad motion", "S_rf e e_f"),
        "prescribed_load": ("S_rf s", ""),
        "momentum": ("eta etad v w", "h h_f"),
        "section": ("eta etad", ""),
        "end_motion": ("x Psi xd Psid xdd Psidd", ""),
        "frame_motion": ("x Psi xd Psid xdd Psidd", ""),
        "subspace": ("H6 Phi", ""),
        "prescribed_bias": ("H s c", ""),
        "modal_effort": ("H e e_f", ""),
    },
}


def with_slopes(group: str, kernels: Iterable[KernelIR]) -> tuple[KernelIR, ...]:
    """Kernels, then derivatives of those in the table, and combined kernels of hinges."""
    kernels = tuple(kernels)
    differentiated = _DIFFERENTIATED.get(group, {})
    slopes = [slope(k, *differentiated[k.name]) for k in kernels if k.name in differentiated]
    by_name = {kernel.name: kernel for kernel in kernels}
    for name, (kernel, port, output) in _JACOBIANS.get(group, {}).items():
        if next(p for p in by_name[kernel].inputs if p.name == port).length():
            slopes.append(replace(jacobian(by_name[kernel], port, output), name=name))
    if group == "hinge":
        slopes += across_kernels(by_name["hinge"])
    return (*kernels, *slopes)


def slope(kernel: KernelIR, ports: str, outputs: str) -> KernelIR:
    """Differentiated kernel; names of ports that it does not have are ignored."""
    input_names = {port.name for port in kernel.inputs}
    varying = [name for name in ports.split() if name in input_names]
    derivative = differentiate(kernel, varying, outputs.split() or None, values=False, guards=False)
    return replace(derivative, name=kernel.name + SLOPE)
