# SPDX-License-Identifier: GPL-3.0-or-later
"""Every text of the interface is there in every language of the add-on, and Blender shows it."""

import ast
import inspect
import json

import bpy
import interface_texts
import made_scenes as made
import pytest

from selenite.fit.plan import build_scene, paths_traced
from selenite.interface import problem_reports, properties, texts
from selenite.interface.furniture.languages import TEXTS
from selenite.problems import BadInput, refused
from selenite.report import findings

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


@pytest.fixture
def german():
    """The interface in German for the length of a test."""
    if "de_DE" not in bpy.app.translations.locales:
        pytest.skip("no German in this Blender")
    view = bpy.context.preferences.view
    before = view.language
    view.language = "de_DE"
    view.use_translate_interface = view.use_translate_tooltips = True
    yield
    view.language = before


def test_blender_shows_german(german):
    assert bpy.app.translations.pgettext_iface("Start Fit") == "Anpassung starten"


def test_what_a_fit_says_is_shown_in_german(german):
    assert texts.shown("Camera 'Front'") == "Kamera „Front“"
    assert texts.shown("Parameter 'A:ior': given twice; give it once") == (
        "Parameter „A:ior“: zweimal angegeben; gib es einmal an"
    )
    bpy.context.preferences.view.language = "en_US"
    assert texts.shown("Camera 'Front'") == "Camera 'Front'"


_EXPOSURE = (
    "Photo 'adam' is 2.00 times as bright as the render (99% of the difference): its exposure or "
    "white balance is not the scene's; fit the light (World:strength, World:color) or take the "
    "loss brightness-independent-mse"
)


def test_losses_and_optimisers_are_called_as_in_the_panel():
    shown = texts.shown(_EXPOSURE)
    assert shown.endswith("or take the loss Brightness Independent")
    assert "Photo 'adam'" in shown, "a photo has its name"
    assert texts.shown("choose optimiser = 'adam'") == "choose optimiser = 'Adam'"
    assert texts.shown("loss 'mse' needs 2") == "loss 'Mean Squared Error' needs 2"
    assert texts.shown("File '/home/dual-buffer.exr'") == "File '/home/dual-buffer.exr'"
    for name, title, help_text, _ in properties.LOSS_ITEMS:
        assert texts.shown(f"loss '{name}'") == f"loss '{title}'"
        assert not any("-" in one[0] and one[0] in help_text for one in properties.LOSS_ITEMS)


def test_losses_are_called_as_in_the_panel_in_german(german):
    assert texts.shown(_EXPOSURE).endswith("nimm das Fehlermaß Unabhängig von der Helligkeit")
    chosen = "choose loss = 'dual-buffer' or a brighter photo"
    assert texts.shown(chosen) == "wähle das Fehlermaß „Doppelpuffer“ oder ein helleres Foto"


class _Operator:
    """What Blender's reports would show."""

    def report(self, kinds, text):
        self.said = text


def reported(work):
    """What is reported of a request that the native module refuses."""
    operator = _Operator()
    with pytest.raises(BadInput) as error, refused("Scene", "correct the scene"):
        work()
    problem_reports.report_problems(operator, error.value)
    return operator.said


def test_what_the_native_module_refuses_is_reported_in_german(german, native):
    """Of a scene, a render and a request. A lamp keeps its name, that of its parameter."""
    made.studio()
    made.light("power", energy=10)
    scene = build_scene(made.read())
    assert reported(lambda: scene.with_values({("power", "gloss"): 1})) == (
        "Szene: „power“ hat keinen Parameter „gloss“; vorhanden sind: 'power', 'color'"
    )
    assert reported(lambda: native.core().render(scene, "Camera", 8, 8, 0)) == (
        "Rendern: Abtastwerte je Pixel = 0 ist nicht erlaubt; setze es auf [1, 1048576]"
    )
    assert reported(lambda: scene.with_lights({"lamps": 3})) == (
        "Lichter: lamps = 3 ist von falscher Art oder außerhalb des Bereichs; berichtige die Szene"
    )


def test_why_paths_are_traced_one_at_a_time_is_shown_in_german(german):
    made.principled(made.studio()).inputs["Alpha"].default_value = 0.5
    made.light("Key", energy=10)
    traced = paths_traced(build_scene(made.read()))
    if "AVX2" not in traced:
        assert texts.shown(f"Paths are traced {traced}") == (
            "Pfade werden verfolgt: einzeln: Material „Body“ lässt Strahlen gerade hindurch (Alpha)"
        )
