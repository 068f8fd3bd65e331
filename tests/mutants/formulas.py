"""Faults out of a grammar of formulas: a sign, a factor, an argument, a power, a case mixed up, at
a place in the source of a function that chance chooses."""

import ast
import inspect
import textwrap
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from model import Case, Parameters
from tests.mutants.exchange import WrongTheory

Function = Callable[..., Any]
FACTORS = (0.9, 0.97, 1.03, 1.1)
MIXED_UP = {"mu": "eta", "eta": "mu", "R": "r", "r": "R"}
"""Parameters that are taken for another of their kind."""
PARAMETERS = "mu", "eta", "j", "c"
"""Those that an engine may have wrong."""
KINDS = "sign", "factor", "argument", "power", "case"


def faulty(kind: str, node: ast.AST, rng: np.random.Generator) -> ast.expr | None:
    """The expression with a fault of a kind, None where it can't have one."""
    match kind, node:
        case "sign", ast.BinOp(left, ast.Add(), right):
            return ast.BinOp(left, ast.Sub(), right)
        case "sign", ast.BinOp(left, ast.Sub(), right):
            return ast.BinOp(left, ast.Add(), right)
        case "factor", ast.BinOp(_, ast.Mult() | ast.Div(), _):
            return ast.BinOp(node, ast.Mult(), ast.Constant(float(rng.choice(FACTORS))))
        case "argument", ast.Attribute(of, name, ast.Load()) if name in MIXED_UP:
            return ast.Attribute(of, MIXED_UP[name], ast.Load())
        case "power", ast.BinOp(base, ast.Pow(), ast.Constant(int(n))):
            return ast.BinOp(base, ast.Pow(), ast.Constant(n + 1))
        case "power", ast.Call(ast.Attribute(_, "sqrt", _), [of], []):
            return ast.BinOp(of, ast.Pow(), ast.Constant(0.55))
        case "case", ast.Attribute(ast.Name("Case") as of, name, ast.Load()):
            others = [each.name for each in Case if each.name != name]
            return ast.Attribute(of, str(rng.choice(others)), ast.Load())
    return None


class _Exchange(ast.NodeTransformer):
    """One expression of a tree in the place of another."""

    def __init__(self, old: ast.AST, new: ast.AST) -> None:
        self.old, self.new = old, new

    def visit(self, node: ast.AST) -> ast.AST:
        return self.new if node is self.old else super().visit(node)


def tree(function: Function) -> ast.FunctionDef | None:
    """The source of a function as a tree, without decorators; None for what isn't a plain one."""
    try:
        body = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
    except (OSError, TypeError, SyntaxError):
        return None
    if not isinstance(body, ast.FunctionDef):
        return None
    body.decorator_list, body.returns = [], None
    for argument in (*body.args.args, *body.args.kwonlyargs):
        argument.annotation = None
    return body


def planted(rng: np.random.Generator, functions: Sequence[Function]) -> Iterator[WrongTheory]:
    """Wrong theories without end: each is a function of these with one fault of some kind."""
    places: dict[str, list[tuple[Function, int]]] = {kind: [] for kind in KINDS}
    for function in functions:
        nodes = list(ast.walk(known)) if (known := tree(function)) else []
        for kind in KINDS:
            places[kind] += [
                (function, n) for n, node in enumerate(nodes) if faulty(kind, node, rng)
            ]
    able = [kind for kind in KINDS if places[kind]]
    while able:
        kind = able[int(rng.integers(len(able)))]
        # A function is chosen before a place in it, so that long ones aren't most of them.
        those = list(dict.fromkeys(function for function, _ in places[kind]))
        function = those[int(rng.integers(len(those)))]
        own = [n for each, n in places[kind] if each is function]
        yield wrong_theory(function, kind, own[int(rng.integers(len(own)))], rng)


def wrong_theory(
    function: Function, kind: str, place: int, rng: np.random.Generator
) -> WrongTheory:
    """The theory with a fault of a kind at a place in the source of a function: the number of an
    expression in `ast.walk`."""
    known, plain = tree(function), inspect.unwrap(function)
    assert known
    old = list(ast.walk(known))[place]
    new = faulty(kind, old, rng)
    assert new
    what = f"{plain.__name__}: {ast.unparse(old)} → {ast.unparse(new)}"
    changed: Any = _Exchange(old, new).visit(known)
    module = ast.Module([changed], [])
    defined: dict[str, Any] = {}
    exec(compile(ast.fix_missing_locations(module), what, "exec"), plain.__globals__, defined)
    put = defined[plain.__name__]
    return WrongTheory(
        what, plain.__module__, plain.__name__, lambda right, *args, **named: put(*args, **named)
    )


def of_ball(rng: np.random.Generator) -> tuple[str, Callable[[Parameters], Parameters]]:
    """A fault of the ball that an engine moves: in words, and what it makes of a set."""
    kind, name = str(rng.choice(("factor", "argument", "power"))), str(rng.choice(PARAMETERS))
    if kind == "argument":
        return "engine: mu and eta exchanged", lambda p: p.replace(mu=p.eta, eta=p.mu)
    factor, power = (float(rng.choice(FACTORS)), 1.0) if kind == "factor" else (1.0, 1.1)
    what = f"engine: {name} → {factor:g} * {name} ** {power:g}"
    return what, lambda p: p.replace(**{name: factor * getattr(p, name) ** power})
