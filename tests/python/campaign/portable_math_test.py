"""The functions of draws and derived values are compared with mpmath's of 400 bits, rounded once to a double."""

import math
import random
import re

import mpmath
import pytest
from mpmath import mpf
from places import ROOT

from sls.campaign import portable_math

NUMBERS = 300  # arguments of each test
mpmath.mp.prec = 400


def draw_numbers(low, high, seed, count=NUMBERS):
    generator = random.Random(seed)
    return [generator.uniform(low, high) for _ in range(count)]


def test_exp_is_the_nearest_double():
    for x in [*draw_numbers(-745, 709, 1), *draw_numbers(-1, 1, 2), 0.0, 1.0, 1e-300, -1e-20]:
        assert portable_math.exp(x) == float(mpmath.exp(x)), x


def test_log_is_the_nearest_double():
    for x in [*map(math.exp, draw_numbers(-700, 700, 3)), *draw_numbers(0.9, 1.1, 4), 5e-324]:
        assert portable_math.log(x) == float(mpmath.log(x)), x
    assert portable_math.log(1.0) == 0.0


def test_powers_are_the_nearest_doubles():
    for base, exponent in zip(draw_numbers(-10, 10, 5), range(-150, 150)):
        assert portable_math.power(base, float(exponent)) == float(mpf(base) ** exponent)
    for base, quarters in zip(draw_numbers(0, 10, 6), range(-150, 150)):
        assert portable_math.power(base, quarters / 4) == float(mpf(base) ** (quarters / 4)), (base, quarters)
    assert portable_math.power(0.0, 0.0) == portable_math.power(1.0, math.inf) == 1.0
    assert portable_math.power(0.0, 2.5) == 0.0


def test_sine_cosine_and_tangent_are_the_nearest_doubles():
    near = [k * math.pi / 2 for k in range(-12, 13)]
    for x in [*draw_numbers(-20, 20, 7, 100), *draw_numbers(-1e-7, 1e-7, 8, 20), *near, 0.0, 1e-300]:
        for name in ("sin", "cos", "tan"):
            assert getattr(portable_math, name)(x) == float(getattr(mpmath, name)(x)), (name, x)


def test_large_angles_have_their_published_sine():
    """Sources: Ng, Argument reduction for huge arguments (1992); Muller, Elementary functions, for the
    double that is nearest to a multiple of π/2."""
    assert portable_math.sin(1e22) == -0.8522008497671888018
    assert portable_math.cos(1e22) == 0.5232147853951389455
    assert portable_math.cos(math.ldexp(6381956970095103, 797)) == -4.68716592425462761112e-19


def test_the_normal_distribution_is_the_nearest_double():
    for x in [*draw_numbers(-9, 9, 9, 150), *draw_numbers(-38, -9, 10, 25), 0.0, -38.4]:
        assert portable_math.calc_normal_cdf(x) == float(mpmath.ncdf(x)), x
    assert portable_math.calc_normal_cdf(-50.0) == 0.0
    assert portable_math.calc_normal_cdf(50.0) == 1.0


def test_the_quantile_inverts_the_normal_distribution():
    """AS 241 promises a relative error of about 1e-16. Its rounded polynomials add some more."""
    shares = [*draw_numbers(0, 1, 11, 100), *map(math.exp, draw_numbers(-690, -2, 12, 25)), 2.0**-53]
    for share in shares:
        x = mpf(portable_math.calc_normal_quantile(share))
        ends = [mpmath.ncdf(x * (1 + sign * mpf(10)**-15)) for sign in (-1, 1)]
        assert min(ends) < share < max(ends), share
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
        text = (ROOT / f"python/sls/campaign/{name}.py").read_text()
        used = set(re.findall(r"\bmath\.(\w+)", text))
        assert used <= exact, name
        assert not re.search(r"\bnp\.(exp|log|sin|cos|tan|power|hypot|sum|mean|dot)\b", text), name
        assert "NormalDist" not in text, name
