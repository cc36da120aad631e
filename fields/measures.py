"""Lengths that follow from others: `-length/2 + 16.5 - line/2`."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping
from functools import cache

OPERATIONS: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
FUNCTIONS: dict[str, Callable[..., float]] = {"sqrt": math.sqrt, "min": min}


def value(expression: str | float, known: Mapping[str, float]) -> float:
    """Return the value of a number, or of sums, products, `sqrt` and `min` of numbers and known measures.

    Raises `ValueError` on anything else, and on a name that is not known.
    """
    if not isinstance(expression, str):
        return float(expression)
    return _value(_parsed(expression), known)


@cache
def _parsed(expression: str) -> ast.expr:
    # Only files of templates have expressions, and few.
    return ast.parse(expression, mode="eval").body


def _value(node: ast.expr, known: Mapping[str, float]) -> float:
    match node:
        case ast.Constant(value=int() | float() as number):
            return float(number)
        case ast.Name(id=name) if name in known:
            return known[name]
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_value(operand, known)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATIONS:
            return OPERATIONS[type(op)](_value(left, known), _value(right, known))
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if name in FUNCTIONS:
            return FUNCTIONS[name](*(_value(argument, known) for argument in arguments))
        case _:
            raise ValueError(f"{ast.unparse(node)} is neither a number, a known measure ({', '.join(known)}) nor a sum")
