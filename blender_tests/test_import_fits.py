# SPDX-License-Identifier: GPL-3.0-or-later
"""The whole way: photos by Cycles through a lens that distorts, files of a reconstruction, import,
fit. Each ends where the fit of the original scene does, within 2 %, and near the truth."""

import pytest
import reconstructed

pytestmark = [pytest.mark.blender, pytest.mark.slow]


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """Values by name of the scene. COLMAP's text and transforms.json give the same cameras as its
    binary files, see test_import."""
    pebble = reconstructed.pebble
    folder = tmp_path_factory.mktemp("pebble")
    found = pebble.build()
    photos = pebble.take_photos(found.cameras, folder / "photos", samples=16)
    found = pebble.Reconstruction(found.cameras, found.mesh, photos)
    words = pebble.write_all(found, folder)
    original = pebble.save_original(found, folder)
    wanted = {name: words[name] for name in ("metashape", "colmap binary")}
    return pebble.fit_each(wanted, original, folder)


@pytest.mark.parametrize("name", ["metashape", "colmap binary"])
def test_a_fit_from_files_ends_where_that_of_the_scene_does(fitted, name):
    for parameter, value in fitted["original"].items():
        assert fitted[name][parameter] == pytest.approx(value, rel=0.02), parameter


def test_it_ends_at_the_truth(fitted):
    truth = reconstructed.pebble.TRUTH
    for name, values in fitted.items():
        assert values["base_color"] == pytest.approx(truth["base_color"], rel=0.01), name
        assert values["strength"] == pytest.approx(reconstructed.pebble.SKY, rel=0.01), name
        assert values["roughness"] == pytest.approx(truth["roughness"], rel=0.1), name
