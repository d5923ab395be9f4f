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
_MAX_DECIMAL_DIGITS, _MAX_DENOMINATOR = 12, 1000
#: Largest relative difference between a double and that fraction: two units in the last place.
_MAX_RELATIVE_ERROR = 2.0**-51

#: Most products of terms that are not counted, and terms of a sum that count as one product.
_MAX_UNCOUNTED_PRODUCTS, _TERMS_PER_PRODUCT = 8, 32

Coefficient = Fraction | float
#: Atoms and their powers, in the order in which the atoms were created.
Monomial = tuple[tuple["Atom", int], ...]
Terms = dict[Monomial, Coefficient]


class Atom:
    """Indeterminate of a polynomial: a symbol, or a function `op` of formulas."""

    __slots__ = ("args", "book", "name", "op", "order", "value")

    def __init__(
        self, book: SymbolTable, op: str, args: tuple[Formula, ...], value: float, name: str = ""
    ) -> None:
        self.book, self.op, self.args, self.value, self.name = book, op, args, value, name
        self.order = book.next_order()


class SymbolTable:
    """Table of the atoms of one derivation, each stored once.

    Raises SceneError when the sums and products of a derivation need more than `most` products of
    terms.
    """

    def __init__(self, most: int) -> None:
        self._max_products, self._products, self._atom_count = most, 0, 0
        self._atoms: dict[object, Atom] = {}

    def symbol(self, name: str, value: float) -> Formula:
        """Create a symbol with its value."""
        return Formula(value, {((Atom(self, "symbol", (), value, name), 1),): Fraction(1)})

    def atom(self, op: str, args: tuple[Formula, ...], value: float) -> Atom:
        """Atom of the function `op` of formulas, created at the first call."""
        key = (op, *(frozenset(x.terms.items()) for x in args))
        if key not in self._atoms:
            self._atoms[key] = Atom(self, op, args, value)
        return self._atoms[key]

    def next_order(self) -> int:
        """Reserve the order number of the next atom."""
        self._atom_count += 1
        return self._atom_count

    def count_products(self, products: int) -> None:
        """Count products of terms before they are computed; raise SceneError above the limit."""
        self._products += products
        if self._products > self._max_products:
            raise SceneError(
                f"formulas: {self._products} products of terms exceed the limit of "
                f"{self._max_products}; keep fewer names as symbols, or use a smaller scene"
            )


class OrderedByValue:
    """Number whose order is that of its `value`."""

    __slots__ = ()
    value: float

    def __lt__(self, other: Any) -> bool:
        return self.value < value_of(other)

    def __le__(self, other: Any) -> bool:
        return self.value <= value_of(other)

    def __gt__(self, other: Any) -> bool:
        return self.value > value_of(other)

    def __ge__(self, other: Any) -> bool:
        return self.value >= value_of(other)


class Formula(OrderedByValue):
    """Number `value` with the terms of the polynomial that gives it.

    Ordered by value.  A Formula equals a float only where it contains no symbol, so that a formula
    whose value is zero is no structural zero.
    """

    __slots__ = ("terms", "value")

    def __init__(self, value: float, terms: Terms) -> None:
        self.value, self.terms = value, terms

    @property
    def is_constant(self) -> bool:
        """Whether the formula contains no symbol."""
        return not self.terms or (len(self.terms) == 1 and () in self.terms)

    def __bool__(self) -> bool:
        return not self.is_constant or self.value != 0

    def __eq__(self, other: object) -> bool:
        if isinstance(other, Formula):
            return self.value == other.value and self.terms == other.terms
        return self.is_constant and self.value == other

    def __hash__(self) -> int:
        return hash(self.value)

    def __neg__(self) -> Formula:
        return Formula(-self.value, _scale(self.terms, -1))

    def __abs__(self) -> Formula:
        return -self if math.copysign(1.0, self.value) < 0 else self

    def __add__(self, other: Any) -> Formula:
        return Formula(self.value + value_of(other), _add_scaled(self.terms, _terms_of(other), 1))

    __radd__ = __add__

    def __sub__(self, other: Any) -> Formula:
        return Formula(self.value - value_of(other), _add_scaled(self.terms, _terms_of(other), -1))

    def __rsub__(self, other: float) -> Formula:
        return Formula(other - self.value, _add_scaled(_terms_of(other), self.terms, -1))

    def __mul__(self, other: Any) -> Formula:
        return Formula(self.value * value_of(other), _multiply(self.terms, _terms_of(other)))

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Formula:
        divisor = formula(other)
        return Formula(self.value / divisor.value, _multiply(self.terms, _invert(divisor)))

    def __rtruediv__(self, other: float) -> Formula:
        return formula(other) / self


def formula(number: Any) -> Formula:
    """Convert a number to a Formula; a Formula is returned unchanged."""
    return number if isinstance(number, Formula) else Formula(float(number), _terms_of(number))


def value_of(number: Any) -> float:
    """Value of a formula or a plain number as a float."""
    return number.value if isinstance(number, Formula) else float(number)


def factor_of_symbol(x: Formula, symbol: Formula) -> Formula:
    """Factor of a symbol in a formula x that is linear in it; the value of the symbol is 1."""
    ((((atom, _),), _),) = symbol.terms.items()
    terms = {
        tuple(factor for factor in monomial if factor[0] is not atom): c
        for monomial, c in x.terms.items()
        if (atom, 1) in monomial
    }
    return Formula(x.value, terms)


@lru_cache(maxsize=4096)
def to_exact(x: float) -> Coefficient:
    """Short decimal or simple fraction nearest to a double within rounding, else the double."""
    if not math.isfinite(x):
        return x
    for fraction in (
        Fraction(f"{x:.{_MAX_DECIMAL_DIGITS}g}"),
        Fraction(x).limit_denominator(_MAX_DENOMINATOR),
    ):
        if abs(fraction) < 2**1000 and abs(float(fraction) - x) <= _MAX_RELATIVE_ERROR * abs(x):
            return fraction
    return x


# Below, results are Formulas.  They are typed as Any because scene numbers are typed as floats.


# --- functions ------------------------------------------------------------------------------------


def square_root(x: Formula, value: float | None = None) -> Formula:
    """Square root of a formula; the root of a single even term is that term, with its sign."""
    root_value = math.sqrt(x.value) if value is None else value
    if x.is_constant:
        return Formula(root_value, _constant_terms(to_exact(root_value)))
    even_terms = _even_root(x)
    return Formula(
        root_value, _atom_terms("sqrt", (x,), root_value) if even_terms is None else even_terms
    )


def apply_function(op: str, args: tuple[Formula, ...], value: float) -> Any:
    """Function of formulas by its name in the IR, with its known value."""
    if all(x.is_constant for x in args):
        return Formula(value, _constant_terms(to_exact(value)))
    return Formula(value, _atom_terms(op, args, value))


def sum_with_value(numbers: Sequence[Any], value: float) -> Any:
    """Sum of numbers with its known value."""
    terms: Terms = {}
    for number in numbers:
        terms = _add_scaled(terms, _terms_of(number), 1)
    return Formula(value, terms)


def vector_length(numbers: Sequence[Any], value: float) -> Any:
    """Euclidean length of a vector, with its known value."""
    squares = [formula(x) * x for x in numbers]
    return square_root(sum_with_value(squares, sum(x.value for x in squares)), value)


def cos_sin_with_values(angle: Formula, cosine: float, sine: float) -> tuple[Any, Any]:
    """Cosine and sine of an angle (rad), with their known values."""
    return apply_function("cos", (angle,), cosine), apply_function("sin", (angle,), sine)


def unit_vector_with_values(v: Sequence[Any], values: Sequence[float]) -> tuple[Any, ...]:
    """Unit vector v / |v|, with its known values."""
    length = vector_length(v, math.hypot(*map(value_of, v)))
    return tuple(Formula(n, (formula(x) / length).terms) for x, n in zip(v, values, strict=True))


# --- polynomials ----------------------------------------------------------------------------------


def _terms_of(number: Any) -> Terms:
    return number.terms if isinstance(number, Formula) else _constant_terms(to_exact(float(number)))


def _constant_terms(coefficient: Coefficient) -> Terms:
    return {(): coefficient} if coefficient else {}


def _scale(terms: Terms, factor: Coefficient) -> Terms:
    return {monomial: factor * c for monomial, c in terms.items()}


def _add_scaled(a: Terms, b: Terms, sign: int) -> Terms:
    if len(a) + len(b) > _TERMS_PER_PRODUCT:
        _table_of(a if len(a) > 1 else b).count_products((len(a) + len(b)) // _TERMS_PER_PRODUCT)
    terms = dict(a)
    _accumulate(terms, b, sign)
    return terms


def _accumulate(found: Terms, more: Terms, factor: Coefficient) -> None:
    """Add terms times a factor to the terms found, in place."""
    for monomial, c in more.items():
        coefficient = found.get(monomial, 0) + factor * c
        if coefficient:
            found[monomial] = coefficient
        else:
            found.pop(monomial, None)


def _multiply(a: Terms, b: Terms) -> Terms:
    if len(a) * len(b) > _MAX_UNCOUNTED_PRODUCTS:
        _table_of(a if len(a) > 1 else b).count_products(len(a) * len(b))
    terms: Terms = {}
    for left, c in a.items():
        for right, d in b.items():
            monomial = _merge_monomials(left, right) if left and right else left or right
            if all(map(_is_normal, monomial)):
                _accumulate(terms, {monomial: c}, d)
            else:
                _accumulate(terms, _normalise(monomial), c * d)
    return terms


def _merge_monomials(a: Monomial, b: Monomial) -> Monomial:
    powers = dict(a)
    for atom, power in b:
        powers[atom] = powers.get(atom, 0) + power
    return tuple(sorted(((x, p) for x, p in powers.items() if p), key=_atom_index))


def _atom_index(factor: tuple[Atom, int]) -> int:
    return factor[0].order


def _is_normal(factor: tuple[Atom, int]) -> bool:
    atom, power = factor
    if atom.op == "sin":
        return power < 2
    if atom.op == "sqrt":
        return power == 1
    return atom.op != "inverse" or power > 0


def _normalise(monomial: Monomial) -> Terms:
    """Resolve powers of sin, sqrt and inverse in a product: its normal form."""
    normal_factors = tuple(factor for factor in monomial if _is_normal(factor))
    terms: Terms = {normal_factors: Fraction(1)}
    for atom, power in monomial:
        if _is_normal((atom, power)):
            continue
        (arg,) = atom.args
        if atom.op == "sin":
            cos = ((atom.book.atom("cos", (arg,), math.cos(arg.value)), 2),)
            square: Terms = {(): Fraction(1), cos: Fraction(-1)}
            remaining_power = power % 2
            terms = _multiply(terms, _raise_to_power(square, power // 2))
        elif atom.op == "sqrt":
            half, remaining_power = divmod(power, 2)
            base = arg.terms if half >= 0 else _invert(arg)
            terms = _multiply(terms, _raise_to_power(base, abs(half)))
        else:
            terms, remaining_power = _multiply(terms, _raise_to_power(arg.terms, -power)), 0
        if remaining_power:
            terms = _multiply(terms, {((atom, 1),): Fraction(1)})
    return terms


def _raise_to_power(base: Terms, exponent: int) -> Terms:
    terms: Terms = {(): Fraction(1)}
    for _ in range(exponent):
        terms = _multiply(terms, base)
    return terms


def _invert(x: Formula) -> Terms:
    """1 / x: of one term its powers turned round, of a sum an atom.

    Raises ZeroDivisionError for what is zero whatever the symbols are.
    """
    if x.is_constant:
        return _constant_terms(_reciprocal(x.terms.get((), Fraction(0))))
    (monomial, c), *monomial_terms = x.terms.items()
    if not monomial_terms:
        inverted = tuple((atom, -power) for atom, power in monomial)
        if all(map(_is_normal, inverted)):
            return {inverted: _reciprocal(c)}
        return _scale(_normalise(inverted), _reciprocal(c))
    leading = _reciprocal(c)
    monic = Formula(x.value * float(leading), _scale(x.terms, leading))
    return _scale(
        _atom_terms("inverse", (monic,), 1 / monic.value if monic.value else math.inf), leading
    )


def _reciprocal(c: Coefficient) -> Coefficient:
    return 1 / c if isinstance(c, Fraction) else to_exact(1 / c)


def _even_root(x: Formula) -> Terms | None:
    """Square root of a single term with even powers; None for anything else."""
    if len(x.terms) > 1:
        return None
    ((monomial, c),) = x.terms.items()
    halves = tuple((atom, power // 2) for atom, power in monomial)
    size = math.prod(atom.value**power for atom, power in halves if atom.value or power > 0)
    if c < 0 or size == 0 or any(power % 2 for _, power in monomial):
        return None
    return {halves: to_exact(math.copysign(math.sqrt(c), size))}


def _atom_terms(op: str, args: tuple[Formula, ...], value: float) -> Terms:
    table = next(_table_of(x.terms) for x in args if not x.is_constant)
    return {((table.atom(op, args, value), 1),): Fraction(1)}


def _table_of(terms: Terms) -> SymbolTable:
    """Atom table of terms, at least one of which contains an atom."""
    return next(monomial[0][0].book for monomial in terms if monomial)
