"""Arithmetic of campaign files: `vehicle.load_mass_kg * 1.1 + 0.01`.

The language has numbers, names with dots, `+ - * / **`, parentheses, `pi` and the functions of
FUNCTIONS. Nothing else is evaluated. Values have the same bits on every machine: portable_math.py."""

import ast
import math
import re
from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from typing import TYPE_CHECKING

from sls.campaign import portable_math

if TYPE_CHECKING:
    import numpy as np

FUNCTIONS: dict[str, Callable[..., float]] = {
    "abs": abs, "cos": portable_math.cos, "exp": portable_math.exp, "log": portable_math.log,
    "max": max, "min": min, "sin": portable_math.sin, "sqrt": math.sqrt, "tan": portable_math.tan}
FEWEST_ARGUMENTS = {"max": 2, "min": 2}  # all others take exactly one


def check_finite(value: float) -> float:
    """Raises FloatingPointError; `max`, `min` or a division would hide what is not finite."""
    if not math.isfinite(value):
        raise FloatingPointError
    return value


SCOPE = {"__builtins__": {}, "power": portable_math.power, "check_finite": check_finite, **FUNCTIONS}
MOST_LETTERS = 1000
TOKEN = re.compile(r"\s+|(?P<name>[A-Za-z_][A-Za-z0-9_]*(?:\.[A-Za-z0-9_]+)*)"
                   r"|(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)"
                   r"|(?P<sign>\*\*|[-+*/(),])")


class ExpressionError(ValueError):
    """An error in an expression or its value. The message does not name file and line."""


class Expression:
    """A parsed expression. Every number in it is a float.

    Raises ExpressionError if the text is not arithmetic."""

    def __init__(self, text: str):
        text = self.text = " ".join(text.split())  # in one line, for messages
        self.names: list[str] = []  # names in the expression, each once, in order of appearance
        if len(text) > MOST_LETTERS:
            raise ExpressionError(f"expected at most {MOST_LETTERS} letters, got {len(text)}")
        try:
            tree = ast.parse(self._to_python(), mode="eval")
            self._check(tree.body)
            self._code = compile(ast.fix_missing_locations(_CallOperators().visit(tree)),
                                 "expression", "eval")
        except (SyntaxError, ValueError, MemoryError, RecursionError) as error:
            if isinstance(error, ExpressionError):
                raise
            raise ExpressionError(f"expected arithmetic, got '{text}'") from None

    def __reduce__(self) -> tuple[type, tuple[str]]:
        """Pickles the text, because compiled code cannot be sent to another process."""
        return Expression, (self.text,)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Expression) and other.text == self.text

    def __hash__(self) -> int:
        return hash(self.text)

    def _to_python(self) -> str:
        """The text with a plain identifier for each name, because a dot has another meaning in Python."""
        parts, at = [], 0
        text = self.text
        while at < len(text):
            token = TOKEN.match(text, at)
            if not token:
                raise ExpressionError(f"expected arithmetic, got '{text[at]}' in '{text}'")
            at = token.end()
            name = token["name"]
            if token["number"]:
                number = float(token["number"])
                if math.isinf(number):
                    raise ExpressionError(f"expected a finite number, got '{token['number']}'")
                parts.append(f" {number!r} ")
            elif name is None:
                parts.append(token["sign"] or " ")
            elif text[at:].lstrip().startswith("("):
                if name not in FUNCTIONS:
                    raise ExpressionError(f"unknown function '{name}'; known are "
                                          f"{', '.join(FUNCTIONS)}")
                parts.append(f" {name}")
            elif name == "pi":
                parts.append(f" {math.pi!r} ")
            else:
                if name not in self.names:
                    self.names.append(name)
                parts.append(f" name_{self.names.index(name)} ")
        return "".join(parts).strip()

    def _check(self, node: ast.expr) -> None:
        match node:
            case ast.Constant(value=float()) | ast.Name():
                parts = []
            case ast.BinOp(left=left, right=right,
                           op=ast.Add() | ast.Sub() | ast.Mult() | ast.Div() | ast.Pow()):
                parts = [left, right]
            case ast.UnaryOp(op=ast.UAdd() | ast.USub(), operand=operand):
                parts = [operand]
            case ast.Call(func=ast.Name(id=name), args=parts, keywords=[]):
                fewest = FEWEST_ARGUMENTS.get(name)
                if len(parts) < fewest if fewest else len(parts) != 1:
                    expected = f"at least {fewest} values" if fewest else "one value"
                    raise ExpressionError(f"{name}: expected {expected}, got {len(parts)}")
            case _:
                raise ExpressionError(f"expected arithmetic, got '{self.text}'")
        for part in parts:
            self._check(part)

    def evaluate(self, values: Mapping[str, float]) -> float:
        """The value of the expression with `values` for the names.

        Raises ExpressionError if it is not a finite number, or if one of `values` is not a number."""
        floats = []
        for name in self.names:
            value = values[name]
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise ExpressionError(f"expected a number of {name}, got {value!r}")
            floats.append(float(value))
        names = {f"name_{i}": value for i, value in enumerate(floats)}
        try:
            return check_finite(eval(self._code, SCOPE, names))  # arithmetic only: see _check
        except ZeroDivisionError:
            raise ExpressionError(f"division by zero in '{self.text}'") from None
        except FloatingPointError:
            raise ExpressionError(f"'{self.text}' is not a finite number") from None
        except OverflowError:
            raise ExpressionError(f"'{self.text}' is too large") from None
        except ValueError:  # for example the root of a negative number
            raise ExpressionError(f"'{self.text}' is not defined") from None

    def evaluate_rows(self, rows: "Sequence[np.ndarray]") -> "np.ndarray":
        """The value of each row. `rows` has a column of numbers for each of `names`.

        Raises ExpressionError, which names the first row (from 0) without a value."""
        import numpy as np
        scope = {**SCOPE, "check_finite": lambda value: value, "abs": np.abs, "sqrt": np.sqrt, "power": _power_rows,
                 "max": _reduce(np.maximum), "min": _reduce(np.minimum),
                 **{name: _by_row(FUNCTIONS[name], 1) for name in ("cos", "exp", "log", "sin", "tan")}}
        columns = [np.asarray(column, np.float64) for column in rows]
        try:
            with np.errstate(all="raise", under="ignore"):
                values = eval(self._code, scope, {f"name_{i}": column for i, column in enumerate(columns)})
            values = np.broadcast_to(np.asarray(values, np.float64), columns[0].shape if columns else (1,))
            if np.all(np.isfinite(values)):
                return values
        except (ArithmeticError, ValueError):
            pass
        for row, cells in enumerate(zip(*columns) if columns else [()]):  # slower, with the reason
            try:
                self.evaluate(dict(zip(self.names, map(float, cells))))
            except ExpressionError as error:
                raise ExpressionError(f"{error}, row {row}") from None
        raise ExpressionError(f"'{self.text}' is not a finite number")


def _reduce(function: "Callable[..., np.ndarray]") -> "Callable[..., np.ndarray]":
    return lambda first, *others: reduce(function, others, first)


def _by_row(function: Callable[..., float], inputs: int) -> "Callable[..., np.ndarray]":
    import numpy as np
    of_rows = np.frompyfunc(function, inputs, 1)
    return lambda *columns: np.asarray(of_rows(*columns), np.float64)


def _power_rows(base: "np.ndarray", exponent: "np.ndarray | float") -> "np.ndarray":
    if isinstance(exponent, float) and exponent == 2:
        return base * base  # rounded correctly, as portable_math.power is, and 500 times faster
    return _by_row(portable_math.power, 2)(base, exponent)


class _CallOperators(ast.NodeTransformer):
    """Replaces `a ** b` by `power(a, b)`, because Python's operator calls the C library, and checks the value
    of every other operator."""

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        self.generic_visit(node)
        name, values = (("power", [node.left, node.right]) if isinstance(node.op, ast.Pow)
                        else ("check_finite", [node]))
        return ast.Call(func=ast.Name(id=name, ctx=ast.Load()), args=values, keywords=[])
