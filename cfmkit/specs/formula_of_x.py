"""Formulas of one variable x as text, read by a closed grammar, and their derivatives, exact but for rounding."""

from __future__ import annotations

import ast
import math
import operator
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.specs.units.strict_decimal_number import quote

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray

MAX_FORMULA_LENGTH = 500
_BINARY_OPERATORS = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
_UNARY_OPERATORS: dict[type[ast.unaryop], Callable[[Any], Any]] = {ast.UAdd: operator.pos, ast.USub: operator.neg}
_NUMPY_FUNCTIONS = {name: getattr(np, name) for name in ("sin", "cos", "tan", "sqrt", "exp", "abs", "tanh", "log")} | {
    "min": np.minimum,
    "max": np.maximum,
}
_FUNCTION_SLOPES: dict[str, Callable[[Any], Any]] = {
    "sin": np.cos,
    "cos": lambda x: -np.sin(x),
    "tan": lambda x: 1 + np.tan(x) ** 2,
    "sqrt": lambda x: 0.5 / np.sqrt(x),
    "exp": np.exp,
    "abs": np.sign,
    "tanh": lambda x: 1 - np.tanh(x) ** 2,
    "log": lambda x: 1 / x,
}


def formula(text: str) -> Callable[[FloatArray], FloatArray]:
    """Return the function of x that a text describes.

    Raises ValueError with what is wrong, if it is no such formula.

    Examples
    --------
    >>> formula("1.5*(1 - cos(pi*x/12))")(np.array([0.0, 12.0])).tolist()
    [0.0, 3.0]
    """
    if len(text) > MAX_FORMULA_LENGTH:
        raise ValueError(f"a formula has at most {MAX_FORMULA_LENGTH} characters, this one has {len(text)}")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ValueError(f"{quote(text)} is not a formula; write e.g. '1.5*(1 - cos(pi*x/12))'") from None
    try:
        _value(tree, np.ones(1))
    except RecursionError:
        raise ValueError(f"{quote(text)} is nested too deep for a formula") from None

    def function(x: FloatArray) -> FloatArray:
        with np.errstate(all="ignore"):
            return np.broadcast_to(np.asarray(_value(tree, x), dtype=float), np.shape(x)).copy()

    return function


def slope(text: str) -> Callable[[FloatArray], FloatArray]:
    """Return the derivative by x of the function that a text describes, exact but for rounding.

    Where the function has a corner (``abs``, ``min``, ``max``) it is that of one of its sides.

    Raises ValueError as `formula` does.

    Examples
    --------
    >>> slope("x**3 - max(x, 2)")(np.array([1.0, 3.0])).tolist()
    [3.0, 26.0]
    """
    formula(text)
    tree = ast.parse(text.strip(), mode="eval").body

    def function(x: FloatArray) -> FloatArray:
        with np.errstate(all="ignore"):
            return np.broadcast_to(np.asarray(_slope(tree, x), dtype=float), np.shape(x)).copy()

    return function


def _slope(node: ast.expr, x: FloatArray) -> Any:
    """Return the derivative of a formula that `formula` accepts, by the rules of calculus."""
    if isinstance(node, ast.UnaryOp):
        return _UNARY_OPERATORS[type(node.op)](_slope(node.operand, x))
    if isinstance(node, ast.BinOp):
        u, v, du, dv = _value(node.left, x), _value(node.right, x), _slope(node.left, x), _slope(node.right, x)
        if isinstance(node.op, ast.Add | ast.Sub):
            return _BINARY_OPERATORS[type(node.op)](du, dv)
        if isinstance(node.op, ast.Mult):
            return du * v + u * dv
        if isinstance(node.op, ast.Div):
            return (du - u * dv / v) / v
        by_base = np.where(np.asarray(du) == 0, 0.0, v * np.power(np.asarray(u, dtype=float), v - 1) * du)
        by_power = np.where(np.asarray(dv) == 0, 0.0, np.power(np.asarray(u, dtype=float), v) * np.log(u) * dv)
        return by_base + by_power
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        inner, slopes = (
            [_value(argument, x) for argument in node.args],
            [_slope(argument, x) for argument in node.args],
        )
        if len(inner) == 2:
            first = inner[0] <= inner[1] if node.func.id == "min" else inner[0] >= inner[1]
            return np.where(first, *slopes)
        return _FUNCTION_SLOPES[node.func.id](inner[0]) * slopes[0]
    return 1.0 if isinstance(node, ast.Name) and node.id == "x" else 0.0


def _value(node: ast.expr, x: FloatArray) -> Any:
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float) and not isinstance(node.value, bool):
        return _to_float(node.value)
    if isinstance(node, ast.Name) and node.id in ("x", "pi"):
        return x if node.id == "x" else np.pi
    if isinstance(node, ast.BinOp) and type(node.op) in _BINARY_OPERATORS:
        with np.errstate(all="ignore"):
            return np.asarray(_BINARY_OPERATORS[type(node.op)](np.asarray(_value(node.left, x)), _value(node.right, x)))
    if isinstance(node, ast.UnaryOp) and type(node.op) in _UNARY_OPERATORS:
        return _UNARY_OPERATORS[type(node.op)](_value(node.operand, x))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in _NUMPY_FUNCTIONS:
        wanted = 2 if node.func.id in ("min", "max") else 1
        if len(node.args) != wanted or node.keywords:
            raise ValueError(f"{node.func.id}() takes {wanted} value{'s' if wanted > 1 else ''}")
        with np.errstate(all="ignore"):
            return _NUMPY_FUNCTIONS[node.func.id](*(_value(argument, x) for argument in node.args))
    reported = quote(ast.unparse(node))
    raise ValueError(
        f"{reported} is unknown here; a formula may hold numbers, x, pi, + - * / ** and {', '.join(_NUMPY_FUNCTIONS)}"
    )


def _to_float(value: int | float) -> float:
    """Return a number of a formula as a float; one that is too large for it is refused."""
    try:
        number = float(value)
    except OverflowError:
        number = float("inf")
    if not math.isfinite(number):
        raise ValueError("a number of the formula is too large: at most 1.8e308")
    return number
