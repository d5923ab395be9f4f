"""First result of CasADi for the same scene: graph, C, compiler, CVODES without a cache.

python first_casadi_result.py SCENE
"""

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import casadi as ca
from common.aba import articulated_body
from common.links import link_tree

tree = link_tree(json.loads(Path(sys.argv[1]).read_text()))
function, _ = articulated_body(tree, baked=True)
x = ca.SX.sym("x", tree.nq + tree.nu)
rates = function(ca.SX(0, 1), x[: tree.nq], x[tree.nq :], ca.SX.zeros(tree.nu))
options = {
    "linear_multistep_method": "adams", "nonlinear_solver_iteration": "functional", "jit": True,
    "compiler": "shell", "jit_options": {"flags": ["-O3", "-march=native"], "verbose": False},
}  # fmt: skip
run = ca.integrator("run", "cvodes", {"x": x, "ode": ca.vertcat(*rates)}, 0.0, 0.1, options)
print(run(x0=0.0)["xf"])
