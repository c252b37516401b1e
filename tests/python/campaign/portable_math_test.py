"""The functions of draws and derived values are compared with a second computation by fractions, in
which nothing but the last step is rounded to a double."""

import math
import random
import re
from fractions import Fraction
from itertools import takewhile

import campaign_support as support
import pytest

from sls.campaign import portable_math

SOURCES = support.HERE.parents[2]
NUMBERS = 300  # arguments of each test
BITS = 400  # of the numbers that are rounded on the way, because fractions grow with every product


def shorten(number, divisor=1):
    """`number / divisor` with BITS leading bits."""
    above, below = number.numerator, number.denominator * divisor
    shift = BITS - (above.bit_length() - below.bit_length())
    if shift < 0:
        return Fraction(above // (below << -shift) << -shift)
    return Fraction((above << shift) // below, 1 << shift)


def sum_terms(make_terms):
    return sum(takewhile(lambda term: abs(term) > Fraction(1, 2**BITS), make_terms))


def powers(x, step, first):
    """x^first / first!, x^(first + step) / (first + step)!, …"""
    term, factor, n = Fraction(x) ** first / math.factorial(first), Fraction(x) ** step, first
    while True:
        yield term
        term = shorten(term * factor, math.prod(range(n + 1, n + 1 + step)))
        n += step


def calc_exp(x):
    """By the power series of a small part of x, squared."""
    halvings = 12
    y = shorten(sum_terms(powers(Fraction(x) / 2**halvings, 1, 0)))
    for _ in range(halvings):
        y = shorten(y * y)
    return y


def calc_sin(x, first=1):
    """By the power series alone: its terms fall from the (|x| / 2)th on. `first` = 0: the cosine."""
    terms = [term for term, _ in zip(powers(x, 2, first), range(30 + 3 * int(abs(x))))]
    return sum(terms[::2]) - sum(terms[1::2])


def calc_pi():
    """By Euler's formula π/4 = atan(1/2) + atan(1/3)."""
    def calc_arctangent(inverse):
        return sum(Fraction((-1) ** k, (2 * k + 1) * inverse ** (2 * k + 1)) for k in range(220))
    return shorten(4 * (calc_arctangent(2) + calc_arctangent(3)))


def calc_root(x):
    return Fraction(math.isqrt(int(x * 4**BITS)), 2**BITS)


ROOT_OF_TWO_PI = calc_root(2 * calc_pi())


def calc_normal_cdf(x):
    """By the power series of the density; beyond 6 by Laplace's continued fraction for the tail."""
    x = Fraction(x)
    if abs(x) > 6:
        fraction = abs(x)
        for k in range(400, 0, -1):
            fraction = shorten(abs(x) + k / fraction)
        tail = calc_exp(-x * x / 2) / ROOT_OF_TWO_PI / fraction
        return tail if x < 0 else 1 - tail
    terms = (x * term / (2 * k + 1) for k, term in enumerate(powers(-x * x / 2, 1, 0)))
    return Fraction(1, 2) + sum(term for term, _ in zip(terms, range(200))) / ROOT_OF_TWO_PI


def draw_numbers(low, high, seed, count=NUMBERS):
    generator = random.Random(seed)
    return [generator.uniform(low, high) for _ in range(count)]


def is_nearest(number, calc_exact):
    """True if `number` is the double nearest to a value that is above `calc_exact` of what is half a
    double lower and below that of half a double higher."""
    half = Fraction(math.ulp(number)) / 2
    low, high = calc_exact(Fraction(number) - half), calc_exact(Fraction(number) + half)
    return lambda value: low < value < high


def test_exp_is_the_nearest_double():
    for x in [*draw_numbers(-745, 709, 1), *draw_numbers(-1, 1, 2), 0.0, 1.0, 1e-300, -1e-20]:
        assert portable_math.exp(x) == float(calc_exp(x)), x


def test_log_is_the_nearest_double():
    for x in [*map(math.exp, draw_numbers(-700, 700, 3)), *draw_numbers(0.9, 1.1, 4), 5e-324]:
        assert is_nearest(portable_math.log(x), calc_exp)(Fraction(x)), x
    assert portable_math.log(1.0) == 0.0


def test_powers_are_the_nearest_doubles():
    for base, exponent in zip(draw_numbers(-10, 10, 5), range(-150, 150)):
        assert portable_math.power(base, float(exponent)) == float(Fraction(base) ** exponent)
    for base, quarters in zip(draw_numbers(0, 10, 6), range(-150, 150)):
        if quarters:
            result = portable_math.power(base, quarters / 4)
            assert is_nearest(result, lambda x: x**4)(Fraction(base) ** quarters), (base, quarters)
    assert portable_math.power(0.0, 0.0) == portable_math.power(1.0, math.inf) == 1.0
    assert portable_math.power(0.0, 2.5) == 0.0


def test_sine_cosine_and_tangent_are_the_nearest_doubles():
    near = [k * math.pi / 2 for k in range(-12, 13)]
    for x in [*draw_numbers(-20, 20, 7, 100), *draw_numbers(-1e-7, 1e-7, 8, 20), *near, 0.0, 1e-300]:
        sine, cosine = calc_sin(Fraction(x)), calc_sin(Fraction(x), first=0)
        assert portable_math.sin(x) == float(sine), x
        assert portable_math.cos(x) == float(cosine), x
        assert portable_math.tan(x) == float(sine / cosine), x


def test_large_angles_have_their_published_sine():
    """Sources: Ng, Argument reduction for huge arguments (1992); Muller, Elementary functions, for the
    double that is nearest to a multiple of π/2."""
    assert portable_math.sin(1e22) == -0.8522008497671888018
    assert portable_math.cos(1e22) == 0.5232147853951389455
    assert portable_math.cos(math.ldexp(6381956970095103, 797)) == -4.68716592425462761112e-19


def test_the_normal_distribution_is_the_nearest_double():
    for x in [*draw_numbers(-9, 9, 9, 150), *draw_numbers(-38, -9, 10, 25), 0.0, -38.4]:
        assert portable_math.calc_normal_cdf(x) == float(calc_normal_cdf(x)), x
    assert portable_math.calc_normal_cdf(-50.0) == 0.0
    assert portable_math.calc_normal_cdf(50.0) == 1.0


def test_the_quantile_inverts_the_normal_distribution():
    """AS 241 promises a relative error of about 1e-16. Its rounded polynomials add some more."""
    shares = [*draw_numbers(0, 1, 11, 100), *map(math.exp, draw_numbers(-690, -2, 12, 25)), 2.0**-53]
    for share in shares:
        x = Fraction(portable_math.calc_normal_quantile(share))
        ends = [calc_normal_cdf(x * (1 + sign * Fraction(1, 10**15))) for sign in (-1, 1)]
        assert min(ends) < Fraction(share) < max(ends), share
    assert portable_math.calc_normal_quantile(0.5) == 0.0
    assert portable_math.calc_normal_quantile(0.25) == -portable_math.calc_normal_quantile(0.75)


@pytest.mark.parametrize("call, error", [
    (lambda: portable_math.exp(710.0), OverflowError),
    (lambda: portable_math.exp(math.inf), OverflowError),
    (lambda: portable_math.exp(math.nan), ValueError),
    (lambda: portable_math.log(0.0), ValueError),
    (lambda: portable_math.log(-1.0), ValueError),
    (lambda: portable_math.log(math.nan), ValueError),
    (lambda: portable_math.power(9.0, 9.0**9), OverflowError),
    (lambda: portable_math.power(0.0, -1.0), ZeroDivisionError),
    (lambda: portable_math.power(-1.5, 0.5), ValueError),
    (lambda: portable_math.power(math.nan, 2.0), ValueError),
    (lambda: portable_math.sin(math.inf), ValueError),
    (lambda: portable_math.cos(math.nan), ValueError),
    (lambda: portable_math.tan(math.inf), ValueError),
    (lambda: portable_math.calc_normal_quantile(0.0), ValueError),
    (lambda: portable_math.calc_normal_quantile(1.0), ValueError),
])
def test_fails_as_the_functions_of_python_do(call, error):
    with pytest.raises(error):
        call()


def test_values_of_runs_call_no_function_of_the_c_library():
    """`math` has functions with one result only, such as sqrt; the others differ with the machine."""
    exact = {"ceil", "floor", "frexp", "inf", "isfinite", "isinf", "isnan", "pi", "prod", "sqrt"}
    for name in ("campaign_file", "check", "expressions", "portable_math", "sampling"):
        text = (SOURCES / f"python/sls/campaign/{name}.py").read_text()
        used = set(re.findall(r"\bmath\.(\w+)", text))
        assert used <= exact, name
        assert not re.search(r"\bnp\.(exp|log|sin|cos|tan|power|hypot|sum|mean|dot)\b", text), name
        assert "NormalDist" not in text, name
