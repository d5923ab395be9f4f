"""4(3) pair of diagonally implicit stages, L-stable, stiffly accurate: ESDIRK4(3)6L[2]SA_2.

C. A. Kennedy, M. H. Carpenter, Diagonally implicit Runge-Kutta methods for stiff ODEs, Applied
Numerical Mathematics 146 (2019) 221-244.
"""

from __future__ import annotations

from fractions import Fraction

from .implicit_methods import Implicit, make_diagonal, parse_numbers

_GAMMA = "31/125"
_MATRIX = f"""
    0
    {_GAMMA} {_GAMMA}
    -360286518617/7014585480527 -360286518617/7014585480527 {_GAMMA}
    -506388693497/5937754990171 -506388693497/5937754990171 7149918333491/13390931526268 {_GAMMA}
    -7628305438933/11061539393788 -7628305438933/11061539393788 21592626537567/14352247503901
        11630056083252/17263101053231 {_GAMMA}
    -12917657251/5222094901039 -12917657251/5222094901039 5602338284630/15643096342197
        9002339615474/18125249312447 -2420307481369/24731958684496 {_GAMMA}
"""
_NODES = "0 62/125 486119545908/3346201505189 1043/1706 1361/1300 1"
_ERROR = """
    5106873525203549881053916/63280437666689274586070553
    5106873525203549881053916/63280437666689274586070553
    -25162027003603428150355757/187362381104177276978781327
    -4098711186040344850920813/204021751328880889263048263
    -2403006641348284599749077/92621941821407359153398928
    20990421664717/1109114971657125
"""


def tableau() -> Implicit:
    """The method `esdirk436`."""
    words = _MATRIX.split()
    rows = [words[i * (i + 1) // 2 : (i + 1) * (i + 2) // 2] for i in range(6)]
    matrix = [[float(Fraction(word)) for word in row] for row in rows]
    return make_diagonal(
        "esdirk436",
        4,
        matrix,
        parse_numbers(_NODES).tolist(),
        parse_numbers(_ERROR),
        error_order=3,
        source="Kennedy and Carpenter (2019), ESDIRK4(3)6L[2]SA_2",
    )
