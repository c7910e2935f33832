# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: `selenite`, `python -m selenite`, `blender --command selenite`.

Exit status: 0 done; 2 bad input (one line per problem on stderr, nothing written); 1 failure, in a
sentence. With --json stdout holds one JSON object; everything else goes to stderr.
"""

from __future__ import annotations

import argparse
import importlib
import os
import sys
import tempfile
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, NoReturn, TextIO

from . import __version__
from .commands import addon_settings
from .commands import environment_arguments as environment
from .commands.capture_arguments import add_captures
from .commands.examples import with_examples
from .commands.import_arguments import add_import
from .commands.terminal import say
from .json_text import json_text
from .native import NativeUnavailable
from .problems import BadInput, Failed, Problem


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command and returns its exit status.

    Without `argv` it is the whole process: file descriptor 1 is kept for the JSON object, since
    Blender prints to it, and the process ends here, since bpy can hang in its own destructors.
    """
    if argv is not None:
        return _run(argv, sys.stdout)
    status = run_as_process(sys.argv[1:])
    os._exit(status)


def run_as_process(argv: Sequence[str]) -> int:
    """Runs one command with file descriptor 1 reserved for the JSON object from now on."""
    try:
        number = os.dup(1)
    except OSError:  # closed: nobody wants the object
        number = os.open(os.devnull, os.O_WRONLY)
    json_out = os.fdopen(number, "w", encoding="utf-8")
    with suppress(OSError, AttributeError):  # a closed stream is None
        sys.stdout.flush()
        os.dup2(2, 1)
    status = _run(argv, json_out)
    for stream in (json_out, sys.stdout, sys.stderr):
        with suppress(OSError, AttributeError):
            stream.flush()
    with suppress(OSError):
        json_out.close()
    return status


def _run(argv: Sequence[str], json_out: TextIO) -> int:
    try:
        args = build_parser().parse_args(argv)
    except SystemExit as stop:  # --help or --version
        return int(stop.code or 0)
    except BadInput as error:
        json_asked = any(len(word) > 2 and "--json".startswith(word) for word in argv)
        name = "selenite"
        return _report(name, {"problems": _as_json(error)}, json_out if json_asked else None)
    return _report(args.command, _done(args), json_out if args.json else None)


def _done(args: argparse.Namespace) -> dict[str, Any]:
    """What the command reports; of one that fails the key "problems" or "error"."""
    args.parser = build_parser()
    try:
        return dict(importlib.import_module(args.module, __package__).run(args))
    except BadInput as error:
        return {"problems": _as_json(error)}
    except (NativeUnavailable, Failed) as error:
        return {"error": str(error)}
    except KeyboardInterrupt:
        return {"error": "interrupted"}
    except ImportError as error:
        if error.name != "bpy":
            return {"error": _internal(error)}
        return {"problems": _as_json(BadInput(_without_blender(error)))}
    except MemoryError:
        cure = "give smaller sizes, fewer photos or smaller grids, or close other programs"
        return {"error": f"the computer's memory does not suffice; {cure}"}
    except OSError as error:
        if error.strerror is None:  # the native module's own sentence
            return {"error": str(error)}
        name = f"File '{error.filename}': " if error.filename else ""
        cure = "see that it is there, may be used, and that its disk has room"
        return {"error": f"{name}{error.strerror.lower()}; {cure}"}
    except Exception as error:  # the last net: no input should come this far
        return {"error": _internal(error)}
    finally:
        addon_settings.release()


def _without_blender(error: ImportError) -> Problem:
    version = "4.5.15" if sys.version_info < (3, 13) else "5.2.3"
    cure = (
        "run 'blender --command selenite' (Blender 4.2 or newer) in place of 'selenite', or "
        f"install Blender as a module: pip install bpy=={version}"
    )
    return Problem("Blender", f"this command needs it, and bpy does not load ({error})", cure)


def _internal(error: Exception) -> str:
    """A fault of ours as a sentence; the traceback goes into a file, or else to stderr."""
    text = traceback.format_exc()
    kind = f"{type(error).__name__}: {error}"
    try:
        number, path = tempfile.mkstemp(prefix="selenite-error-", suffix=".txt")
        with os.fdopen(number, "w", encoding="utf-8", errors="backslashreplace") as file:
            file.write(f"Selenite {__version__}, Python {sys.version}\n{sys.argv}\n\n{text}")
    except OSError:
        say(text)
        path = "the lines above"
    return f"internal error ({kind}); this is a fault of Selenite: please report it with {path}"


def _as_json(error: BadInput) -> list[dict[str, str]]:
    return [problem.as_json() for problem in error.problems]


def _report(command: str, report: dict[str, Any], json_out: TextIO | None) -> int:
    """Says what is wrong, writes the object where one is asked for; returns the exit status."""
    status = 0
    if "error" in report:
        say(f"{command}: {' '.join(str(report['error']).split())}")
        status = 1
    for problem in report.get("problems", ()):  # `check` reports them with all the rest
        say(f"{command}: {Problem(**problem).line()}")
        status = 2
    if json_out is not None:
        try:
            json_out.write(json_text(report) + "\n")
            json_out.flush()
        except (OSError, TypeError, ValueError) as error:  # a full disk, or nobody reads any more
            say(f"{command}: the JSON object cannot be written: {error}")
            status = status or 1
    return status


class Parser(argparse.ArgumentParser):
    """What is wrong with the words is a Problem, as everything else that is wrong."""

    def error(self, message: str) -> NoReturn:
        """Raises BadInput."""
        name, colon, cause = message.partition(": ")
        if not (colon and name.startswith("argument ")):
            name, cause = "Command line", message
        cure = f"see {self.prog} --help"
        raise BadInput(Problem(name[0].upper() + name[1:], cause, cure))


def build_parser() -> argparse.ArgumentParser:
    """All commands; importing neither bpy nor the native modules."""
    parser = Parser(
        prog="selenite",
        description="Finds the material parameters that make a render match photos.",
    )
    parser.add_argument("--version", action="version", version=f"selenite {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    add_import(_command(commands, "import", ".commands.import_scene"))
    _add_check(commands)
    _add_render(commands)
    _add_gradient(commands)
    _add_probe(commands)
    _add_fit(commands)
    _add_next_camera(commands)
    _add_trade(commands)
    environment.add_rotate_world(_command(commands, "rotate-world", ".commands.rotate_world"))
    environment.add_lamps(_command(commands, "lamps", ".commands.lamps"))
    _add_demo(commands)
    return parser


def _command(
    commands: argparse._SubParsersAction, name: str, module: str
) -> argparse.ArgumentParser:
    summary = {
        "import": "makes a scene that is ready to fit of a reconstruction",
        "check": "what is understood of a scene and what stands in the way",
        "render": "renders one picture",
        "gradient": "renders a picture with its derivatives",
        "probe": "evaluates the BSDF for each row of a table",
        "fit": "fits parameters to photos",
        "next-camera": "ranks places for the next photo by the information it would add",
        "trade": "measures time against error on a scene",
        "rotate-world": "finds the rotation and strength of a known panorama by the photos",
        "lamps": "makes suns of the bright spots of the world's image",
        "demo": "fits the demo scene",
    }[name]
    parser = commands.add_parser(name, help=summary, description=summary.capitalize() + ".")
    with_examples(parser, name)
    parser.set_defaults(module=module)
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout")
    return parser


_PHYSICAL = "no refraction towards lights that no micronormal gives; Cycles has it"


def _add_check(commands: argparse._SubParsersAction) -> None:
    parser = _command(commands, "check", ".commands.check")
    parser.add_argument("scene", metavar="SCENE.blend")
    captures = "photos and how they were taken; default: the captures of the scene"
    parser.add_argument("--captures", metavar="FILE.json", help=captures)


def _add_view(parser: argparse.ArgumentParser, spp: int) -> None:
    parser.add_argument("scene", metavar="SCENE.blend")
    parser.add_argument("--camera", metavar="NAME", help="name of the camera object")
    parser.add_argument("--width", type=int, help="pixels; default: the scene's")
    parser.add_argument("--height", type=int, help="pixels; default: the scene's")
    parser.add_argument(
        "--spp", type=_at_least(1), default=spp, help="samples per pixel (%(default)s)"
    )
    parser.add_argument("--seed", type=_at_least(0), default=0)
    parser.add_argument("--depth", type=_at_least(0), default=0, help="bounces; 0: unlimited")
    parser.add_argument("--threads", type=_at_least(0), default=0, help="0: all")
    parser.add_argument(
        "--lanes",
        type=int,
        choices=(0, 1),
        default=0,
        help="paths a thread traces in lockstep: 1, or 0 for 8 where processor and scene permit",
    )
    parser.add_argument("--physical-refraction", action="store_true", help=_PHYSICAL)
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="OWNER:PARAM=V[,V,V]",
        help="change a value before rendering",
    )


def _add_render(commands: argparse._SubParsersAction) -> None:
    parser = _command(commands, "render", ".commands.render")
    _add_view(parser, spp=64)
    parser.add_argument("--out", required=True, metavar="F.exr", help="OpenEXR (linear) or PNG")
    parser.add_argument("--sem", metavar="F2.exr", help="standard error of the mean per pixel")
    captures = "photos and how they were taken, or the folder of a fit, with the gains it has found"
    parser.add_argument("--captures", metavar="FILE.json", help=captures)
    capture = "shows what a fit compares with this photo: camera, size, lights, gain"
    parser.add_argument("--capture", metavar="ID", help=capture)
    result = "folder of a fit: renders what it has found, its grids and images with it"
    parser.add_argument("--result", metavar="DIR", help=result)


def _add_gradient(commands: argparse._SubParsersAction) -> None:
    parser = _command(commands, "gradient", ".commands.gradient")
    _add_view(parser, spp=64)
    parser.add_argument(
        "--parameter",
        action="extend",
        nargs="+",
        required=True,
        metavar="OWNER:PARAM",
        help="what to differentiate by, e.g. Body:ior; or alone Body:base_color_texture, by every "
        "texel of the image that gives the base colour",
    )
    parser.add_argument("--repeat", type=_at_least(0), default=0, help="measured iterations")
    parser.add_argument("--out-dir", metavar="DIR", help="writes the derivative images here")


def _add_probe(commands: argparse._SubParsersAction) -> None:
    parser = _command(commands, "probe", ".commands.probe")
    parser.add_argument("file", metavar="FILE.csv")
    parser.add_argument("--out", required=True, metavar="OUT.csv")
    parser.add_argument(
        "--derivatives", action="store_true", help="add the slopes by each parameter of a row"
    )
    help_text = "scalars of the evaluation; single: as in renders (%(default)s)"
    parser.add_argument(
        "--precision", choices=("single", "double"), default="double", help=help_text
    )


def _add_fit(commands: argparse._SubParsersAction) -> None:
    parser = _command(commands, "fit", ".commands.fit")
    add = parser.add_argument
    scene = "a .blend file, or the run.json of an earlier fit; with --resume it may be left out"
    add("scene", metavar="SCENE", nargs="?", help=scene)
    many = {"action": "append", "default": []}
    group = parser.add_argument_group("what is fitted")
    add = group.add_argument
    add("--fit", **many, metavar="OWNER:PARAM[,PARAM]", help="what to fit")
    add("--start", **many, metavar="OWNER:PARAM=V[,V,V]", help="default: the scene's value")
    add("--bounds", **many, metavar="OWNER:PARAM=LO,HI")
    grid = (
        "voxels along a grid's longest side, or a .npy or .vol file to start from; of "
        "base_color_texture texels along each side, or a picture"
    )
    add("--grid", **many, metavar="MATERIAL:GRID=N|FILE", help=grid)
    unseen = "texels that no photo sees stay as they were, or are filled from those around them"
    add("--unseen", **many, metavar="MATERIAL:base_color_texture=keep|fill", help=unseen)
    stages = "fitted first: ior-last, colours-first, auto (what photos determine), or a JSON file"
    add("--stages", metavar="FILE", help=stages)
    environment.add_environment(group)
    add_captures(parser.add_argument_group("photos"), "default: the captures of the scene")
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
    add("--spp", type=int, help="samples per pixel and iteration")
    add("--height", type=int, help="pixels of the compared pictures")
    add("--learning-rate", type=float, help="of Adam")
    add(
        "--accumulate",
        action=argparse.BooleanOptionalAction,
        help="one step for all photos; --no-accumulate: Adam steps after each",
    )
    add("--tolerance", type=float, help="stop when the loss falls below; 0: never")
    add("--depth", type=int, help="bounces; 0: unlimited")
    add("--seed", type=int)
    add("--threads", type=int, help="0: all")
    add("--physical-refraction", action="store_true", default=None, help=_PHYSICAL)
    add = parser.add_argument_group("results").add_argument
    add("--picture-spp", type=int, help="samples per pixel of the pictures in the result folder")
    add("--resume", metavar="DIR", help="goes on with the run of a folder <date>_<time>.unfinished")
    out = "gets a folder <date>_<time>; default: selenite-fits, with --resume where DIR is"
    add("--out", metavar="DIR", help=out)
    add("--save", metavar="OUT.blend", help="saves a copy of the scene with the fitted values")
    flag = {"action": "store_true"}
    add("--check-in-cycles", **flag, help="renders the fitted values with Cycles and compares")
    add("--set-cycles", **flag, help="sets Cycles in OUT.blend so that it shows what was fitted")


def _add_next_camera(commands: argparse._SubParsersAction) -> None:
    parser = _command(commands, "next-camera", ".commands.next_camera")
    parser.set_defaults(start=[], grid=[], unseen=[], **environment.NO_ENVIRONMENT)
    add = parser.add_argument
    scene = "a .blend file, or the folder or run.json of a fit: then at its fitted values"
    add("scene", metavar="SCENE", help=scene)
    many = {"action": "append", "default": []}
    add("--fit", **many, metavar="OWNER:PARAM[,PARAM]", help="what is unknown")
    add_captures(parser, "default: the captures of the scene")
    add("--bounds", **many, metavar="OWNER:PARAM=LO,HI")
    value = "a value to compute at; default: the fitted one, or the scene's"
    add("--set", **many, metavar="OWNER:PARAM=V[,V,V]", help=value)
    add("--height", type=int, help="pixels of the pictures that a fit would compare")
    add("--depth", type=int, help="bounces; 0: unlimited")
    add("--seed", type=int)
    add("--threads", type=int, help="0: all")
    add("--physical-refraction", action="store_true", default=None, help=_PHYSICAL)
    add(
        "--save", metavar="OUT.blend", help="saves a copy of the scene with the camera 'Next photo'"
    )


def _add_trade(commands: argparse._SubParsersAction) -> None:
    parser = _command(commands, "trade", ".commands.trade")
    parser.set_defaults(start=[], grid=[], unseen=[], **environment.NO_ENVIRONMENT)
    add = parser.add_argument
    add("scene", metavar="SCENE.blend")
    many = {"action": "append", "default": []}
    add("--fit", **many, metavar="OWNER:PARAM[,PARAM]", help="what the fits find")
    photo = "whose cameras and sizes count; its content does not. Default: the scene's cameras"
    add_captures(parser, photo)
    add("--bounds", **many, metavar="OWNER:PARAM=LO,HI")
    add("--budget", type=float, default=300.0, metavar="SECONDS", help="in all (%(default)g)")
    add("--loss", help="of every fit; default: robust")
    add("--optimiser", help="of every fit; default: auto")
    add("--seed", type=int)
    add("--threads", type=int, help="0: all")
    add("--physical-refraction", action="store_true", default=None, help=_PHYSICAL)
    add("--out", metavar="DIR", help="gets trade.csv, trade.json and trade.png")
    expected = "prints the expected seconds and errors of each preset, without fits; writes nothing"
    add("--expected", action="store_true", help=expected)


def _add_demo(commands: argparse._SubParsersAction) -> None:
    parser = _command(commands, "demo", ".demo")
    parser.add_argument("--out", default="selenite-demo", metavar="DIR")


def _at_least(low: int) -> Callable[[str], int]:
    def integer(text: str) -> int:
        value = int(text)
        if value < low:
            raise argparse.ArgumentTypeError(f"{value} is less than {low}")
        return value

    return integer
