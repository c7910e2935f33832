# SPDX-License-Identifier: GPL-3.0-or-later
"""The stubs of the native modules have the names and parameters that the modules have."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType, WrapperDescriptorType

import numpy as np
import pytest

from selenite import native

ADDON = Path(native.__file__).parent
MODULES = {"_core": native.core, "_image": native.image}
STUBS = {name: ast.parse((ADDON / f"{name}.pyi").read_text(encoding="utf-8")) for name in MODULES}
#: Methods that pybind11 writes itself; of these, a stub has what a caller uses.
OF_PYBIND = re.compile(r"__(?!init__)\w+__|__entries|_pybind11_\w+")

#: (name, "positional" or "keyword", whether it has a default)
Parameter = tuple[str, str, bool]
#: What a name of a class or module is: "value", "property", or its overloads.
Kind = str | list[list[Parameter]]


def _shapes(tree: ast.Module) -> dict[str, list[str]]:
    """The keys of each TypedDict that is a class: its own and those it inherits."""
    found: dict[str, list[str]] = {"TypedDict": []}
    for node in tree.body:
        if isinstance(node, ast.ClassDef):
            base = ast.unparse(node.bases[0]) if node.bases else ""
            if base in found:
                found[node.name] = found[base] + [item.target.id for item in node.body]
    return found


SHAPES = {name: _shapes(stub) for name, stub in STUBS.items()}


def _split(text: str, mark: str) -> Iterator[str]:
    """The text at marks that are in no bracket and no quotes."""
    depth, quote, start = 0, "", 0
    for i, c in enumerate(text):
        if quote:
            quote = "" if c == quote else quote
        elif c in "'\"":
            quote = c
        elif c in "([{":
            depth += 1
        elif c in ")]}":
            depth -= 1
        elif c == mark and depth == 0:
            yield text[start:i]
            start = i + 1
    yield text[start:]


def _arguments(line: str) -> str:
    """What stands between the brackets of a signature."""
    depth, start = 0, line.index("(")
    for i, c in enumerate(line):
        depth += (c == "(") - (c == ")")
        if c == ")" and depth == 0:
            return line[start + 1 : i]
    raise AssertionError(f"no signature: {line}")


def _parameters(line: str) -> list[Parameter]:
    found, kind = [], "positional"
    for piece in map(str.strip, _split(_arguments(line), ",")):
        if piece == "*":
            kind = "keyword"
        elif piece:
            found.append((piece.partition(":")[0], kind, len(list(_split(piece, "="))) > 1))
    return found


def _overloads(text: str) -> list[list[Parameter]]:
    """Of a docstring of pybind11: the parameters of each signature."""
    first, *rest = text.splitlines()
    numbered = [line for line in rest if re.match(r"\d+\. \w+\(", line)]
    return [_parameters(line) for line in numbered or [first]]


def _of_module(module: ModuleType) -> dict[str, Kind | dict[str, Kind]]:
    found: dict[str, Kind | dict[str, Kind]] = {}
    for name, value in vars(module).items():
        if name.startswith("__") and name != "__version__":
            continue
        if inspect.isclass(value):
            found[name] = _of_class(value)
        else:
            found[name] = _overloads(value.__doc__) if callable(value) else "value"
    return found


def _of_class(kind: type) -> dict[str, Kind]:
    found: dict[str, Kind] = {}
    for name, value in vars(kind).items():
        if OF_PYBIND.fullmatch(name) or isinstance(value, WrapperDescriptorType):
            continue  # the latter: __init__ of a class that Python cannot make
        if isinstance(value, property):
            found[name] = "property"
        else:
            found[name] = _overloads(value.__doc__) if callable(value) else "value"
    return found


def _of_stub(name: str) -> dict[str, Kind | dict[str, Kind]]:
    found: dict[str, Kind | dict[str, Kind]] = {}
    for node in STUBS[name].body:
        if isinstance(node, ast.ClassDef) and node.name not in SHAPES[name]:
            found[node.name] = _names(node.body)
    return found | _names(STUBS[name].body)


def _names(body: list[ast.stmt]) -> dict[str, Kind]:
    found: dict[str, Kind] = {}
    for node in body:
        if isinstance(node, ast.AnnAssign) and not OF_PYBIND.fullmatch(
            node.target.id.replace("__version__", "")
        ):
            found[node.target.id] = "value"
        if not isinstance(node, ast.FunctionDef) or OF_PYBIND.fullmatch(node.name):
            continue
        decorators = [ast.unparse(item) for item in node.decorator_list]
        if "property" in decorators:
            found[node.name] = "property"
        else:
            found[node.name] = [*found.get(node.name, []), _stub_parameters(node)]
    return found


def _stub_parameters(node: ast.FunctionDef) -> list[Parameter]:
    a = node.args
    bare = len(a.args) - len(a.defaults)
    found = [(item.arg, "positional", i >= bare) for i, item in enumerate(a.args)]
    return found + [
        (item.arg, "keyword", default is not None)
        for item, default in zip(a.kwonlyargs, a.kw_defaults, strict=True)
    ]


@pytest.mark.parametrize("name", MODULES)
def test_stub_has_the_names_and_parameters_of_the_module(name: str) -> None:
    module, stub = _of_module(MODULES[name]()), _of_stub(name)
    assert stub.keys() == module.keys()
    for item, there in module.items():
        assert stub[item] == there, item


@pytest.mark.parametrize("name", MODULES)
def test_the_type_of_a_module_has_all_its_names(name: str) -> None:
    tree = ast.parse(Path(native.__file__).read_text(encoding="utf-8"))
    kind = {"_core": "Core", "_image": "Image"}[name]
    (body,) = (n.body for n in ast.walk(tree) if isinstance(n, ast.ClassDef) and n.name == kind)
    named = {node.target.id for node in body if isinstance(node, ast.AnnAssign)}
    bound = {node.targets[0].id: node.value for node in body if isinstance(node, ast.Assign)}
    assert named | bound.keys() == _of_stub(name).keys()
    for item, value in bound.items():
        assert ast.unparse(value) in (f"{name}.{item}", f"staticmethod({name}.{item})")


def test_the_keys_of_dicts_are_those_of_the_module(tmp_path: Path) -> None:
    core, image, picture = native.core(), native.image(), tmp_path / "grey.png"
    image.write_png(picture, np.full((2, 3, 3), 0.5, np.float32))
    reference, _, _, photo, masks = image.read_at_size(picture, 1, 1, masks=[(picture, "black")])
    assert reference.shape == (1, 1, 3)
    given = {
        "ParameterRow": [*core.parameters(), *core.closures()["diffuse"]],
        "LossRow": core.losses(),
        "OptimiserRow": core.optimisers(),
        "ProbeColumn": core.probe_columns("v2"),
        "SettingRanges": [core.setting_ranges()],
        "PictureInfo": [image.probe(picture)],
        "ReadInfo": [image.read(picture)[2]],
        "PhotoInfo": [photo],
        "CountedInfo": masks,
    }
    for name, dicts in given.items():
        shapes = SHAPES["_core"] | SHAPES["_image"]
        assert all(sorted(one) == sorted(shapes[name]) for one in dicts), name


def test_native_modules_are_imported_through_native_alone() -> None:
    """An import of one while the add-on loads would come before bpy, and unchecked."""
    for path in ADDON.rglob("*.py"):
        if ADDON / "lib" in path.parents:
            continue
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for node in _run(tree):
            if isinstance(node, ast.ImportFrom):
                named = {*(node.module or "").split("."), *(item.name for item in node.names)}
                assert not named & MODULES.keys(), f"{path}:{node.lineno}"


def _run(node: ast.AST) -> Iterator[ast.AST]:
    """The nodes below but what stands under TYPE_CHECKING."""
    for child in ast.iter_child_nodes(node):
        if not (isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING"):
            yield child
            yield from _run(child)


def test_a_difference_is_found() -> None:
    line = 'f(self: A, size: Annotated[Sequence[int], "FixedSize(2)"] = (0, 0), *, id: str) -> B'
    assert _parameters(line) == [
        ("self", "positional", False), ("size", "positional", True), ("id", "keyword", False)
    ]  # fmt: skip
    node = ast.parse("def f(self, size=..., *, id): ...").body[0]
    assert isinstance(node, ast.FunctionDef)
    assert _stub_parameters(node) == _parameters(line)
    assert _stub_parameters(node) != _parameters(line.replace("id", "name"))
