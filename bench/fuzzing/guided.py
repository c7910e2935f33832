# SPDX-License-Identifier: GPL-3.0-or-later
"""Fuzzes the readers of reconstructions by coverage: guided.py FOLDER [OPTION OF LIBFUZZER ...].

For an environment of its own with atheris 3.0, numpy, pillow and defusedxml in it. With
`-max_total_time=600 -rss_limit_mb=1024` it takes ten minutes. The first byte of an input says which
file it is, the rest is what the file holds. Any exception but ReconstructionError is a crash, and
so is memory beyond the limit; both are kept in FOLDER.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import atheris

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "bench")]

with atheris.instrument_imports(include=["selenite.importers"]):
    from selenite.importers.read import read_reconstruction
    from selenite.importers.reconstruction import ReconstructionError

from fuzzing.reconstruction_seeds import make, paths  # noqa: E402


class Readers:
    """Reads inputs as files of small reconstructions, whose other files are whole."""

    def __init__(self, folder: Path) -> None:
        shutil.rmtree(folder / "case", ignore_errors=True)
        (folder / "case").mkdir(parents=True)
        make(folder / "case")
        found = sorted(path for path in (folder / "case").rglob("*") if path.is_file())
        self.files = [path for path in found if path.suffix != ".png"]
        self.whole = {path: path.read_bytes() for path in self.files}
        corpus = folder / "corpus"
        corpus.mkdir(exist_ok=True)
        for index, path in enumerate(self.files):
            (corpus / f"seed_{index}").write_bytes(bytes([index]) + self.whole[path])

    def read(self, data: bytes) -> None:
        """One input."""
        if not data:
            return
        path = self.files[data[0] % len(self.files)]
        path.write_bytes(data[1:])
        try:
            read_reconstruction(*paths(path.parent))
        except ReconstructionError as error:
            assert "\n" not in str(error)
        finally:
            path.write_bytes(self.whole[path])


def main() -> None:
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    readers = Readers(folder)
    options = [f"-artifact_prefix={folder}/", str(folder / "corpus"), *sys.argv[2:]]
    atheris.Setup([sys.argv[0], *options], readers.read)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
