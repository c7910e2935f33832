# SPDX-License-Identifier: GPL-3.0-or-later
"""What `./dev package` refuses to call a package."""

from __future__ import annotations

import ctypes
import math
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "devtools"))

import package_checks as checks  # noqa: E402

MANIFEST = 'id = "selenite"\nwheels = [{}]\n'
compiled = pytest.mark.skipif(shutil.which("c++") is None, reason="no C++ compiler")


def module(folder: Path, source: str, *options: str) -> Path:
    """A shared object _core made of `source`."""
    (folder / "_core.cpp").write_text(source)
    target = folder / "_core.cpython-311-x86_64-linux-gnu.so"
    command = ["c++", "-shared", "-fPIC", "-fvisibility=hidden", "-o", target, folder / "_core.cpp"]
    subprocess.run([*command, *options], check=True)
    return target


ENTRY = 'extern "C" __attribute__((visibility("default"))) void* PyInit__core() {{ {} }}\n'


@compiled
def test_a_module_of_python_and_c_alone_is_safe(tmp_path: Path) -> None:
    source = 'extern "C" void* PyModule_Create2();\n' + ENTRY.format("return PyModule_Create2();")
    assert checks.faults_of_module(module(tmp_path, source, "-nostdlib", "-lc")) == []


@compiled
def test_a_function_that_blender_has_too_is_a_fault(tmp_path: Path) -> None:
    source = 'extern "C" void* rtcNewDevice();\n' + ENTRY.format("return rtcNewDevice();")
    (fault,) = checks.faults_of_module(module(tmp_path, source, "-nostdlib", "-lc"))
    assert "takes rtcNewDevice from whatever has it" in fault


@compiled
def test_an_exported_function_is_a_fault(tmp_path: Path) -> None:
    seen = 'extern "C" __attribute__((visibility("default"))) void rtcNewDevice() {}\n'
    made = module(tmp_path, seen + ENTRY.format("return nullptr;"), "-nostdlib", "-lc")
    (fault,) = checks.faults_of_module(made)
    assert "exports rtcNewDevice; it may export PyInit__core alone" in fault


@compiled
def test_a_library_beyond_the_c_library_is_a_fault(tmp_path: Path) -> None:
    source = '#include <string>\nextern "C" int atoi(const char*);\n'
    source += ENTRY.format("std::string s(9999, 48); return reinterpret_cast<void*>(atoi(&s[0]));")
    (fault,) = checks.faults_of_module(module(tmp_path, source, "-fno-gnu-unique", "-O2"))
    assert "needs libstdc++.so.6, which a system may lack" in fault


@compiled
def test_the_c_library_that_a_module_needs_is_told(tmp_path: Path) -> None:
    source = "#include <cmath>\n" + ENTRY.format("static double x; x = std::exp(x); return &x;")
    assert (2, 2) <= checks.newest_glibc(module(tmp_path, source, "-fno-builtin")) < (3, 0)


USES_NEW_FUNCTIONS = """
#include <cmath>
#include <filesystem>
#include <memory>
#include <mutex>
#include <random>
#include <thread>
extern "C" __attribute__((visibility("default"))) double PyInit__core(double x) {
  const auto shared = std::make_shared<double>(std::random_device()() % 2 ? x : x);
  double sum = static_cast<double>(std::filesystem::exists("/"));
  std::once_flag once;
  std::call_once(once, [&] { sum += std::exp(*shared) + std::log(*shared); });
  std::thread([&, shared] { sum += std::pow(*shared, 1.5) + std::hypot(*shared, 2.0); }).join();
  return sum;
}
"""
PROJECT = """
cmake_minimum_required(VERSION 3.25)
project(probe CXX)
set(CMAKE_CXX_STANDARD 20)
set(SELENITE_STATIC_LIBRARIES none)
include({root}/cmake/oldest_glibc.cmake)
add_library(_core MODULE probe.cpp)
set_target_properties(_core PROPERTIES PREFIX "" CXX_VISIBILITY_PRESET hidden)
set(exports "${{CMAKE_SOURCE_DIR}}/exports")
target_link_options(_core PRIVATE -static-libstdc++ "-Wl,--version-script=${{exports}}")
selenite_oldest_glibc(_core)
"""


@compiled
@pytest.mark.skipif(sys.platform != "linux", reason="glibc is Linux's")
def test_modules_of_packages_run_with_the_glibc_of_blender(tmp_path: Path) -> None:
    """Threads, mathematics and files of the C++ library, all newer than 2.28 on this system."""
    (tmp_path / "cmake").symlink_to(ROOT / "cmake")
    (tmp_path / "CMakeLists.txt").write_text(PROJECT.format(root=ROOT))
    (tmp_path / "probe.cpp").write_text(USES_NEW_FUNCTIONS)
    (tmp_path / "exports").write_text("{ global: PyInit__core; local: *; };")
    for words in (["-S", tmp_path, "-B", tmp_path / "b"], ["--build", tmp_path / "b"]):
        subprocess.run(["cmake", *words], check=True, capture_output=True)
    made = tmp_path / "b" / "_core.so"
    assert checks.newest_glibc(made) <= (2, 28)
    assert checks.faults_of_module(made) == []
    function = ctypes.CDLL(str(made)).PyInit__core
    function.restype, function.argtypes = ctypes.c_double, [ctypes.c_double]
    x = 2.0
    expected = 1 + math.exp(x) + math.log(x) + x**1.5 + math.hypot(x, 2)
    assert function(x) == pytest.approx(expected, rel=1e-15)


def wheel(folder: Path, tag: str, leave_out: str = "", extra: str = "") -> Path:
    path = folder / f"selenite-0.1.0-{tag}-{tag}-manylinux_2_35_x86_64.whl"
    with zipfile.ZipFile(path, "w") as archive:
        for name in [*checks.IN_WHEEL, *([extra] if extra else [])]:
            if name != leave_out:
                archive.writestr(f"selenite/{name}" if name != extra else name, "")
    return path


def test_a_wheel_without_its_modules_is_refused(tmp_path: Path) -> None:
    faults = checks.faults_of_wheel(wheel(tmp_path, "cp313"), tmp_path)
    assert len(faults) == 2
    assert all("for cp313" in fault for fault in faults)


@pytest.mark.parametrize("ending", ["cpython-311-x86_64-linux-gnu.so", "cp311-win_amd64.pyd"])
def test_modules_of_a_wheel_are_found_by_each_systems_names(tmp_path: Path, ending: str) -> None:
    made, seen = wheel(tmp_path, "cp311"), []
    with zipfile.ZipFile(made, "a") as archive:
        for name in ("_core", "_image"):
            archive.writestr(f"selenite/{name}.{ending}", "")

    def faults_of_module(module: Path) -> list[str]:
        seen.append(module.name)
        return ["a fault"]

    assert checks.faults_of_wheel(made, tmp_path, faults_of_module) == ["a fault", "a fault"]
    assert seen == [f"_core.{ending}", f"_image.{ending}"]


def test_a_wheel_without_the_demo_or_with_a_library_is_refused(tmp_path: Path) -> None:
    made = wheel(
        tmp_path, "cp311", "demo_scene/jade_pendant/Front.png", "selenite.libs/libtbb.so.12"
    )
    faults = "\n".join(checks.faults_of_wheel(made, tmp_path))
    assert "lacks selenite/demo_scene/jade_pendant/Front.png" in faults
    assert "carries selenite.libs/libtbb.so.12" in faults


def extension(folder: Path, wheels: list[str], listed: list[str], bulk: int = 0) -> Path:
    path = folder / "selenite-0.1.0-extension.zip"
    with zipfile.ZipFile(path, "w") as archive:
        quoted = ", ".join(f'"./wheels/{name}"' for name in listed)
        archive.writestr("blender_manifest.toml", MANIFEST.format(quoted))
        archive.writestr("__init__.py", "")
        archive.writestr("LICENSE", "")
        for name in wheels:
            archive.writestr(f"wheels/{name}", bytes(bulk))
    return path


BOTH = [f"selenite-0.1.0-{tag}-{tag}-manylinux_2_35_x86_64.whl" for tag in ("cp311", "cp313")]


def test_an_extension_for_both_pythons_passes(tmp_path: Path) -> None:
    made = extension(tmp_path, BOTH, BOTH)
    assert checks.faults_of_extension(made, ["cp311", "cp313"]) == []


def test_an_extension_of_forty_megabytes_is_refused(tmp_path: Path) -> None:
    small = extension(tmp_path, BOTH, BOTH, bulk=19_990_000)
    assert checks.faults_of_extension(small, ["cp311"]) == []
    (fault,) = checks.faults_of_extension(extension(tmp_path, BOTH, BOTH, 20_000_000), ["cp311"])
    assert "40.0 MB; it may have less than 40" in fault


def test_an_extension_that_lists_what_it_lacks_is_refused(tmp_path: Path) -> None:
    faults = checks.faults_of_extension(extension(tmp_path, BOTH[:1], BOTH), ["cp311", "cp313"])
    assert len(faults) == 2
    assert "no wheel of Selenite for cp313" in faults[1]
