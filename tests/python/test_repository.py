# SPDX-License-Identifier: GPL-3.0-or-later
"""The rules of the repository that a machine can check: see CONTRIBUTING.md."""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))


ROOT = Path(__file__).resolve().parents[2]
NATIVE = ROOT / "native"
ADDON = ROOT / "addon" / "selenite"

# What a room of native/ may include, besides itself
KNOWS = {
    "math": set(),
    "model": {"math"},
    "scene": {"math", "model"},
    "image": {"math"},
    "render": {"math", "model", "scene"},
    "fit": {"math", "model", "scene", "render"},
    "module": {"math", "model", "scene", "image", "render", "fit"},
}

# The folders of a room in their order: each may include itself and those before it
LAYERS = {
    "render": ("film", "derivatives", "prepared", "media", "path", "lanes", "driver", "shape"),
    "fit": (
        "photo",
        "problem",
        "objective",
        "evaluate",
        "solver",
        "inference",
        "state",
        "phases",
        "shape",
        "run",
    ),
}

# Where Blender may be imported at the head of a file ...
BLENDER_ROOMS = {"scene_read", "write_back", "cycles_check", "importers", "interface"}
BLENDER_FILES = {"capture/scene_captures.py", "capture/panel_rows.py"}
# ... and where only inside a function, so that `import selenite` works without Blender
BLENDER_LATE = {"__init__.py", "cli.py", "commands"}
BLENDER_MODULES = {"bpy", "bmesh", "mathutils", "gpu", "blf", "bpy_extras", "addon_utils"}

# Rooms of the add-on: each knows those before it. The package itself is not one of them: it is a
# parent of every module, and registers the interface.
# Of the native modules types alone are imported.
ROOMS = (
    "_core", "_image", "process_end", "messages", "problems", "paths", "json_text", "native",
    "parameters", "atomic_files", "grid_files", "mean_free_path", "environments", "scene_read",
    "write_back", "capture", "fit", "report", "advice", "cycles_check", "importers", "commands",
    "demo", "cli", "command_process", "interface", "__main__",
)  # fmt: skip

VAGUE = re.compile(r"(^|_)(utils?|helpers?|common|manager|misc)($|_)")


def _sources(*suffixes: str) -> list[Path]:
    folders = ["native", "addon", "devtools", "tests", "blender_tests", "scenes", "bench", "cmake"]
    found = [path for folder in folders for path in sorted((ROOT / folder).rglob("*"))]
    found += [ROOT / "dev", ROOT / ".ci" / "run"]
    return [
        path
        for path in found
        if path.is_file()
        and (path.suffix in suffixes or (not path.suffix and path.parent.name != "__pycache__"))
        and ADDON / "lib" not in path.parents
    ]


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def test_version_is_the_same_everywhere() -> None:
    version = tomllib.loads(_text(ROOT / "pyproject.toml"))["project"]["version"]
    manifest = tomllib.loads(_text(ADDON / "blender_manifest.toml"))
    assert manifest["version"] == version
    literals = {}
    for node in ast.parse(_text(ADDON / "__init__.py")).body:  # parsed, not run: as Blender does
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            literals[node.targets[0].id] = ast.literal_eval(node.value)
    assert ".".join(map(str, literals["bl_info"]["version"])) == version
    assert literals["__version__"] == version
    assert f"## [{version}]" in _text(ROOT / "CHANGELOG.md")


@pytest.mark.parametrize("room", KNOWS)
def test_native_rooms_include_only_rooms_above(room: str) -> None:
    wrong = []
    for path, includes in _native(room):
        for included in includes:
            other = included.split("/")[0]
            if other != room and other not in KNOWS[room]:
                wrong.append(f"{path.relative_to(ROOT)} includes {included}")
    assert not wrong, "\n".join(wrong)


def _native(room: str) -> Iterator[tuple[Path, list[str]]]:
    """Sources of a room, templates of sources among them, and what each includes."""
    for path in sorted((NATIVE / room).rglob("*")):
        if path.suffix in (".h", ".cpp", ".in"):
            yield path, re.findall(r'^\s*#\s*include\s+"([^"]+)"', _text(path), re.MULTILINE)


@pytest.mark.parametrize("room", LAYERS)
def test_folders_of_a_room_include_only_those_before(room: str) -> None:
    order = LAYERS[room]
    wrong = set()
    for path, includes in _native(room):
        layer = path.relative_to(NATIVE / room).parts[0]
        assert layer in order, f"{path.relative_to(ROOT)} lies in no folder of {order}"
        for included in includes:
            other, *rest = included.split("/")
            if other == room and rest[0] not in order[: order.index(layer) + 1]:
                wrong.add(f"{path.relative_to(NATIVE / room)} includes {room}/{rest[0]}")
    assert not wrong, "\n".join(sorted(wrong))


def test_image_library_stays_out_of_the_core_module() -> None:
    for path in sorted((NATIVE / "module").rglob("*.*")):
        if not path.name.startswith("image"):
            assert '#include "image/' not in _text(path), f"{path.name}: _core has no OpenImageIO"


def _imports(tree: ast.Module) -> list[tuple[str, bool]]:
    """Top-level names of the imported modules, and whether the import runs with the file itself."""
    found = []

    def visit(node: ast.AST, at_head: bool) -> None:
        if isinstance(node, ast.Import):
            found.extend((alias.name.split(".")[0], at_head) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            found.append((node.module.split(".")[0], at_head))
        # what stands under `if TYPE_CHECKING:` never runs
        elif isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            return
        inside = isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))
        for child in ast.iter_child_nodes(node):
            visit(child, at_head and not inside)

    visit(tree, True)
    return found


def test_blender_is_imported_only_where_it_may_be() -> None:
    wrong = []
    for path in sorted(ADDON.rglob("*.py")):
        inside = path.relative_to(ADDON)
        first = inside.parts[0]
        if first == "lib" or first in BLENDER_ROOMS or inside.as_posix() in BLENDER_FILES:
            continue
        for module, at_head in _imports(ast.parse(_text(path))):
            if module in BLENDER_MODULES and (at_head or first not in BLENDER_LATE):
                wrong.append(f"{path.relative_to(ROOT)} imports {module}")
    assert not wrong, "\n".join(wrong)


def _module(path: Path) -> str:
    """ "fit.job" of addon/selenite/fit/job.py; "" of the package itself."""
    parts = path.relative_to(ADDON).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _imported(package: list[str], node: ast.AST) -> list[list[str]]:
    """The parts of what an import from the add-on names: a module, or something in one."""
    if isinstance(node, ast.Import):
        parts = [alias.name.split(".") for alias in node.names]
        return [rest for first, *rest in parts if first == "selenite"]
    if not isinstance(node, ast.ImportFrom):
        return []
    base = node.module.split(".") if node.module else []
    if node.level:
        base = package[: len(package) - node.level + 1] + base
    elif base.pop(0) != "selenite":
        return []
    return [[*base, alias.name] for alias in node.names]


def _own_imports() -> dict[str, set[str]]:
    """Module of the add-on -> those of its modules that it imports, inside functions too."""
    sources = [path for path in ADDON.rglob("*.py") if ADDON / "lib" not in path.parents]
    modules = {_module(path): path for path in sources}
    found: dict[str, set[str]] = {}
    for name, path in modules.items():
        parts = name.split(".") if name else []
        package = parts if path.name == "__init__.py" else parts[:-1]
        nodes = ast.walk(ast.parse(_text(path)))
        named = [item for node in nodes for item in _imported(package, node)]
        known = {".".join(item if ".".join(item) in modules else item[:-1]) for item in named}
        found[name] = known - {"", name}
    return found


def test_imports_of_the_addon_have_no_circle() -> None:
    left = {name: set(others) for name, others in _own_imports().items()}
    while True:  # what imports nothing that is left is in no circle
        free = {name for name, others in left.items() if not others & left.keys()}
        if not free:
            break
        left = {name: others for name, others in left.items() if name not in free}
    assert not left, f"these import one another, or what does: {sorted(left)}"


def test_rooms_of_the_addon_know_only_rooms_before_them() -> None:
    wrong = []
    for name, others in _own_imports().items():
        room = name.partition(".")[0]
        if not room:
            continue
        assert room in ROOMS, f"{room} has no place in ROOMS"
        for other in others:
            if ROOMS.index(other.partition(".")[0]) > ROOMS.index(room):
                wrong.append(f"{name} imports {other}")
    assert not wrong, "\n".join(wrong)


def _lines_of_addon(pattern: str) -> list[str]:
    """ "file:line: text" of each line that is no import."""
    return [
        f"{path.relative_to(ADDON)}:{number}: {line.strip()}"
        for path in sorted(ADDON.rglob("*.py"))
        for number, line in enumerate(_text(path).splitlines(), 1)
        if re.search(pattern, line) and not line.startswith("from typing")
    ]


def test_what_is_untyped_grows_no_more() -> None:
    """Native classes have stubs, and what JSON holds has a name. These numbers only fall."""
    assert len(_lines_of_addon(r"\bAny\b")) <= 18
    assert len(_lines_of_addon(r"dict\[str, Any\]")) <= 2


def test_why_a_fit_has_ended_is_no_text() -> None:
    """It is compared as a StopReason; its words are for people."""
    texts = "cancelled|converged|all iterations done|loss below tolerance"
    assert not _lines_of_addon(rf"""[!=]= ["']({texts})["']""")


def test_no_file_has_a_name_that_says_nothing() -> None:
    vague = [path for path in _sources(".py", ".h", ".cpp") if VAGUE.search(path.stem)]
    assert not vague


def test_every_source_names_its_licence() -> None:
    bare = [
        str(path.relative_to(ROOT))
        for path in _sources(".py", ".h", ".cpp", ".in", ".cmake")
        if "SPDX-License-Identifier: GPL-3.0-or-later" not in "".join(_text(path)[:400])
    ]
    assert not bare


def test_no_test_is_switched_off() -> None:
    off = []
    for path in _sources(".cpp", ".py"):
        if path == Path(__file__):
            continue
        text = _text(path)
        if re.search(r"^\s*#\s*if\s+0\b", text, re.MULTILINE) or re.search(
            r"\bDISABLED_|GTEST_SKIP\(\)\s*;|mark\.skip\s*$|mark\.skip\(\)", text, re.MULTILINE
        ):
            off.append(str(path.relative_to(ROOT)))
    assert not off, f"disabled, or skipped without a reason: {off}"


def test_requirements_hold_the_pins_of_the_project() -> None:
    """The lock file and the ranges in pyproject.toml cannot drift apart."""
    from packaging.requirements import Requirement
    from packaging.utils import canonicalize_name

    pins = {}
    for line in _text(ROOT / "requirements" / "dev.txt").splitlines():
        if line and not line.startswith("#"):
            name, _, version = line.partition("==")
            assert version, f"not pinned: {line}"
            pins[canonicalize_name(name)] = version
    project = tomllib.loads(_text(ROOT / "pyproject.toml"))
    asked = [*project["build-system"]["requires"], *project["project"]["dependencies"]]
    for group in project["project"]["optional-dependencies"].values():
        asked += group
    for text in asked:
        wanted = Requirement(text)
        # The file is for the Python that `./dev` runs with.
        here = wanted.marker is None or wanted.marker.evaluate({"python_version": "3.11"})
        if here and wanted.name != project["project"]["name"]:
            assert wanted.specifier.contains(pins[canonicalize_name(wanted.name)]), text
