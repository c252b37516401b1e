"""Functions with the same bits on every processor and with every version of Python, numpy and the C
library. `math` calls the C library, which rounds differently with other instructions.

These functions use operations with one result only: + - * / and the square root of doubles (IEEE 754),
whole numbers of any size, and `exp` and `ln` of `decimal`, which its specification rounds correctly
(General Decimal Arithmetic). They compute with more digits than a double and round once at the
end. This gives the nearest double, unless the exact value is within 1e-40 of the middle of two.

The errors are those of `math`: ValueError where a function is not defined, OverflowError where its value
is too large."""

import math
from decimal import MAX_EMAX, MIN_EMIN, Context, Decimal
from functools import lru_cache

DIGITS = 60
BITS = 256  # of an angle after the point; the nearest double to a multiple of π/2 is 2^-61 away
CONTEXT = Context(prec=DIGITS, Emax=MAX_EMAX, Emin=MIN_EMIN)
LARGEST_EXPONENT = 800  # exp(800) is above the largest double, exp(-800) below half the smallest


def exp(x: float) -> float:
    if math.isnan(x):
        raise ValueError("expected a number, got nan")
    return _to_float(_exp(Decimal(x)))


def log(x: float) -> float:
    if not x > 0:
        raise ValueError(f"expected > 0, got {x!r}")
    return float(CONTEXT.ln(Decimal(x)))


def power(base: float, exponent: float) -> float:
    """`base` to the power of `exponent`. A negative base needs a whole exponent.

    Raises ZeroDivisionError for a negative power of 0."""
    if exponent == 0 or base == 1:
        return 1.0
    if base == 0:
        if exponent < 0:
            raise ZeroDivisionError("a negative power of 0")
        return 0.0
    if math.isnan(base) or math.isnan(exponent):
        raise ValueError(f"expected numbers, got {base!r} and {exponent!r}")
    if base < 0 and not exponent.is_integer():
        raise ValueError(f"expected a whole exponent of {base!r}, got {exponent!r}")
    size = _to_float(_exp(CONTEXT.multiply(Decimal(exponent), CONTEXT.ln(Decimal(abs(base))))))
    return -size if base < 0 and exponent % 2 == 1 else size


def sin(x: float) -> float:
    return x if abs(x) < 2.0**-27 else _calc_sine(*_reduce(x)) / 2**BITS


def cos(x: float) -> float:
    quadrant, rest = _reduce(x)
    return _calc_sine(quadrant + 1, rest) / 2**BITS


def tan(x: float) -> float:
    if abs(x) < 2.0**-27:
        return x
    quadrant, rest = _reduce(x)
    return _calc_sine(quadrant, rest) / _calc_sine(quadrant + 1, rest)


@lru_cache(maxsize=256)
def calc_normal_cdf(x: float) -> float:
    """Φ(x), the share of the standard normal distribution below `x`, by the series of Marsaglia (2004):
    Φ(x) = 1/2 + φ(x) (x + x³/3 + x⁵/(3·5) + x⁷/(3·5·7) + …)."""
    if abs(x) > 40:  # Φ(-40) is below the smallest double
        return 0.0 if x < 0 else 1.0
    # Below 0 the terms cancel except for a share of about exp(-x²/2): 350 digits for x = -40.
    context = Context(prec=DIGITS + int(0.22 * x * x), Emax=MAX_EMAX, Emin=MIN_EMIN)
    exact = Decimal(x)
    square = context.multiply(exact, exact)
    term = total = exact
    factor = 1
    while term and total.adjusted() - term.adjusted() <= context.prec:
        factor += 2
        term = context.divide(context.multiply(term, square), Decimal(factor))
        total = context.add(total, term)
    two_pi = context.divide(Decimal(2 * _calc_pi(4 * context.prec)),
                            Decimal(2**(4 * context.prec)))
    density = context.divide(context.exp(context.divide(square, Decimal(-2))),
                             context.sqrt(two_pi))
    return float(context.add(Decimal("0.5"), context.multiply(density, total)))


def calc_normal_quantile(share: float) -> float:
    """Φ⁻¹(`share`), relative error about 1e-16. Source: Wichura (1988), Algorithm AS 241 (PPND16),
    Applied Statistics 37, 477.

    `share`: above 0, below 1; else ValueError."""
    if not 0 < share < 1:
        raise ValueError(f"expected a share between 0 and 1, got {share!r}")
    q = share - 0.5
    if abs(q) <= 0.425:
        r = 0.180625 - q * q
        return q * _sum_powers(CENTRE_ABOVE, r) / _sum_powers(CENTRE_BELOW, r)
    r = math.sqrt(-log(share if q < 0 else 1 - share))
    if r <= 5:
        size = _sum_powers(TAIL_ABOVE, r - 1.6) / _sum_powers(TAIL_BELOW, r - 1.6)
    else:
        size = _sum_powers(FAR_ABOVE, r - 5) / _sum_powers(FAR_BELOW, r - 5)
    return -size if q < 0 else size


# Coefficients of AS 241 from the highest power down, above and below the line of the fraction.
CENTRE_ABOVE = (2.5090809287301226727e3, 3.3430575583588128105e4, 6.7265770927008700853e4,
                4.5921953931549871457e4, 1.3731693765509461125e4, 1.9715909503065514427e3,
                1.3314166789178437745e2, 3.3871328727963666080e0)
CENTRE_BELOW = (5.2264952788528545610e3, 2.8729085735721942674e4, 3.9307895800092710610e4,
                2.1213794301586595867e4, 5.3941960214247511077e3, 6.8718700749205790830e2,
                4.2313330701600911252e1, 1.0)
TAIL_ABOVE = (7.74545014278341407640e-4, 2.27238449892691845833e-2, 2.41780725177450611770e-1,
              1.27045825245236838258e0, 3.64784832476320460504e0, 5.76949722146069140550e0,
              4.63033784615654529590e0, 1.42343711074968357734e0)
TAIL_BELOW = (1.05075007164441684324e-9, 5.47593808499534494600e-4, 1.51986665636164571966e-2,
              1.48103976427480074590e-1, 6.89767334985100004550e-1, 1.67638483018380384940e0,
              2.05319162663775882187e0, 1.0)
FAR_ABOVE = (2.01033439929228813265e-7, 2.71155556874348757815e-5, 1.24266094738807843860e-3,
             2.65321895265761230930e-2, 2.96560571828504891230e-1, 1.78482653991729133580e0,
             5.46378491116411436990e0, 6.65790464350110377720e0)
FAR_BELOW = (2.04426310338993978564e-15, 1.42151175831644588870e-7, 1.84631831751005468180e-5,
             7.86869131145613259100e-4, 1.48753612908506148525e-2, 1.36929880922735805310e-1,
             5.99832206555887937690e-1, 1.0)


def _sum_powers(coefficients: tuple[float, ...], x: float) -> float:
    """The polynomial of x. The loop keeps every product and sum a rounded double: a processor's fused
    multiplication and addition, which rounds once for both, is not possible in Python."""
    total = 0.0
    for coefficient in coefficients:
        total = total * x + coefficient
    return total


def _exp(x: Decimal) -> Decimal:
    """exp(x); for |x| far beyond doubles that of a nearer x, whose double is inf or 0 too."""
    limit = Decimal(LARGEST_EXPONENT)
    return CONTEXT.exp(max(min(x, limit), -limit))


def _to_float(x: Decimal) -> float:
    value = float(x)
    if math.isinf(value):
        raise OverflowError("too large for a double")
    return value


@lru_cache(maxsize=8)
def _calc_pi(bits: int) -> int:
    """π · 2^bits, rounded down, by Machin's formula: π = 16 atan(1/5) - 4 atan(1/239)."""
    def calc_arctangent(inverse: int) -> int:
        term = total = (1 << bits + 32) // inverse
        divisor = 1
        while term:
            term = -term // inverse**2
            divisor += 2
            total += term // divisor
        return total

    return 16 * calc_arctangent(5) - 4 * calc_arctangent(239) >> 32


def _reduce(x: float) -> tuple[int, int]:
    """Quadrant and rest · 2^BITS: x = quadrant · π/2 + rest, |rest| ≤ π/4."""
    if not math.isfinite(x):
        raise ValueError(f"expected a finite angle, got {x!r}")
    numerator, denominator = x.as_integer_ratio()
    # π is needed with as many more bits as the quadrant has.
    bits = BITS + max(0, math.frexp(x)[1])
    scaled = (numerator << bits) // denominator
    half_turn = _calc_pi(bits)  # 2 · π/2
    quadrant = (4 * scaled + half_turn) // (2 * half_turn)
    return quadrant, 2 * scaled - quadrant * half_turn >> bits - BITS + 1


def _calc_sine(quadrant: int, rest: int) -> int:
    """sin(quadrant · π/2 + rest / 2^BITS) · 2^BITS, by its power series."""
    square = rest * rest >> BITS
    term, factor = (1 << BITS, 0) if quadrant % 2 else (rest, 1)
    total = term
    while term not in (0, -1):  # shifts round down
        term = -(term * square >> BITS) // ((factor + 1) * (factor + 2))
        factor += 2
        total += term
    return -total if quadrant % 4 >= 2 else total
