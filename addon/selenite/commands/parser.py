# SPDX-License-Identifier: GPL-3.0-or-later
"""All commands with their options, in groups; importing neither bpy nor the native modules."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import NoReturn

from .. import __version__
from ..problems import BadInput, Problem
from . import environment_arguments as environment
from .capture_arguments import add_captures
from .cluster_arguments import add_scheduler
from .examples import with_examples
from .import_arguments import add_import
from .render_arguments import KEPT, PHYSICAL, add_of_fits, add_reading


class Parser(argparse.ArgumentParser):
    """What is wrong with the words is a Problem, as everything else that is wrong."""

    def error(self, message: str) -> NoReturn:
        """Raises BadInput."""
        name, colon, cause = message.partition(": ")
        if not (colon and name.startswith("argument ")):
            name, cause = "Command line", message
        cure = f"see {self.prog} --help"
        raise BadInput(Problem(name[0].upper() + name[1:], cause, cure))


#: Command -> what it does, in the groups of `selenite --help`.
COMMANDS: dict[str, dict[str, str]] = {
    "a scene that is ready to fit": {
        "import": "makes a scene that is ready to fit of a reconstruction",
        "check": "what is understood of a scene and what stands in the way",
    },
    "fits": {
        "fit": "fits parameters to photos",
        "batch": "runs many fits and makes one table of their results",
        "compare": "judges a fit by photos that it has not seen",
        "next-camera": "ranks places for the next photo by the information it would add",
        "trade": "measures time against error on a scene",
        "demo": "fits the demo scene",
    },
    "light from the world": {
        "lamps": "makes suns of the bright spots of the world's image",
    },
    "what the renderer computes": {
        "render": "renders one picture",
        "gradient": "renders a picture with its derivatives",
        "probe": "evaluates the BSDF for each row of a table",
    },
}


def build_parser() -> argparse.ArgumentParser:
    """All commands."""
    parser = Parser(
        prog="selenite",
        usage="selenite [-h] [--version] COMMAND ...",
        description="Finds the material parameters that make a render match photos.\n\n"
        + "\n\n".join(_listed(title, names) for title, names in COMMANDS.items()),
    )
    with_examples(parser, "")
    parser.add_argument("--version", action="version", version=f"selenite {__version__}")
    commands = parser.add_subparsers(
        dest="command", required=True, metavar="COMMAND", prog="selenite", help=argparse.SUPPRESS
    )
    add_import(_command(commands, "import", ".commands.import_scene"))
    _add_check(commands)
    _add_render(commands)
    _add_gradient(commands)
    _add_probe(commands)
    _add_fit(commands)
    _add_batch(commands)
    _add_compare(commands)
    _add_next_camera(commands)
    _add_trade(commands)
    environment.add_lamps(_command(commands, "lamps", ".commands.lamps"))
    _add_demo(commands)
    return parser


def _listed(title: str, names: dict[str, str]) -> str:
    return "\n".join([f"{title}:", *(f"  {name:14}{text}" for name, text in names.items())])


def _command(
    commands: argparse._SubParsersAction, name: str, module: str
) -> argparse.ArgumentParser:
    summary = next(names[name] for names in COMMANDS.values() if name in names)
    parser = commands.add_parser(name, description=f"{summary[0].upper()}{summary[1:]}.")
    with_examples(parser, name)
    parser.set_defaults(module=module)
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout")
    return parser


def _add_check(commands: argparse._SubParsersAction) -> None:
    parser = _command(commands, "check", ".commands.check")
    parser.add_argument("scene", metavar="SCENE.blend")
    add_captures(parser.add_argument_group("photos"), "default: the captures of the scene")
    add_reading(parser)


def _add_view(parser: argparse.ArgumentParser) -> argparse._ArgumentGroup:
    """What is rendered, and how; returns the group of the former."""
    parser.add_argument("scene", metavar="SCENE.blend")
    shown = parser.add_argument_group("what is rendered")
    shown.add_argument("--camera", metavar="NAME", help="default: the scene's active camera")
    shown.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="OWNER:PARAM=V[,V,V]",
        help="change a value before rendering",
    )
    add_reading(parser)
    add = parser.add_argument_group("settings of the render").add_argument
    add("--width", type=int, help="pixels; default: the scene's")
    add("--height", type=int, help="pixels; default: the scene's")
    add("--spp", type=_at_least(1), default=64, help="samples per pixel (%(default)s)")
    add("--seed", type=_at_least(0), default=0, help="of the random numbers (%(default)s)")
    add("--depth", type=_at_least(0), default=0, help="bounces; 0: unlimited")
    add("--threads", type=_at_least(0), default=0, help="0: all")
    lanes = "paths a thread traces in lockstep: 1, or 0 for 8 where processor and scene permit"
    add("--lanes", type=int, choices=(0, 1), default=0, help=lanes)
    add("--physical-refraction", action="store_true", help=PHYSICAL)
    return shown


def _add_render(commands: argparse._SubParsersAction) -> None:
    parser = _command(commands, "render", ".commands.render")
    add = _add_view(parser).add_argument
    captures = "photos and how they were taken, or the folder of a fit, with the gains it has found"
    add("--captures", metavar="FILE.json", help=captures)
    capture = "shows what a fit compares with this photo: camera, size, lights, gain"
    add("--capture", metavar="ID", help=capture)
    result = "folder of a fit: renders what it has found, its grids and images with it"
    add("--result", metavar="DIR", help=result)
    add = parser.add_argument_group("results").add_argument
    add("--out", required=True, metavar="F.exr", help="OpenEXR (linear) or PNG")
    add("--sem", metavar="F2.exr", help="standard error of the mean per pixel")


def _add_gradient(commands: argparse._SubParsersAction) -> None:
    parser = _command(commands, "gradient", ".commands.gradient")
    _add_view(parser).add_argument(
        "--parameter",
        action="extend",
        nargs="+",
        required=True,
        metavar="OWNER:PARAM",
        help="what to differentiate by, e.g. Body:ior; or alone Body:base_color_texture, by every "
        "texel of the image that gives the base colour",
    )
    add = parser.add_argument_group("results").add_argument
    add("--repeat", type=_at_least(0), default=0, help="measured iterations")
    add("--out-dir", metavar="DIR", help="writes the derivative images here")


def _add_probe(commands: argparse._SubParsersAction) -> None:
    parser = _command(commands, "probe", ".commands.probe")
    parser.add_argument("file", metavar="FILE.csv", help="parameters and directions, row by row")
    add = parser.add_argument_group("results").add_argument
    add("--out", required=True, metavar="OUT.csv", help="the rows with the values of the BSDF")
    add("--derivatives", action="store_true", help="add the slopes by each parameter of a row")
    precision = "scalars of the evaluation; single: as in renders (%(default)s)"
    add("--precision", choices=("single", "double"), default="double", help=precision)


def _add_fit(commands: argparse._SubParsersAction) -> None:
    parser = _command(commands, "fit", ".commands.fit")
    parser.set_defaults(checks_lights=True)
    add = parser.add_argument
    scene = "a .blend file, or the run.json of an earlier fit; with --resume it may be left out"
    add("scene", metavar="SCENE", nargs="?", help=scene)
    many = {"action": "append", "default": []}
    group = parser.add_argument_group("what is fitted")
    add = group.add_argument
    add("--fit", **many, metavar="OWNER:PARAM[,PARAM]", help="what to fit")
    model = (
        "tries an opaque body, a medium and grids of albedos in turn, while each explains photos "
    )
    model += "better that no fit has seen: auto, opaque, subsurface or medium"
    add("--model", metavar="[MATERIAL:]NAME", help=model)
    start = "a value, default: the scene's; or the folder of a fit, to begin where that one ended"
    add("--start", **many, metavar="OWNER:PARAM=V[,V,V]|RESULT", help=start)
    add("--bounds", **many, metavar="OWNER:PARAM=LO,HI", help="of each channel")
    grid = (
        "voxels along a grid's longest side, texels along each side of an image, or a file to "
        "start from (.npy, .vol, a picture); new: a new colour attribute for vertex_colors"
    )
    add("--grid", **many, metavar="OWNER:FIELD=N|FILE|new", help=grid)
    unseen = "texels or vertices that no photo sees stay as they were, or are filled from around"
    add("--unseen", **many, metavar="OWNER:FIELD=keep|fill", help=unseen)
    stages = "what is fitted first: usual (default; light-first where the world's image, an image "
    stages += "and its colour are fitted), none, ior-last, colours-first, light-first, or a JSON "
    stages += "file"
    add("--stages", metavar="FILE", help=stages)
    environment.add_environment(group)
    add_captures(parser.add_argument_group("photos"), "default: the captures of the scene")
    add_reading(parser)
    add = parser.add_argument_group("settings of the fit").add_argument
    add("--preset", choices=("draft", "balanced", "accurate"), help="default: balanced")
    add("--loss", help="what is minimised; default: robust. An unknown name lists them all")
    add(
        "--optimiser",
        help="auto, gauss-newton or adam; adam starts from the settings of the thesis tool",
    )
    search = "multi-start: evaluate many starting points before the first step"
    add("--search", choices=("auto", "on", "off"), help=search)
    add("--iterations", type=int, help="maximum number; stops earlier when converged")
    add(
        "--until-converged",
        action=argparse.BooleanOptionalAction,
        help="goes on to three times the iterations where values still move "
        "(default: with --preset balanced or accurate, unless --iterations is given)",
    )
    precision = "where refinement ends: 90 %% intervals within 3 %% (draft) or 1 %% (usual) of the "
    precision += "bounds' distance, or twice that of the value; exact: after all samples"
    add("--precision", choices=("draft", "usual", "exact"), help=precision)
    prior = "what holds back the pattern of grids and images: agreement, differences from photos "
    prior += "on which these do not agree (default), or misfit, all of them"
    add("--prior", choices=("agreement", "misfit"), help=prior)
    add("--spp", type=int, help="samples per pixel and iteration")
    add("--height", type=int, help="pixels of the compared pictures")
    add("--learning-rate", type=float, help="of Adam")
    add(
        "--accumulate",
        action=argparse.BooleanOptionalAction,
        help="one step for all photos; --no-accumulate: Adam steps after each",
    )
    add("--tolerance", type=float, help="stop when the loss falls below; 0: never")
    add_of_fits(add)
    add_scheduler(parser.add_argument_group("where it runs").add_argument, "render")
    add = parser.add_argument_group("results").add_argument
    add("--picture-spp", type=int, help="samples per pixel of the pictures in the result folder")
    add("--resume", metavar="DIR", help="goes on with the run of a folder <date>_<time>.unfinished")
    out = "gets a folder <date>_<time>; default: selenite-fits, with --resume where DIR is"
    add("--out", metavar="DIR", help=out)
    saved = f"saves a copy of the scene with the fitted values{KEPT}"
    add("--save", metavar="OUT.blend", help=saved)
    flag = {"action": "store_true"}
    add("--check-in-cycles", **flag, help="renders the fitted values with Cycles and compares")
    add("--set-cycles", **flag, help="sets Cycles in OUT.blend so that it shows what was fitted")


def _add_batch(commands: argparse._SubParsersAction) -> None:
    parser = _command(commands, "batch", ".commands.batch.run")
    parser.add_argument("file", metavar="FILE.toml", help="a table [[fit]] for each fit")
    add = parser.add_argument_group("how they run").add_argument
    jobs = "fits that run at once; each has its share of the threads (%(default)s)"
    add("--jobs", type=_at_least(1), default=1, metavar="N", help=jobs)
    add("--again", action="store_true", help="repeats fits that have ended before")
    add_scheduler(add, "run fits")
    out = "gets fits.csv, index.html and a folder for each fit; default: FILE-fits beside FILE"
    parser.add_argument_group("results").add_argument("--out", metavar="DIR", help=out)


def _add_compare(commands: argparse._SubParsersAction) -> None:
    parser = _command(commands, "compare", ".commands.fitted.compare")
    parser.add_argument("result", metavar="RESULT", help="folder of a fit")
    scene = "where the scene of the fit lies now; default: where it was"
    group = parser.add_argument_group("what is rendered")
    group.add_argument("--scene", metavar="SCENE.blend", help=scene)
    photos = "default: those that the fit held out, or else those that it has seen"
    add_captures(parser.add_argument_group("photos"), photos)
    add = parser.add_argument_group("settings of the renders").add_argument
    add("--height", type=int, help="pixels of the compared pictures; default: as in the fit")
    add("--spp", type=int, help="samples per pixel; default: those of the fit's pictures")
    add("--seed", type=int, help="of the random numbers")
    add("--threads", type=int, help="0: all")
    out = "gets compare.json and a contact sheet; default: RESULT/compared"
    parser.add_argument_group("results").add_argument("--out", metavar="DIR", help=out)


def _add_next_camera(commands: argparse._SubParsersAction) -> None:
    parser = _command(commands, "next-camera", ".commands.next_camera")
    parser.set_defaults(start=[], grid=[], unseen=[], **environment.NO_ENVIRONMENT)
    scene = "a .blend file, or the folder or run.json of a fit: then at its fitted values"
    parser.add_argument("scene", metavar="SCENE", help=scene)
    many = {"action": "append", "default": []}
    add = parser.add_argument_group("what is unknown").add_argument
    add("--fit", **many, metavar="OWNER:PARAM[,PARAM]", help="what a fit would find")
    add("--bounds", **many, metavar="OWNER:PARAM=LO,HI", help="of each channel")
    value = "a value to compute at; default: the fitted one, or the scene's"
    add("--set", **many, metavar="OWNER:PARAM=V[,V,V]", help=value)
    add_captures(parser.add_argument_group("photos"), "default: the captures of the scene")
    add_reading(parser)
    add = parser.add_argument_group("settings of the renders").add_argument
    add("--height", type=int, help="pixels of the pictures that a fit would compare")
    add_of_fits(add)
    saved = f"saves a copy of the scene with the camera 'Next photo'{KEPT}"
    parser.add_argument_group("results").add_argument("--save", metavar="OUT.blend", help=saved)


def _add_trade(commands: argparse._SubParsersAction) -> None:
    parser = _command(commands, "trade", ".commands.trade")
    parser.set_defaults(start=[], grid=[], unseen=[], **environment.NO_ENVIRONMENT)
    parser.add_argument("scene", metavar="SCENE.blend")
    many = {"action": "append", "default": []}
    add = parser.add_argument_group("what is fitted").add_argument
    add("--fit", **many, metavar="OWNER:PARAM[,PARAM]", help="what the fits find")
    add("--bounds", **many, metavar="OWNER:PARAM=LO,HI", help="of each channel")
    photo = "whose cameras and sizes count; its content does not. Default: the scene's cameras"
    add_captures(parser.add_argument_group("photos"), photo)
    add_reading(parser)
    add = parser.add_argument_group("settings of the fits").add_argument
    add("--budget", type=float, default=300.0, metavar="SECONDS", help="in all (%(default)g)")
    add("--loss", help="of every fit; default: robust")
    add("--optimiser", help="of every fit; default: auto")
    add_of_fits(add, depth=False)
    add = parser.add_argument_group("results").add_argument
    add("--out", metavar="DIR", help="gets trade.csv, trade.json and trade.png")
    expected = "prints the expected seconds and errors of each preset, without fits; writes nothing"
    add("--expected", action="store_true", help=expected)


def _add_demo(commands: argparse._SubParsersAction) -> None:
    parser = _command(commands, "demo", ".demo")
    out = "gets scene, photos and results (%(default)s)"
    group = parser.add_argument_group("results")
    group.add_argument("--out", default="selenite-demo", metavar="DIR", help=out)


def _at_least(low: int) -> Callable[[str], int]:
    def integer(text: str) -> int:
        value = int(text)
        if value < low:
            raise argparse.ArgumentTypeError(f"{value} is less than {low}")
        return value

    return integer
