# SPDX-License-Identifier: GPL-3.0-or-later
"""Names and texts use the words of the field: no word that only this project would know.

Comments and docstrings are prose and may look, tell and turn. Names of tests are sentences.
"""

from __future__ import annotations

import ast
import io
import keyword
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("native", "addon", "tests", "blender_tests", "bench", "devtools", "scenes")

#: Word of this project -> word of the field.
TERMS = {
    r"likeness": "tiled loss",
    r"nearness": "paired midpoint test",
    r"rivals?": "alternative minima",
    r"contest(ed|s)?": "ambiguous",
    r"serious": "pending",
    r"secants?": "finite differences",
    r"scouts?": "pilot pass",
    r"sharpened": "low-roughness restart",
    r"verification|verif(y|ies|ied|ying)": "refinement",
    r"imitates?": "eliminate",
}
#: The same of several words of a name, joined by "_".
PHRASES = {
    "looks_sharp": "is_low_roughness",
    "in_turns": "block coordinate descent",
    "turns_of": "blocks",
    "as_good": "equivalent",
    "even_field": "uniform fields",
    "band_gain": "Wiener filter",
    "jacobian_sum": "instrumental variables",
    "field_newton": "FieldGaussNewton",
    "valley_bottom": "parabolic line search",
    "start_afresh": "reset_equations",
    "start_anew": "reset_everything",
}
#: Verbs that are no names, and what they named. Names of tests are sentences and may have them.
VERBS = {
    r"looks?|looked|looking": "pass, evaluate",
    r"tell|tells|telling|told": "report, reported",
    r"settles?|settled|settling": "accept, converged",
}
#: Names that were private in fits; the rooms below have values that are held, and neighbours.
OF_FITS = {r"held": "contain, fixed", r"beside": "offset, joint with"}
BELOW_FIT = ("math", "model", "scene", "image", "render")
#: Whole names that were private, where their words are not.
NAMES = {"kBlur": "kRoughness", "Coordinate": "Scale", "Evidence": "NormalEquations"}
#: Terms of graphics: a camera's orientation, a texture's look-up, and Blender's colour management.
GRAPHICS = re.compile(r"(^|_)look(ing)?_at(_|$)|(^|_)look(ed)?_up(_|$)")

#: In labels, help, messages and reports.
PHRASES_OF_TEXTS = re.compile(
    r"\blook(s|ed|ing)? (around|again)\b|\blooked at\b|\b(a|one|second|first) look\b|\bsettled?\b"
    r"|\b(tell|tells|told) (of|apart|about|most|more|as much)\b|\b(is|are) told\b|\bmade? up for\b"
    r"|\bnoise alone\b|\bin turns\b"
)
#: Where names of earlier versions are read, and this list.
EXEMPT = {
    "addon/selenite/fit/old_names.py",
    "bench/synthetic/table.py",
    "tests/python/test_words.py",
}


def _sources() -> list[Path]:
    found = [path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*"))]
    return [
        path
        for path in found
        if path.suffix in (".py", ".h", ".cpp")
        and ROOT / "addon" / "selenite" / "lib" not in path.parents
        and path.relative_to(ROOT).as_posix() not in EXEMPT
    ]


def _words(name: str) -> list[str]:
    """["field", "gauss", "newton"] of FieldGaussNewton or field_gauss_newton."""
    pieces = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", name)
    return [piece.lower() for piece in pieces]


def complaint(name: str, below_fit: bool = False) -> str:
    """What is wrong with a name, and the word of the field; "" for nothing."""
    if name in NAMES:
        return f"{name}: {NAMES[name]}"
    words = _words(name)
    joined = "_".join(words)
    for phrase, better in PHRASES.items():
        if phrase in joined:
            return f"{name}: {better}"
    is_sentence = words[:1] == ["test"] and len(words) > 2
    verbs = VERBS if below_fit else VERBS | OF_FITS
    if is_sentence or GRAPHICS.search(joined):
        verbs = {}
    for pattern, better in (TERMS | verbs).items():
        if any(re.fullmatch(pattern, word) for word in words):
            return f"{name}: {better}"
    return ""


def _complaint_of_text(text: str) -> str:
    for pattern, better in TERMS.items():
        if found := re.search(rf"\b({pattern})\b", text, re.IGNORECASE):
            return f"'{found.group()}' in \"{text[:60]}\": {better}"
    found = PHRASES_OF_TEXTS.search(text)
    return f"'{found.group()}' in \"{text[:60]}\"" if found else ""


def _python_names(text: str) -> Iterator[str]:
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.NAME and not keyword.iskeyword(token.string):
            yield token.string


#: A comment, a raw string, a string, a character: in this order, so that none hides in another.
_PIECES = re.compile(
    r'//[^\n]*|/\*.*?\*/|R"\((?P<raw>.*?)\)"|"(?P<text>(?:\\.|[^"\\\n])*)"|\'(?:\\.|[^\'\\\n])\'',
    re.DOTALL,
)


def _cpp_names(text: str) -> Iterator[str]:
    code = _PIECES.sub(" ", re.sub(r"^\s*#\s*include.*$", "", text, flags=re.MULTILINE))
    for suite, name in re.findall(r"\bTEST(?:_[FP])?\((\w+),\s*(\w+)\)", code):
        yield f"test_{suite}_{name}"
    code = re.sub(r"\bTEST(_[FP])?\([^)]*\)", "", code)
    yield from re.findall(r"[A-Za-z_]\w*", code)


def _python_texts(text: str) -> Iterator[str]:
    """Strings, but docstrings: these are prose, except those of operators, which are tooltips."""
    tree = ast.parse(text)
    prose = set()
    for node in ast.walk(tree):
        if isinstance(node, (ast.Module, ast.FunctionDef, ast.ClassDef)) and node.body:
            first = node.body[0]
            is_operator = isinstance(node, ast.ClassDef) and "_OT_" in node.name
            if isinstance(first, ast.Expr) and not is_operator:
                prose.add(first.value)
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in prose:
            yield node.value


def _cpp_texts(text: str) -> Iterator[str]:
    for found in _PIECES.finditer(text):
        if found.group("raw") or found.group("text"):
            yield found.group("raw") or found.group("text")


def _complaints(path: Path) -> list[str]:
    text = path.read_text(encoding="utf-8")
    is_python = path.suffix == ".py"
    names = set(_python_names(text) if is_python else _cpp_names(text)) | {path.stem}
    folder, room, *_ = path.relative_to(ROOT).parts
    below_fit = folder in ("native", "tests") and room in BELOW_FIT
    found = {complaint(name, below_fit) for name in names}
    if folder in ("native", "addon"):  # what a user reads
        texts = _python_texts(text) if is_python else _cpp_texts(text)
        found |= {_complaint_of_text(item) for item in texts}
    return sorted(found - {""})


def test_names_and_texts_have_the_words_of_the_field() -> None:
    wrong = [
        f"{path.relative_to(ROOT)}: {item}" for path in _sources() for item in _complaints(path)
    ]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize(
    "name",
    [
        "Likeness", "kNearness", "rivals_", "is_contested", "serious", "secants", "kScoutSpp",
        "looks_sharp", "kBlur", "in_turns", "turns_of_fields", "start_anew", "even_fields",
        "EvenFields", "BandGains", "JacobianSums", "valley_bottom", "verify", "Verification",
        "is_as_good", "look", "LookJob", "looks", "told_", "held_back", "settle", "beside",
        "test_rivals_are_reported",
    ],
)  # fmt: skip
def test_a_private_word_is_found(name: str) -> None:
    assert complaint(name)


def test_values_may_be_held_below_the_fit() -> None:
    assert complaint("held_back") and not complaint("held_back", below_fit=True)


@pytest.mark.parametrize(
    "name",
    [
        "kBlurRadius", "gaussian_blur", "look_at", "looking_at", "looked_up", "evaluate_serial",
        "test_what_is_told_holds", "turn", "FieldGaussNewton", "uniform_fields", "contents",
    ],
)  # fmt: skip
def test_a_word_of_the_field_passes(name: str) -> None:
    assert not complaint(name)


def test_texts_are_searched_but_not_prose() -> None:
    source = '"""Looks around."""\nHELP = "look around"\n\n\nclass A_OT_b:\n    """Look again"""\n'
    assert [bool(_complaint_of_text(item)) for item in _python_texts(source)] == [True, False]
    assert list(_python_texts(source)) == ["look around", "Look again"]
    native = 'f(1, "a // rival"); // "verify"\nchar c = \'"\'; auto s = R"(told\napart)";'
    assert list(_cpp_texts(native)) == ["a // rival", "told\napart"]
    assert list(_cpp_names(native)) == ["f", "char", "c", "auto", "s"]
