# SPDX-License-Identifier: GPL-3.0-or-later
"""What both revisions run: commands of `selenite` on the scenes of `scenes`, and their photos."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field, replace
from typing import Any

#: Results that a revision may change on purpose, all together.
INFORMATION = "information"


@dataclass(frozen=True)
class Photo:
    """A render of a scene, with some values replaced."""

    name: str
    scene: str
    values: tuple[str, ...] = ()
    camera: str = "Camera"
    height: int = 0  # 0: the scene's

    def words(self, folder: str) -> list[str]:
        """The command that makes it."""
        size = [f"--height={self.height}"] if self.height else []
        changes = [word for value in self.values for word in ("--set", value)]
        return [
            "render", f"{folder}/{self.scene}.blend", f"--out={folder}/{self.name}.exr",
            f"--camera={self.camera}", "--spp=128", "--seed=99", "--threads=2", *size, *changes,
        ]  # fmt: skip


_BALL = ("Body:base_color=0.7,0.3,0.2", "Body:roughness=0.3", "Body:ior=1.7", "Key:power=90")
PHOTOS = (
    Photo("ball", "ball", _BALL),
    Photo("ball_left", "ball", _BALL, "Left"),
    Photo("ball_right", "ball", _BALL, "Right"),
    Photo("large", "ball", _BALL, height=31),
    Photo("plain", "ball"),
    Photo("tall", "ball", _BALL, height=48),
    Photo("portrait", "portrait", _BALL),
    Photo("world", "ball", ("World:strength=0.9",)),
    Photo("glass", "glass", ("Body:ior=1.3", "Body:roughness=0.15")),
    Photo("painted_glass", "painted_glass", ("Body:ior=1.3", "Body:roughness=0.15")),
    Photo("coated", "coated", ("Body:roughness=0.3", "Body:coat_roughness=0.15")),
    Photo("alike", "coated", ("Body:roughness=0.4", "Body:coat_roughness=0.3")),
    Photo("sky", "sky", ("Body:metallic=0.9", "Body:roughness=0.15")),
    Photo("smoke", "smoke", ("Smoke:albedo=0.9,0.6,0.3", "Smoke:extinction=3")),
    Photo("milk", "milk", ("Milk:albedo=0.9,0.7,0.5", "Milk:roughness=0.02")),
    Photo("board", "painted_board"),
    Photo("rough_board", "painted_board", ("Body:roughness=0.4",)),
)

#: Files that the cases name, beside scenes and photos.
FILES = {
    "stages.json": {
        "schema": 1,
        "stages": [
            {"name": "colour", "parameters": ["Body:base_color"], "iterations": 4, "height": 12},
            {"parameters": ["Body:base_color", "Body:roughness"], "iterations": 5, "spp": 8},
        ],
    },
    "long_stages.json": {
        "schema": 1,
        "stages": [
            {"parameters": ["Body:base_color"], "iterations": 1, "height": 12},
            {"parameters": ["Body:base_color", "Body:roughness"], "iterations": 14},
        ],
    },
    "field_stages.json": {
        "schema": 1,
        "stages": [
            {"parameters": ["Smoke:albedo"], "iterations": 5},
            {"parameters": ["Smoke:albedo_grid"], "iterations": 12},
        ],
    },
}


@dataclass(frozen=True)
class Case:
    """A command, with {inputs} for the folder of scenes and photos, {folder} for the case's own.

    settings: of the native fit, which the command line does not know; see `renamed.SETTINGS`.
    interrupted: phases in which the fit is interrupted and from which it goes on.
    """

    name: str
    words: tuple[str, ...]
    group: str = ""
    settings: dict[str, Any] = field(default_factory=dict)
    interrupted: tuple[str, ...] = ()

    @property
    def is_fit(self) -> bool:
        return self.words[0] == "fit"

    def as_json(self) -> dict[str, Any]:
        return json.loads(json.dumps(asdict(self)))


def _fit(
    name: str, unknowns: str, *more: str, scene: str = "ball", photo: str = "", **how: Any
) -> Case:
    photos = [] if photo == "-" else [f"--photo=Camera={{inputs}}/{photo or scene}.exr"]
    usual = {
        "--iterations": "5",
        "--spp": "4",
        "--height": "16",
        "--picture-spp": "8",
        "--seed": "3",
    }
    given = {word.partition("=")[0] for word in more}
    words = [f"{key}={value}" for key, value in usual.items() if key not in given]
    fitted = [f"--fit={unknowns}"] if unknowns else []
    start = ("fit", f"{{inputs}}/{scene}.blend")
    return Case(name, (*start, *fitted, *photos, *words, *more), **how)


_ADAM, _NO_SEARCH, _SEARCH = "--optimiser=adam", "--search=off", "--search=on"
_CAMERAS = tuple(
    f"--photo={camera}={{inputs}}/{name}.exr"
    for camera, name in (("Camera", "ball"), ("Left", "ball_left"), ("Right", "ball_right"))
)
_MASKS = ("--mask=Camera={inputs}/mask.png", "--mask=Right={inputs}/mask.png")
_IMAGE, _GRID, _DENSITY = "Body:base_color_texture", "Smoke:albedo_grid", "Smoke:density_grid"
_MANY = (
    "base_color,roughness,metallic,ior,alpha,specular_level,specular_tint,coat_weight,"
    "coat_roughness,coat_tint,sheen_weight,sheen_roughness,emission_strength"
)
#: Long enough for a look from outside into each phase.
_LONG = ("--iterations=14", "--spp=64", "--height=24")

_ALL = (
    Case("render", (
        "render", "{inputs}/ball.blend", "--out={folder}/picture.exr", "--sem={folder}/sem.exr",
        "--camera=Left", "--spp=16", "--seed=5",
    )),
    Case("gradient", (
        "gradient", "{inputs}/glass.blend", "--parameter", "Body:ior", "Body:roughness",
        "Body:base_color", "Key:power", "--out-dir={folder}/gradient", "--spp=16", "--seed=5",
    )),
    _fit("adam scalars", "Body:base_color,roughness", _ADAM, "--iterations=12"),
    _fit("adam with refinement", "Body:base_color", _ADAM, settings={"refinement": "on"}),
    _fit("adam with search", "Body:base_color", _ADAM, _SEARCH),
    _fit("adam step per camera", "Body:base_color,roughness", _ADAM, "--no-accumulate", *_CAMERAS,
         photo="-"),
    _fit("colour", "Body:base_color", _NO_SEARCH),
    _fit("colour with search", "Body:base_color", _SEARCH),
    _fit("roughness and ior", "Body:roughness,ior", _NO_SEARCH, "--iterations=8"),
    _fit("glass", "Body:roughness,ior", "--height=10", scene="glass"),
    _fit("settled", "Body:base_color", _NO_SEARCH, "--iterations=60"),
    _fit("no transmission", "Body:base_color,transmission", _NO_SEARCH, "--iterations=10",
         "--start=Body:transmission=0.3", "--spp=16"),
    _fit("no transmission alone", "Body:transmission", _NO_SEARCH, "--iterations=8",
         "--start=Body:transmission=0.3", photo="plain"),
    _fit("no transmission and ior", "Body:transmission,roughness,ior", _NO_SEARCH, "--spp=32",
         "--iterations=10", "--start=Body:transmission=0.3", "--height=24", photo="plain"),
    _fit("transmission", "Body:base_color,transmission,roughness", "--height=10",
         "--start=Body:transmission=0.6", scene="glass"),
    _fit("search in smaller pictures", "Body:base_color", _SEARCH, "--height=48",
         "--iterations=2", "--spp=2", photo="tall"),
    _fit("more than a render carries", f"Body:{_MANY}", f"--fit=Floor:{_MANY}",
         "--fit=Key:power,color", "--fit=World:strength,color", _ADAM, _NO_SEARCH),
    _fit("metallic under a sky", "Body:metallic,roughness", scene="sky"),
    _fit("medium", "Smoke:extinction,albedo,anisotropy", scene="smoke"),
    _fit("lamp and world", "Body:base_color", "--fit=Key:power", "--fit=World:strength"),
    _fit("world alone", "World:strength", _NO_SEARCH, photo="world"),
    _fit("no refinement", "Body:base_color,roughness", _NO_SEARCH, settings={"refinement": "off"}),
    _fit("derivatives carried along", "Body:roughness,ior", _NO_SEARCH,
         settings={"finite_differences": False}),
    _fit("bounds and starts", "Body:roughness,ior", "--bounds=Body:ior=1.2,1.6",
         "--start=Body:roughness=0.7", _NO_SEARCH),
    _fit("tolerance", "Body:base_color", "--tolerance=0.05", _NO_SEARCH, "--iterations=30",
         "--start=Body:base_color=0.69,0.31,0.21", "--fit=Body:roughness,ior"),
    _fit("twins", "Body:roughness,coat_roughness", scene="coated"),
    _fit("twins alike", "Body:roughness,coat_roughness", "--iterations=8", "--height=12",
         scene="coated", photo="alike"),
    *(
        _fit(f"twins by seed {seed}", "Body:roughness,coat_roughness", "--iterations=14",
             "--spp=64", f"--seed={seed}", f"--height={height}", scene="coated")
        for seed, height in ((5, 16), (7, 20), (8, 20))
    ),
    *(
        _fit(f"loss {name}", "Body:base_color,roughness", f"--loss={name}")
        for name in ("mse", "brightness-independent-mse", "mae", "mean-bias-error")
    ),
    _fit("stages of a file", "Body:base_color,roughness", "--stages={inputs}/stages.json"),
    _fit("stages ior-last", "Body:base_color,ior", "--stages=ior-last", "--iterations=10"),
    _fit("cameras and masks", "Body:base_color,roughness", *_CAMERAS, *_MASKS, photo="-"),
    _fit("portrait", "Body:base_color", scene="portrait"),
    _fit("cut pixels", "Body:base_color", "--height=13", "--depth=3", photo="large"),
    _fit("albedo grid", _GRID, f"--grid={_GRID}=4", "--iterations=10", scene="smoke"),
    _fit("albedo grid and scalars", f"{_GRID},extinction", f"--grid={_GRID}=3",
         "--iterations=20", scene="smoke"),
    _fit("grid in clear glass", "Milk:albedo_grid,roughness", "--grid=Milk:albedo_grid=3",
         "--iterations=10", "--height=12", scene="milk"),
    _fit("density grid", _DENSITY, f"--grid={_DENSITY}=4", "--iterations=10", scene="smoke"),
    _fit("both grids", f"{_DENSITY},albedo_grid", f"--grid={_DENSITY}=3", f"--grid={_GRID}=2",
         scene="smoke"),
    _fit("grid after albedo", "", "--stages={inputs}/field_stages.json", f"--grid={_GRID}=3",
         scene="smoke"),
    _fit("image", _IMAGE, f"--grid={_IMAGE}=4", "--iterations=10", scene="board"),
    _fit("image and roughness", f"{_IMAGE},roughness", f"--grid={_IMAGE}=4", "--iterations=20",
         scene="board", photo="rough_board"),
    _fit("image of many texels", f"{_IMAGE},roughness", f"--grid={_IMAGE}=32", "--iterations=10",
         scene="board", photo="rough_board"),
    _fit("image by another loss", _IMAGE, f"--grid={_IMAGE}=4", "--iterations=8",
         "--loss=brightness-independent-mse", scene="board"),
    _fit("image on glass", f"{_IMAGE},roughness,ior", f"--grid={_IMAGE}=4", "--iterations=12",
         "--height=10", scene="glass", photo="painted_glass"),
    _fit("image without search", f"{_IMAGE},roughness", f"--grid={_IMAGE}=4", "--iterations=10",
         _NO_SEARCH, f"--unseen={_IMAGE}=keep", scene="board"),
    _fit("long", "Body:base_color,roughness", *_LONG,
         interrupted=("multi-start", "descent", "refinement", "comparison")),
    _fit("long twins", "Body:roughness,coat_roughness", *_LONG, scene="coated",
         interrupted=("multi-start", "refinement", "comparison")),
    _fit("long adam", "Body:base_color,roughness", _ADAM, "--iterations=40", "--spp=32",
         "--tolerance=0", interrupted=("descent",)),
    _fit("long stages", "Body:base_color,roughness", "--stages={inputs}/long_stages.json",
         "--spp=64", "--height=24", _NO_SEARCH, interrupted=("descent", "refinement")),
    _fit("long grid", f"{_GRID},extinction", f"--grid={_GRID}=3", "--iterations=30", "--spp=16",
         scene="smoke", interrupted=("multi-start", "descent", "refinement")),
    _fit("long image", f"{_IMAGE},roughness", f"--grid={_IMAGE}=4", "--iterations=40", "--spp=16",
         scene="board", photo="rough_board", interrupted=("multi-start", "descent")),
    Case("next camera", (
        "next-camera", "{inputs}/ball.blend", "--fit=Body:base_color,roughness",
        "--photo=Camera={inputs}/ball.exr", "--height=16", "--seed=3",
    ), INFORMATION),
    Case("expected errors", (
        "trade", "{inputs}/ball.blend", "--fit=Body:base_color,roughness",
        "--photo=Camera={inputs}/ball.exr", "--expected", "--seed=3",
    ), INFORMATION),
)  # fmt: skip

#: One thread and two, alternately.
CASES = tuple(
    replace(case, words=(*case.words, f"--threads={1 + index % 2}"))
    for index, case in enumerate(_ALL)
)
