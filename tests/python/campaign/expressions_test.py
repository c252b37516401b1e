"""Arithmetic of campaign files, compared with Python's arithmetic and with closed forms."""

import math
import pickle

import pytest

from sls.campaign.expressions import Expression, ExpressionError

VALUES = {"a": 1.5, "vehicle.load_mass_kg": 0.2, "mission.0.figure_eight.amplitude_m.1": 0.75,
          "_speed": 3, "pi_is_another": 7.0}


@pytest.mark.parametrize("text, expected", [
    ("2", 2.0),
    ("1e-3 + .5", 0.501),
    ("-2 ** 2", -4.0),
    ("2 ** -1", 0.5),
    ("2 ** 3 ** 2", 512.0),
    ("8 / 4 / 2", 1.0),
    ("7 - 2 - 1", 4.0),
    ("2 + 3 * (4 - 1)", 11.0),
    ("vehicle.load_mass_kg * 1.1 + 0.01", 0.2 * 1.1 + 0.01),
    ("mission.0.figure_eight.amplitude_m.1*2", 1.5),
    ("_speed/2 - +a", 0.0),
    ("pi_is_another", 7.0),
    ("sin(pi / 6)", math.sin(math.pi / 6)),
    ("cos (pi)", -1.0),
    ("tan(pi/4)", math.tan(math.pi / 4)),
    ("exp(log(5))", math.exp(math.log(5))),
    ("sqrt(_speed ** 2 + 4 ** 2)", 5.0),
    ("abs(-3)", 3.0),
    ("min(a, _speed, 2) + max(a, 1)", 3.0),
    ("1 +\n 2", 3.0),
])
def test_evaluates(text, expected):
    assert Expression(text).evaluate(VALUES) == expected


def test_lists_its_names_once():
    assert Expression("_b * a.0.c + _b ** 2 + pi + sqrt(a)").names == ["_b", "a.0.c", "a"]


@pytest.mark.parametrize("text", [
    "", " ", "1 +", "(1", "1)", "2 a", "1 2", "a.", ".a", "a..b", "1, 2", "()", "a = 1", "a == 1",
    "a < 1", "a and 1", "lambda: 1", "a if 1 else 2", "[1]", "{1}", "a[0]", "'a'", "7 // 2",
    "7 % 2", "~1", "1 @ 2", "f'1'", "a := 1", "__import__('os')", "open(1)", "sqrt()", "sqrt(1, 2)",
    "max(1)", "sqrt(x=1)", "sqrt(*a)", "sqrt(1)(2)", "1e400", "0x10", "1_000", "a" * 2000,
    "(" * 400 + "1" + ")" * 400, "-" * 990 + "1", "1j", "True(1)", "a\\b", "a;b", "é", "(1\n",
])
def test_refuses_all_but_arithmetic(text):
    with pytest.raises(ExpressionError) as error:
        Expression(text)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("text, message", [
    ("1 / (a - 1.5)", "division by zero in '1 / (a - 1.5)'"),
    ("0 ** -1", "division by zero in '0 ** -1'"),
    ("sqrt(-a)", "'sqrt(-a)' is not defined"),
    ("log(0)", "'log(0)' is not defined"),
    ("(-a) ** 0.5", "'(-a) ** 0.5' is not defined"),
    ("max((-a) ** 0.5, 1)", "'max((-a) ** 0.5, 1)' is not defined"),
    ("9 ** 9 ** 9", "'9 ** 9 ** 9' is too large"),
    ("1e308 * 10", "'1e308 * 10' is not a finite number"),
    ("min(1e308 * 10, 1)", "'min(1e308 * 10, 1)' is not a finite number"),
    ("max(1, 1 / (1e308 + 1e308))", "'max(1, 1 / (1e308 + 1e308))' is not a finite number"),
])
def test_names_what_has_no_value(text, message):
    with pytest.raises(ExpressionError) as error:
        Expression(text).evaluate(VALUES)
    assert str(error.value) == message


@pytest.mark.parametrize("value", ["pid", True, [1, 2], None])
def test_refuses_names_of_what_is_no_number(value):
    with pytest.raises(ExpressionError, match="expected a number of a, got "):
        Expression("a + 1").evaluate({"a": value})


def test_can_be_sent_to_another_process():
    expression = Expression("a * 2")
    sent = pickle.loads(pickle.dumps(expression))
    assert sent == expression
    assert sent.evaluate(VALUES) == 3.0
