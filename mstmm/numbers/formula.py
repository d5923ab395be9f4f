"""Symbolic numbers: values with their polynomial in named symbols, in normal form.

The code that turns the numbers of a scene into kernel data, and the kernels themselves, run on
Formulas as they run on floats.  Each Formula also carries its value, computed by the same
operations in the same order.  The value is therefore bit for bit that of plain floats; it decides
which branch a computation follows.

A formula is a polynomial in symbols and in atoms: sin, cos, sqrt, 1 / sum and other functions of
formulas.  Products are expanded, with sin^2 = 1 - cos^2 and sqrt^2 resolved, so that terms cancel.
Coefficients are fractions where a double is a short decimal or a simple fraction, and doubles
elsewhere.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from typing import Any

from ..errors import SceneError

#: Most decimal digits, and largest denominator, for which a double is replaced by a fraction.
_DIGITS, _DENOMINATOR = 12, 1000
#: Largest relative difference between a double and that fraction: two units in the last place.
_NEAR = 2.0**-51

#: Most products of terms that are not counted, and terms of a sum that count as one product.
_FEW, _LONG = 8, 32

Coefficient = Fraction | float
#: Atoms and their powers, in the order in which the atoms were created.
Monomial = tuple[tuple["Atom", int], ...]
Terms = dict[Monomial, Coefficient]


class Atom:
    """Indeterminate of a polynomial: a symbol, or a function `op` of formulas."""

    __slots__ = ("args", "book", "name", "op", "place", "value")

    def __init__(
        self, book: Book, op: str, args: tuple[Formula, ...], value: float, name: str = ""
    ) -> None:
        self.book, self.op, self.args, self.value, self.name = book, op, args, value, name
        self.place = book.next_place()


class Book:
    """Table of the atoms of one derivation, each stored once.

    Raises SceneError when the sums and products of a derivation need more than `most` products of
    terms.
    """

    def __init__(self, most: int) -> None:
        self._most, self._products, self._places = most, 0, 0
        self._known: dict[object, Atom] = {}

    def symbol(self, name: str, value: float) -> Formula:
        """Create a symbol with its value."""
        return Formula(value, {((Atom(self, "symbol", (), value, name), 1),): Fraction(1)})

    def atom(self, op: str, args: tuple[Formula, ...], value: float) -> Atom:
        """Atom of the function `op` of formulas, created at the first call."""
        key = (op, *(frozenset(x.terms.items()) for x in args))
        if key not in self._known:
            self._known[key] = Atom(self, op, args, value)
        return self._known[key]

    def next_place(self) -> int:
        """Reserve the order number of the next atom."""
        self._places += 1
        return self._places

    def count(self, products: int) -> None:
        """Count products of terms before they are computed; raise SceneError above the limit."""
        self._products += products
        if self._products > self._most:
            raise SceneError(
                f"formulas: {self._products} products of terms exceed the limit of "
                f"{self._most}; keep fewer names as symbols, or use a smaller scene"
            )


class Formula:
    """Number `value` with the terms of the polynomial that gives it.

    Ordered by value.  A Formula equals a float only where it contains no symbol, so that a formula
    whose value is zero is no structural zero.
    """

    __slots__ = ("terms", "value")

    def __init__(self, value: float, terms: Terms) -> None:
        self.value, self.terms = value, terms

    @property
    def fixed(self) -> bool:
        """Whether the formula contains no symbol."""
        return not self.terms or (len(self.terms) == 1 and () in self.terms)

    def __bool__(self) -> bool:
        return not self.fixed or self.value != 0

    def __eq__(self, other: object) -> bool:
        if isinstance(other, Formula):
            return self.value == other.value and self.terms == other.terms
        return self.fixed and self.value == other

    def __hash__(self) -> int:
        return hash(self.value)

    def __lt__(self, other: Any) -> bool:
        return self.value < value_of(other)

    def __le__(self, other: Any) -> bool:
        return self.value <= value_of(other)

    def __gt__(self, other: Any) -> bool:
        return self.value > value_of(other)

    def __ge__(self, other: Any) -> bool:
        return self.value >= value_of(other)

    def __neg__(self) -> Formula:
        return Formula(-self.value, _scaled(self.terms, -1))

    def __abs__(self) -> Formula:
        return -self if math.copysign(1.0, self.value) < 0 else self

    def __add__(self, other: Any) -> Formula:
        return Formula(self.value + value_of(other), _sum(self.terms, _terms(other), 1))

    __radd__ = __add__

    def __sub__(self, other: Any) -> Formula:
        return Formula(self.value - value_of(other), _sum(self.terms, _terms(other), -1))

    def __rsub__(self, other: float) -> Formula:
        return Formula(other - self.value, _sum(_terms(other), self.terms, -1))

    def __mul__(self, other: Any) -> Formula:
        return Formula(self.value * value_of(other), _product(self.terms, _terms(other)))

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Formula:
        divisor = formula(other)
        return Formula(self.value / divisor.value, _product(self.terms, _inverse(divisor)))

    def __rtruediv__(self, other: float) -> Formula:
        return formula(other) / self


def formula(number: Any) -> Formula:
    """Convert a number to a Formula; a Formula is returned unchanged."""
    return number if isinstance(number, Formula) else Formula(float(number), _terms(number))


def value_of(number: Any) -> float:
    """Value of a formula or a plain number as a float."""
    return number.value if isinstance(number, Formula) else float(number)


def share(x: Formula, symbol: Formula) -> Formula:
    """Factor of a symbol in a formula x that is linear in it; the value of the symbol is 1."""
    ((((atom, _),), _),) = symbol.terms.items()
    found = {
        tuple(factor for factor in monomial if factor[0] is not atom): c
        for monomial, c in x.terms.items()
        if (atom, 1) in monomial
    }
    return Formula(x.value, found)


@lru_cache(maxsize=4096)
def exact(x: float) -> Coefficient:
    """Short decimal or simple fraction nearest to a double within rounding, else the double."""
    if not math.isfinite(x):
        return x
    for near in (Fraction(f"{x:.{_DIGITS}g}"), Fraction(x).limit_denominator(_DENOMINATOR)):
        if abs(near) < 2**1000 and abs(float(near) - x) <= _NEAR * abs(x):
            return near
    return x


# Below, results are Formulas.  They are typed as Any because scene numbers are typed as floats.


# --- functions ------------------------------------------------------------------------------------


def root(x: Formula, value: float | None = None) -> Formula:
    """Square root of a formula; the root of a single even term is that term, with its sign."""
    found = math.sqrt(x.value) if value is None else value
    if x.fixed:
        return Formula(found, _constant(exact(found)))
    even = _even_root(x)
    return Formula(found, _atom("sqrt", (x,), found) if even is None else even)


def function(op: str, args: tuple[Formula, ...], value: float) -> Any:
    """Function of formulas by its name in the IR, with its known value."""
    if all(x.fixed for x in args):
        return Formula(value, _constant(exact(value)))
    return Formula(value, _atom(op, args, value))


def total(numbers: Sequence[Any], value: float) -> Any:
    """Sum of numbers with its known value."""
    found: Terms = {}
    for number in numbers:
        found = _sum(found, _terms(number), 1)
    return Formula(value, found)


def length_of(numbers: Sequence[Any], value: float) -> Any:
    """Euclidean length of a vector, with its known value."""
    squares = [formula(x) * x for x in numbers]
    return root(total(squares, sum(x.value for x in squares)), value)


def turn(angle: Formula, cosine: float, sine: float) -> tuple[Any, Any]:
    """Cosine and sine of an angle (rad), with their known values."""
    return function("cos", (angle,), cosine), function("sin", (angle,), sine)


def direction(v: Sequence[Any], values: Sequence[float]) -> tuple[Any, ...]:
    """Unit vector v / |v|, with its known values."""
    size = length_of(v, math.hypot(*map(value_of, v)))
    return tuple(Formula(n, (formula(x) / size).terms) for x, n in zip(v, values, strict=True))


# --- polynomials ----------------------------------------------------------------------------------


def _terms(number: Any) -> Terms:
    return number.terms if isinstance(number, Formula) else _constant(exact(float(number)))


def _constant(coefficient: Coefficient) -> Terms:
    return {(): coefficient} if coefficient else {}


def _scaled(terms: Terms, factor: Coefficient) -> Terms:
    return {monomial: factor * c for monomial, c in terms.items()}


def _sum(a: Terms, b: Terms, sign: int) -> Terms:
    if len(a) + len(b) > _LONG:
        _book(a if len(a) > 1 else b).count((len(a) + len(b)) // _LONG)
    found = dict(a)
    _add(found, b, sign)
    return found


def _add(found: Terms, more: Terms, factor: Coefficient) -> None:
    """Add terms times a factor to the terms found, in place."""
    for monomial, c in more.items():
        rest = found.get(monomial, 0) + factor * c
        if rest:
            found[monomial] = rest
        else:
            found.pop(monomial, None)


def _product(a: Terms, b: Terms) -> Terms:
    if len(a) * len(b) > _FEW:
        _book(a if len(a) > 1 else b).count(len(a) * len(b))
    found: Terms = {}
    for one, c in a.items():
        for other, d in b.items():
            monomial = _merged(one, other) if one and other else one or other
            if all(map(_is_normal, monomial)):
                _add(found, {monomial: c}, d)
            else:
                _add(found, _resolved(monomial), c * d)
    return found


def _merged(a: Monomial, b: Monomial) -> Monomial:
    powers = dict(a)
    for atom, power in b:
        powers[atom] = powers.get(atom, 0) + power
    return tuple(sorted(((x, p) for x, p in powers.items() if p), key=_place))


def _place(factor: tuple[Atom, int]) -> int:
    return factor[0].place


def _is_normal(factor: tuple[Atom, int]) -> bool:
    atom, power = factor
    if atom.op == "sin":
        return power < 2
    if atom.op == "sqrt":
        return power == 1
    return atom.op != "inverse" or power > 0


def _resolved(monomial: Monomial) -> Terms:
    """Resolve powers of sin, sqrt and inverse in a product: its normal form."""
    plain = tuple(factor for factor in monomial if _is_normal(factor))
    found: Terms = {plain: Fraction(1)}
    for atom, power in monomial:
        if _is_normal((atom, power)):
            continue
        (arg,) = atom.args
        if atom.op == "sin":
            cos = ((atom.book.atom("cos", (arg,), math.cos(arg.value)), 2),)
            square: Terms = {(): Fraction(1), cos: Fraction(-1)}
            rest = power % 2
            found = _product(found, _power(square, power // 2))
        elif atom.op == "sqrt":
            half, rest = divmod(power, 2)
            base = arg.terms if half >= 0 else _inverse(arg)
            found = _product(found, _power(base, abs(half)))
        else:
            found, rest = _product(found, _power(arg.terms, -power)), 0
        if rest:
            found = _product(found, {((atom, 1),): Fraction(1)})
    return found


def _power(base: Terms, exponent: int) -> Terms:
    found: Terms = {(): Fraction(1)}
    for _ in range(exponent):
        found = _product(found, base)
    return found


def _inverse(x: Formula) -> Terms:
    """1 / x: of one term its powers turned round, of a sum an atom.

    Raises ZeroDivisionError for what is zero whatever the symbols are.
    """
    if x.fixed:
        return _constant(_reciprocal(x.terms.get((), Fraction(0))))
    (monomial, c), *more = x.terms.items()
    if not more:
        turned = tuple((atom, -power) for atom, power in monomial)
        if all(map(_is_normal, turned)):
            return {turned: _reciprocal(c)}
        return _scaled(_resolved(turned), _reciprocal(c))
    leading = _reciprocal(c)
    monic = Formula(x.value * float(leading), _scaled(x.terms, leading))
    return _scaled(
        _atom("inverse", (monic,), 1 / monic.value if monic.value else math.inf), leading
    )


def _reciprocal(c: Coefficient) -> Coefficient:
    return 1 / c if isinstance(c, Fraction) else exact(1 / c)


def _even_root(x: Formula) -> Terms | None:
    """Square root of a single term with even powers; None for anything else."""
    if len(x.terms) > 1:
        return None
    ((monomial, c),) = x.terms.items()
    halves = tuple((atom, power // 2) for atom, power in monomial)
    size = math.prod(atom.value**power for atom, power in halves if atom.value or power > 0)
    if c < 0 or size == 0 or any(power % 2 for _, power in monomial):
        return None
    return {halves: exact(math.copysign(math.sqrt(c), size))}


def _atom(op: str, args: tuple[Formula, ...], value: float) -> Terms:
    book = next(_book(x.terms) for x in args if not x.fixed)
    return {((book.atom(op, args, value), 1),): Fraction(1)}


def _book(terms: Terms) -> Book:
    """Atom table of terms, at least one of which contains an atom."""
    return next(monomial[0][0].book for monomial in terms if monomial)
