# SPDX-License-Identifier: GPL-3.0-or-later
"""Embree, OpenImageIO and what they need as static libraries, for the packages alone.

The distribution's OpenImageIO brings 249 shared libraries along. Here it is built with the five
formats that Selenite reads, from the distribution's own source packages. Versions and checksums
are pinned below. Sources, build trees and results lie in a cache outside the checkout;
`./dev build` and `./dev test` never come here.
"""

from __future__ import annotations

import shutil
import subprocess
import tarfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import cross
import mach_o
from process import JOBS, ROOT, Failed, digest, is_stamped, run, say, write_stamp

CACHE = cross.CACHE / "static"
KEYRING = Path("/usr/share/keyrings/debian-archive-keyring.gpg")
# The release whose source packages are asked, after those of the release that runs
NEWER = "trixie"

ON, OFF = "ON", "OFF"
COMMON = {
    "CMAKE_BUILD_TYPE": "Release",
    "CMAKE_INSTALL_LIBDIR": "lib",
    "CMAKE_POSITION_INDEPENDENT_CODE": ON,
    "CMAKE_C_VISIBILITY_PRESET": "hidden",
    "CMAKE_CXX_VISIBILITY_PRESET": "hidden",
    "CMAKE_VISIBILITY_INLINES_HIDDEN": ON,
    "CMAKE_CXX_FLAGS": "-ffunction-sections -fdata-sections",
    "CMAKE_C_FLAGS": "-ffunction-sections -fdata-sections",
    "BUILD_SHARED_LIBS": OFF,
    "BUILD_TESTING": OFF,
}
# A unique symbol would be one for all copies of a library in the process, hidden or not.
LINUX = {"CMAKE_CXX_FLAGS": f"-fno-gnu-unique {COMMON['CMAKE_CXX_FLAGS']}"}
# Sources that are compiled together: most of the time is their headers'.
JOINED = {"CMAKE_UNITY_BUILD": ON, "CMAKE_UNITY_BUILD_BATCH_SIZE": "8"}
# Headers without a library, of the distribution's packages: nothing in them is of one platform
HEADERS = ("boost", "eigen3", "fmt", "tsl")
# Of OpenImageIO: libraries it goes without, formats that Selenite does not read, algorithms
UNUSED = (
    *("libjpeg-turbo", "FREETYPE", "OPENCOLORIO", "OPENCV", "TBB", "DCMTK", "FFMPEG", "GIF"),
    *("LIBHEIF", "LIBRAW", "OPENJPEG", "OPENVDB", "PTEX", "WEBP", "NUKE", "R3DSDK"),
)
UNREAD = (
    *("BMP", "CINEON", "DDS", "DICOM", "DPX", "FFMPEG", "FITS", "GIF", "HEIF", "ICO", "IFF"),
    *("JPEG2000", "NULL", "OPENVDB", "PNM", "PSD", "PTEX", "R3D", "RAW", "RLA", "SGI"),
    *("SOFTIMAGE", "TARGA", "TERM", "WEBP", "ZFILE"),
)
UNCALLED = (
    *("pixelmath", "channels", "compare", "deep", "addsub", "muldiv", "mad", "minmaxchan"),
    *("orient", "xform"),
)


@dataclass(frozen=True)
class Library:
    """One source package: its files with their SHA-256, and how it is configured."""

    name: str
    version: str
    files: Mapping[str, str]
    options: Mapping[str, str] = field(default_factory=dict)
    #: Files that the installation asks for and the distribution has taken out of the sources
    placeholders: tuple[str, ...] = ()
    #: Beginnings of lines that are taken out of a CMake file: sources of what is switched off
    left_out: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    autotools: bool = False
    #: What is done on top where it is built for another platform: options, texts in files
    foreign_options: Mapping[str, str] = field(default_factory=dict)
    foreign_texts: Mapping[str, tuple[tuple[str, str], ...]] = field(default_factory=dict)
    #: Options and texts on top of those, by the name of the platform
    options_on: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    texts_on: Mapping[str, Mapping[str, tuple[tuple[str, str], ...]]] = field(default_factory=dict)

    def options_for(self, platform: cross.Platform | None) -> dict[str, str]:
        if platform is None:
            return {**self.options}
        return {**self.options, **self.foreign_options, **self.options_on.get(platform.name, {})}

    def texts_for(self, platform: cross.Platform | None) -> dict[str, tuple[tuple[str, str], ...]]:
        if platform is None:
            return {}
        return {**self.foreign_texts, **self.texts_on.get(platform.name, {})}

    def recipe(self, platform: cross.Platform | None) -> str:
        """What its build for a platform depends on."""
        sources = self.version, self.files, self.placeholders, self.left_out, self.autotools
        return repr((self.name, *sources, self.options_for(platform), self.texts_for(platform)))


# What Linux has as libraries of the distribution
FOREIGN = (
    Library(
        "zlib",
        "1:1.3.dfsg+really1.3.1-1+deb13u1",
        {
            "zlib_1.3.dfsg+really1.3.1.orig.tar.gz": (
                "60dd315c07f616887caa029408308a018ace66e3d142726a97db164b3b8f69fb"
            ),
        },
        foreign_options={"ZLIB_BUILD_EXAMPLES": OFF},
        foreign_texts={
            "CMakeLists.txt": (
                ("add_library(zlib SHARED", "add_library(zlib SHARED EXCLUDE_FROM_ALL"),
                ("install(TARGETS zlib zlibstatic", "install(TARGETS zlibstatic"),
                # Not among the distribution's sources
                ("win32/zlib1.rc # If present", "# If present"),
            )
        },
    ),
    Library(
        "libpng1.6",
        "1.6.39-2+deb12u5",
        {
            "libpng1.6_1.6.39.orig.tar.gz": (
                "a00e9d2f2f664186e4202db9299397f851aea71b36a35e74910b8820e380d441"
            ),
            "libpng1.6_1.6.39-2+deb12u5.debian.tar.xz": (
                "ab14906eda9fddf14cbb1e589b9ba7439c22e233dc3c5e3cf9356c9625565a82"
            ),
        },
        {"PNG_SHARED": OFF, "PNG_TESTS": OFF, "PNG_EXECUTABLES": OFF},
        # A header of systems before macOS X
        texts_on={"macos": {"pngpriv.h": ((" || defined(TARGET_OS_MAC)", ""),)}},
    ),
    Library(
        "libjpeg-turbo",
        "1:2.1.5-2",
        {
            "libjpeg-turbo_2.1.5.orig.tar.gz": (
                "254f3642b04e309fee775123133c6464181addc150499561020312ec61c1bf7c"
            ),
            "libjpeg-turbo_2.1.5-2.debian.tar.xz": (
                "cdb2433c2f7101345c1ffa14efb943787c675b86354691a32490845fe4bc9237"
            ),
        },
        {
            # Its assembler code asks for an assembler of its own, and has the same results.
            "WITH_SIMD": OFF,
            "ENABLE_SHARED": OFF,
            "WITH_TURBOJPEG": OFF,
            # It takes what has no type for a path from here.
            "CMAKE_INSTALL_LIBDIR:STRING": "lib",
        },
    ),
    Library(
        "googletest",
        "1.12.1-0.2",
        {
            "googletest_1.12.1.orig.tar.gz": (
                "81964fe578e9bd7c94dfdb09c8e4d6e6759e19967e397dbea48d1c10e45d0df2"
            )
        },
        {"BUILD_GMOCK": OFF},
    ),
)
LIBRARIES = (
    Library(
        "embree",
        "3.13.5+dfsg-2",
        {
            "embree_3.13.5+dfsg.orig.tar.xz": (
                "1b7c5b6144230ad81b92ece884a2017fbbb433bf5416a6fca9257e0109501c63"
            )
        },
        {
            "EMBREE_STATIC_LIB": ON,
            "EMBREE_TASKING_SYSTEM": "INTERNAL",
            "EMBREE_ISPC_SUPPORT": OFF,
            "EMBREE_TUTORIALS": OFF,
            "EMBREE_MAX_ISA": "NONE",
            "EMBREE_ISA_SSE2": OFF,
            "EMBREE_ISA_SSE42": ON,
            # Without AVX its AVX2 code lacks functions that a shared object misses when it loads.
            "EMBREE_ISA_AVX": ON,
            "EMBREE_ISA_AVX2": ON,
            "EMBREE_ISA_AVX512": OFF,
            "EMBREE_RAY_MASK": ON,
            "EMBREE_FILTER_FUNCTION": OFF,
            "EMBREE_GEOMETRY_QUAD": OFF,
            "EMBREE_GEOMETRY_CURVE": OFF,
            "EMBREE_GEOMETRY_SUBDIVISION": OFF,
            "EMBREE_GEOMETRY_USER": OFF,
            "EMBREE_GEOMETRY_GRID": OFF,
            "EMBREE_GEOMETRY_POINT": OFF,
        },
        foreign_options={
            "CMAKE_CXX_FLAGS": f"{COMMON['CMAKE_CXX_FLAGS']} -D_USE_MATH_DEFINES -w",
            "EMBREE_IGNORE_CMAKE_CXX_FLAGS": OFF,
            "EMBREE_ISA_AVX": OFF,
            "EMBREE_ISA_AVX2": OFF,
            **JOINED,
        },
        options_on={
            "macos": {
                "EMBREE_ISA_SSE42": OFF,
                "EMBREE_ISA_NEON": ON,
                "EMBREE_ISA_NEON2X": OFF,
            }
        },
        # Members that are not there: newer compilers look.
        foreign_texts={
            "kernels/subdiv/bezier_curve.h": (
                ('( (" << a.u.lower << ", " << a.u.upper << "), " << a.v0', '( " << a.v0'),
            ),
            "kernels/geometry/pointi.h": (('<< line.v0 << ", " ', ""),),
            "kernels/bvh/bvh_builder.h": (('#include "bvh.h"', '#pragma once\n#include "bvh.h"'),),
            "kernels/CMakeLists.txt": (("  embree.rc\n", ""),),
            # Sources that define the same name, each for itself
            "kernels/common/rtcore.cpp": (("g_mutex", "g_rtcore_mutex"),),
            "common/lexers/CMakeLists.txt": (
                ("ADD_LIBRARY(lexers", "SET(CMAKE_UNITY_BUILD OFF)\nADD_LIBRARY(lexers"),
            ),
        },
        placeholders=("readme.pdf",),
        # Compiled whatever the options say, and three quarters of the time
        left_out={"kernels/CMakeLists.txt": ("geometry/curve_intersector_virtual_",)},
    ),
    Library(
        "imath",
        "3.1.6-1",
        {
            "imath_3.1.6.orig.tar.gz": (
                "ea5592230f5ab917bea3ceab266cf38eb4aa4a523078d46eac0f5a89c52304db"
            )
        },
    ),
    Library(
        "openexr",
        "3.1.5-5",
        {
            "openexr_3.1.5.orig.tar.gz": (
                "93925805c1fc4f8162b35f0ae109c4a75344e6decae5a240afdfce25f8a433ec"
            )
        },
        {"OPENEXR_BUILD_TOOLS": OFF, "OPENEXR_INSTALL_EXAMPLES": OFF, "DOCS": OFF},
    ),
    Library(
        "tiff",
        "4.5.0-6+deb12u4",
        {
            "tiff_4.5.0.orig.tar.bz2": (
                "638f43d7dea33948d5dee7f39572fc0194d9cc3c74195de9dd26a4388a1f880a"
            ),
            "tiff_4.5.0-6+deb12u4.debian.tar.xz": (
                "4ee50a8cdf74a184d94e65a04f3c9de466cb0b74ef5393fb5ca65666fccb864b"
            ),
        },
        {
            **{f"tiff-{part}": OFF for part in ("tools", "tests", "contrib", "docs")},
            **{part: OFF for part in ("cxx", "jbig", "lerc", "lzma", "webp", "zstd", "libdeflate")},
        },
    ),
    Library(
        "lcms2",
        "2.14-2+deb12u1",
        {
            "lcms2_2.14.orig.tar.gz": (
                "28474ea6f6591c4d4cee972123587001a4e6e353412a41b3e9e82219818d5740"
            ),
            "lcms2_2.14-2+deb12u1.debian.tar.xz": (
                "3b88006a5ccc15f3d4b2f28310875a8c4d789ac8342deaf4113ed5c2fd4a59e8"
            ),
        },
        autotools=True,
    ),
    Library(
        "openimageio",
        "2.5.18.0+dfsg-1",
        {
            "openimageio_2.5.18.0+dfsg.orig.tar.xz": (
                "0dc2185aac5e01a2e5a1a804f558c1190ea048650a7fedef1033a1616abcac80"
            )
        },
        {
            "CMAKE_CXX_STANDARD": "17",
            # It only hands over what libpng, libjpeg, libtiff and OpenEXR have decoded.
            "CMAKE_CXX_FLAGS_RELEASE": "-O1 -DNDEBUG",
            "OIIO_BUILD_TOOLS": OFF,
            "OIIO_BUILD_TESTS": OFF,
            "OIIO_DISABLE_BOOST_STACKTRACE": ON,
            "BUILD_DOCS": OFF,
            "INSTALL_DOCS": OFF,
            "INSTALL_FONTS": OFF,
            "EMBEDPLUGINS": ON,
            "BUILD_MISSING_FMT": OFF,
            "BUILD_MISSING_ROBINMAP": OFF,
            "LINKSTATIC": ON,
            "USE_CCACHE": OFF,
            "USE_PYTHON": OFF,
            "USE_QT": OFF,
            **{f"USE_{name}": OFF for name in UNUSED},
            **{f"ENABLE_{name}": OFF for name in UNREAD},
        },
        # Image algorithms and textures: most of the time, and no reader or writer of files calls
        # them. The module is linked with -z defs: what is missed shows there.
        left_out={
            "src/libOpenImageIO/CMakeLists.txt": (
                *(f"imagebufalgo_{name}.cpp" for name in UNCALLED),
                "maketexture.cpp",
                "printinfo.cpp",
                "../libtexture/texture",
                "../libtexture/environment.cpp",
            )
        },
        # Boost asks for a class that C++17 has no more.
        foreign_options={
            "CMAKE_CXX_FLAGS": f"{COMMON['CMAKE_CXX_FLAGS']} -DBOOST_NO_CXX98_FUNCTION_BASE -w",
        },
        # Of Boost it needs one class with a library: an error text for each thread and reader.
        # Here no two threads share a reader.
        foreign_texts={
            "src/cmake/externalpackages.cmake": (
                ("set (Boost_COMPONENTS thread)", "set (Boost_COMPONENTS)"),
                # The distribution's fmt says that its headers lie among the C library's.
                (
                    "find_or_download_fmt()",
                    "find_path (FMT_INCLUDE_DIR fmt/core.h REQUIRED)\n"
                    "add_library (fmt::fmt-header-only INTERFACE IMPORTED)\n"
                    "set_target_properties (fmt::fmt-header-only PROPERTIES"
                    " INTERFACE_COMPILE_DEFINITIONS FMT_HEADER_ONLY=1)",
                ),
            ),
            # Its fmt asks for a class that newer libc++ for Windows does not have.
            "src/include/OpenImageIO/detail/fmt.h": (
                (
                    "#include <OpenImageIO/detail/fmt/ostream.h>",
                    "#include <fstream>\n#include <ostream>\n"
                    '#pragma push_macro("_LIBCPP_VERSION")\n#undef _LIBCPP_VERSION\n'
                    "#include <OpenImageIO/detail/fmt/ostream.h>\n"
                    '#pragma pop_macro("_LIBCPP_VERSION")',
                ),
            ),
            **{
                f"src/libOpenImageIO/image{way}put.cpp": (
                    ("#include <boost/thread/tss.hpp>", "#include <memory>"),
                    ("using boost::thread_specific_ptr;\n", ""),
                    ("thread_specific_ptr<", "std::unique_ptr<"),
                )
                for way in ("in", "out")
            },
        },
    ),
)


def prefix(platform: cross.Platform | None = None) -> Path:
    """Builds what is not there yet; returns the folder to be searched for libraries first.

    `platform`: None for the one that this runs on.
    """
    place = Place(platform)
    libraries = LIBRARIES if platform is None else (*FOREIGN, *LIBRARIES)
    before = ""
    if platform is not None:
        cross.ensure(platform)
        _link_headers(place.prefix / "include")
    for library in libraries:
        alone = library.name == "embree"  # it is built on nothing, and nothing on it
        key = digest([library.recipe(platform), *place.recipe, "" if alone else before])
        stamp = place.folder / "stamps" / library.name
        if not is_stamped(stamp, key):
            _build(library, place)
            if platform is cross.MACOS:
                for archive in sorted((place.prefix / "lib").glob("*.a")):
                    mach_o.hide_names(archive)
            write_stamp(stamp, key)
        before = before if alone else key
    if platform is None:
        _take_from_system(place.prefix)
    return place.prefix


@dataclass(frozen=True)
class Place:
    """Where the libraries of a platform are built, and with which settings of CMake."""

    platform: cross.Platform | None

    @property
    def folder(self) -> Path:
        return CACHE if self.platform is None else CACHE / self.platform.name

    @property
    def prefix(self) -> Path:
        return self.folder / "prefix"

    @property
    def settings(self) -> dict[str, str]:
        own = LINUX if self.platform is None else self.platform.cmake()
        places = ("CMAKE_INSTALL_PREFIX", "CMAKE_PREFIX_PATH", "CMAKE_FIND_ROOT_PATH")
        return {**COMMON, **{name: str(self.prefix) for name in places}, **own}

    @property
    def recipe(self) -> list[str | Path]:
        """What results depend on: the same in every checkout."""
        settings = self.settings
        toolchain = settings.pop("CMAKE_TOOLCHAIN_FILE", None)
        return [repr(settings), _compiler(self.platform), *([Path(toolchain)] if toolchain else [])]


def _link_headers(target: Path) -> None:
    """The distribution's headers of libraries that are nothing else, within reach of the prefix.

    The folder that they lie in has the C library's too, which are those of this system.
    """
    target.mkdir(parents=True, exist_ok=True)
    for name in HEADERS:
        here = target / name
        if not here.is_symlink():
            here.symlink_to(Path("/usr/include") / name)


def _take_from_system(target: Path) -> None:
    """The distribution's libpng and libjpeg, with its patches, for use inside a shared object.

    They are not compiled for that, but one variable is all that stands against it: `stderr` of the
    C library. Under another name it is ours (cmake/oldest_glibc.cpp.in).
    """
    for name in ("libpng16.a", "libjpeg.a"):
        asked = ["c++", f"-print-file-name={name}"]
        found = subprocess.run(asked, capture_output=True, text=True, check=True).stdout.strip()
        rename = ["--redefine-sym", "stderr=selenite_stderr"]
        run(["objcopy", *rename, found, target / "lib" / name])


def _compiler(platform: cross.Platform | None) -> str:
    if platform is not None:
        return cross.compiler()
    return subprocess.run(
        ["c++", "--version"], capture_output=True, text=True, check=True
    ).stdout.splitlines()[0]


def _build(library: Library, place: Place) -> None:
    source, build = place.folder / "src" / library.name, place.folder / "build" / library.name
    shutil.rmtree(build, ignore_errors=True)
    _unpack(library, source)
    options = library.options_for(place.platform)
    if place.platform is not None:
        _replace(library.texts_for(place.platform), source)
    say(f"building {library.name} {library.version} as a static library (once)")
    if library.autotools:
        build.mkdir(parents=True)
        words = ["--disable-shared", "--with-pic", f"--prefix={place.prefix}"]
        flags = f"-O2 -DNDEBUG -fvisibility=hidden {COMMON['CMAKE_C_FLAGS']}"
        env = {"CFLAGS": flags}
        if platform := place.platform:
            words.append(f"--host={platform.host}")
            tools = {"CC": "clang", "AR": "ar", "RANLIB": "ranlib"}
            env |= {name: str(platform.tool(tool)) for name, tool in tools.items()}
        run([source / "configure", "--quiet", *words], build, env)
        run(["make", "--silent", "-C", "src", f"-j{JOBS}", "install"], build)
        run(["make", "--silent", "-C", "include", "install"], build)
        return
    settings = [f"-D{name}={value}" for name, value in {**place.settings, **options}.items()]
    run(["cmake", "-G", "Ninja", "-S", source, "-B", build, "-Wno-dev", *settings])
    run(["cmake", "--build", build, f"-j{JOBS}"])
    run(["cmake", "--install", build])


def _replace(texts: Mapping[str, Sequence[tuple[str, str]]], source: Path) -> None:
    for name, pairs in texts.items():
        path = source / name
        content = path.read_text()
        for old, new in pairs:
            if old not in content:
                raise Failed(f"{path} has no {old!r}, which is to be replaced")
            content = content.replace(old, new)
        path.write_text(content)


def _unpack(library: Library, target: Path) -> None:
    """The sources with the distribution's patches, in `target`."""
    archives = _fetch(library)
    shutil.rmtree(target, ignore_errors=True)
    unpacked = target.with_suffix(".partial")
    shutil.rmtree(unpacked, ignore_errors=True)
    for path in archives:
        with tarfile.open(path) as archive:
            # Debian 12's Python has no filters; what is unpacked has a known checksum.
            safe = {"filter": "data"} if hasattr(tarfile, "data_filter") else {}
            archive.extractall(unpacked, **safe)
    (original,) = [folder for folder in unpacked.iterdir() if folder.name != "debian"]
    series = unpacked / "debian" / "patches" / "series"
    if series.is_file():
        for line in series.read_text().splitlines():
            name = line.partition("#")[0].strip()
            if name:
                run(["patch", "--quiet", "-p1", "-i", series.parent / name], original)
    for name in library.placeholders:
        (original / name).touch()
    for name, beginnings in library.left_out.items():
        path = original / name
        lines = path.read_text().splitlines(keepends=True)
        path.write_text("".join(x for x in lines if not x.strip().startswith(beginnings)))
    original.rename(target)
    shutil.rmtree(unpacked)


def _fetch(library: Library) -> list[Path]:
    """The source package's files, checked. What is in the cache is not asked for again."""
    folder = CACHE / "sources"
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / name for name in library.files]

    def wrong() -> list[str]:
        sums = library.files.items()
        return [n for n, s in sums if not (folder / n).is_file() or _sha256(folder / n) != s]

    if wrong():
        settings = _apt()
        # It fails where one file of a package is no longer served, and yet brings the others.
        words = ["apt-get", *settings, "--quiet", "--download-only", "--only-source", "source"]
        subprocess.call([*words, f"{library.name}={library.version}"], cwd=folder)
    if missing := wrong():
        raise Failed(
            f"{', '.join(missing)} of the source package {library.name} {library.version} cannot "
            f"be had here, or is not the file of the checksum in "
            f"{Path(__file__).relative_to(ROOT)}; put the file into {folder}"
        )
    return paths


def _sha256(path: Path) -> str:
    import hashlib

    return hashlib.sha256(path.read_bytes()).hexdigest()


def _apt() -> list[str]:
    """Options that let apt see source packages, without touching the system's own lists."""
    place = CACHE / "apt"
    sources, lists = place / "sources.list", place / "lists"
    options = {
        "Dir::Etc::sourcelist": sources,
        "Dir::Etc::sourceparts": "/dev/null",
        "Dir::State::lists": lists,
        "Dir::Cache": place / "cache",
        "APT::Sandbox::User": "root",
    }
    settings = [f"-o{name}={value}" for name, value in options.items()]
    if not sources.is_file():
        asked = ["indextargets", "--format", "$(REPO_URI) $(CODENAME)", "Identifier: Packages"]
        listing = subprocess.run(
            ["apt-get", *asked], capture_output=True, text=True, check=True
        ).stdout
        here = sorted({tuple(line.split()) for line in listing.splitlines() if "debian" in line})
        if not here:
            raise Failed("this system's package sources name no Debian mirror: ./dev package "
                         "takes the sources of its libraries from one")  # fmt: skip
        main = min(here, key=lambda item: len(item[1]))
        (lists / "partial").mkdir(parents=True, exist_ok=True)
        sources.write_text("".join(
            f"deb-src [signed-by={KEYRING}] {uri} {suite} main\n"
            for uri, suite in [*here, (main[0], NEWER)]
        ))  # fmt: skip
        run(["apt-get", *settings, "--quiet", "update"])
    return settings
