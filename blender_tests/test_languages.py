# SPDX-License-Identifier: GPL-3.0-or-later
"""Every text of the interface is there in every language of the add-on, and Blender shows it."""

import json

import bpy
import interface_texts
import made_scenes as made
import numpy as np
import pytest

from selenite.capture.views import View
from selenite.fit.diagnosis import course
from selenite.fit.fields.base import ONE_START
from selenite.fit.plan import build_scene
from selenite.interface import problem_reports, properties, texts
from selenite.interface.furniture.languages import TEXTS
from selenite.messages import control, joined, thing
from selenite.problems import BadInput, Problem, refused

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


def test_every_operator_panel_and_setting_has_a_tooltip():
    assert interface_texts.without_tooltip() == []


@pytest.fixture
def german():
    """The interface in German for the length of a test."""
    if "de_DE" not in bpy.app.translations.locales:
        pytest.skip("no German in this Blender")
    view = bpy.context.preferences.view
    names = ("language", "use_translate_interface", "use_translate_tooltips")
    before = {name: getattr(view, name) for name in names}
    view.language = "de_DE"
    view.use_translate_interface = view.use_translate_tooltips = True
    yield
    for name, value in before.items():
        setattr(view, name, value)


def test_blender_shows_german(german):
    assert bpy.app.translations.pgettext_iface("Start Fit") == "Anpassung starten"


def test_a_message_is_shown_in_german_and_a_name_stays(german):
    camera = thing("Camera", "left")
    assert texts.shown(camera) == "Kamera „left“"
    assert texts.shown(joined(": ", (camera, "odd"))) == "Kamera „left“: odd"
    bpy.context.preferences.view.language = "en_US"
    assert texts.shown(camera) == "Camera 'left'"


def _exposure():
    light = np.full((8, 8, 3), 0.5, np.float32)
    return course.exposure([View("adam", 2 * light, np.ones((8, 8), np.float32), light)])[0]


def test_losses_are_called_as_in_the_panel():
    said = _exposure()
    assert said.endswith("or take the loss brightness-independent-mse")
    shown = texts.shown(said)
    assert shown.endswith("or take the loss Brightness Independent")
    assert "'adam'" in shown, "a photo has its name"
    for name, title, help_text, _ in properties.LOSS_ITEMS:
        assert texts.shown(control(f"loss.{name}", name)) == title
        assert not any("-" in one[0] and one[0] in help_text for one in properties.LOSS_ITEMS)


def test_losses_are_called_as_in_the_panel_in_german(german):
    shown = texts.shown(_exposure())
    assert shown.startswith("Foto „adam“ ist 2.00 mal so hell wie das Rendering")
    assert shown.endswith("nimm das Fehlermaß Unabhängig von der Helligkeit")


class _Operator:
    """What Blender's reports would show."""

    def report(self, kinds, text):
        self.said = text


def reported(*problems):
    """What is reported of a request that is refused."""
    operator = _Operator()
    problem_reports.report_problems(operator, BadInput(problems))
    return operator.said


def test_a_problem_names_the_control_in_place_of_the_option(german):
    problem = Problem(thing("Photo", "a.png"), "its start is there twice", ONE_START)
    assert reported(problem) == (
        "Foto „a.png“: its start is there twice; "
        "schalte Eigener Start aus, oder beginne nicht mit einer Datei"
    )
    bpy.context.preferences.view.language = "en_US"
    assert reported(problem) == (
        "Photo 'a.png': its start is there twice; switch Own Start off, or do not start from a file"
    )
    assert problem.line().endswith("give --start or a file")


def test_what_the_native_module_refuses_is_reported(native):
    """A lamp keeps its name, that of its parameter; a scene stays English."""
    made.studio()
    made.light("power", energy=10)
    scene = build_scene(made.read())
    with pytest.raises(BadInput) as error, refused("Scene", "correct the scene"):
        scene.with_values({("power", "gloss"): 1})
    (problem,) = error.value.problems
    assert (problem.object, problem.cause) == ("Scene", "'power' has no parameter 'gloss'")
    assert problem.cure == "it has: 'power', 'color'"
