# SPDX-License-Identifier: GPL-3.0-or-later
"""Every text of the interface is there in every language of the add-on, and Blender shows it."""

import ast
import inspect
import json

import bpy
import interface_texts
import pytest

from selenite.fit_run.answer import findings
from selenite.interface import texts
from selenite.interface.furniture.languages import TEXTS

pytestmark = [pytest.mark.blender, pytest.mark.blender34, pytest.mark.usefixtures("addon")]

LANGUAGES = sorted(TEXTS.glob("*.json"))


@pytest.mark.parametrize("path", LANGUAGES, ids=lambda path: path.stem)
def test_a_language_is_complete(path):
    found = json.loads(path.read_text(encoding="utf-8"))
    wanted = interface_texts.all_texts()
    assert len(wanted) > 300  # the collector collects
    assert sorted(wanted - set(found)) == []
    for text, words in found.items():
        assert words and text.count("{}") == words.count("{}"), text


@pytest.mark.parametrize("path", LANGUAGES, ids=lambda path: path.stem)
def test_a_language_has_every_verdict(path):
    found = json.loads(path.read_text(encoding="utf-8"))
    function = inspect.getsource(findings._verdict)
    (tree,) = ast.parse(function).body
    sentences = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and str(node.value).rstrip().endswith("."):
            sentences.add(node.value)
        if isinstance(node, ast.JoinedStr):
            parts = ["{}" if isinstance(x, ast.FormattedValue) else x.value for x in node.values]
            sentences.add("".join(parts))
    whole = {text for text in sentences if text[0].isupper() and "{}" not in text}
    assert len(whole) >= 5 and whole <= set(found), whole - set(found)


def test_numbers_of_a_sentence_stay(monkeypatch):
    seen = []
    monkeypatch.setattr(texts, "translated", lambda text: seen.append(text) or f"Nur {text}")
    assert texts.translated_sentence("5.0 % of 3") == "Nur 5.0 % of 3"
    assert seen == ["{} % of {}"]


def test_every_operator_panel_and_setting_has_a_tooltip():
    assert interface_texts.without_tooltip() == []


@pytest.mark.skipif("de_DE" not in bpy.app.translations.locales, reason="no German in this Blender")
def test_blender_shows_german():
    view = bpy.context.preferences.view
    before = view.language
    try:
        view.language = "de_DE"
        view.use_translate_interface = view.use_translate_tooltips = True
        text = bpy.app.translations.pgettext_iface("Start Fit")
        assert text == "Anpassung starten"
    finally:
        view.language = before


@pytest.mark.skipif("de_DE" not in bpy.app.translations.locales, reason="no German in this Blender")
def test_what_a_fit_says_is_shown_in_german():
    view = bpy.context.preferences.view
    before = view.language
    try:
        view.language = "de_DE"
        view.use_translate_interface = True
        assert texts.shown("Camera 'Front'") == "Kamera „Front“"
        assert texts.shown("Parameter 'A:ior': given twice; give it once") == (
            "Parameter „A:ior“: zweimal angegeben; gib es einmal an"
        )
    finally:
        view.language = before
    assert texts.shown("Camera 'Front'") == "Camera 'Front'"
