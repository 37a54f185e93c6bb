"""How pip builds the package cab: setuptools, whose command build_py calls CMake for the extension module.

CMAKE_ARGS has further arguments for CMake's configuration: -DCAB_BUILD_COMMAND=ON puts the command cab into the wheel,
-DCAB_PYTHON_FILES=OFF leaves out what reads motion files and robots. The build is in build/python, and stays there for
the next time. CAB_PYTHON_BUILD names another folder, which is taken as it is configured.
"""

import importlib.util
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig


def require_tools() -> None:
    """Ends with one message that names everything that the build needs and this Python or PATH lacks."""
    missing = [f"the Python module {name}" for name in ("setuptools", "wheel") if not importlib.util.find_spec(name)]
    if not pathlib.Path(sysconfig.get_path("include"), "Python.h").exists():
        missing.append("Python.h, the headers of this Python")
    if not shutil.which("cmake"):
        missing.append("the program cmake")
    if missing:
        sys.exit(
            f"cab cannot be built by {sys.executable}, since it lacks {', '.join(missing)}.\n"
            "On Debian, docs/python.md has the packages to install. Debian's modules are seen by an environment of "
            "Debian's Python alone: /usr/bin/python3 -m venv --system-site-packages FOLDER"
        )


require_tools()

from setuptools.build_meta import *  # noqa: F403, E402 - the backend is that of setuptools
from setuptools.command.build_py import build_py  # noqa: E402
from wheel.bdist_wheel import bdist_wheel  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[3]


def read_version() -> str:
    """The version in layout/include/cab/version.h, as Python writes it: 1.0.0-rc is 1.0.0rc0."""
    text = (ROOT / "layout/include/cab/version.h").read_text(encoding="utf-8")
    numbers = re.findall(r"^#define CAB_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)$", text, re.M)
    if len(numbers) != 3:
        raise RuntimeError("layout/include/cab/version.h does not say the version in three numbers")
    stage = re.search(r'^#define CAB_VERSION_\w+ "-rc\.?(\d*)"$', text, re.M)
    return ".".join(numbers) + (f"rc{stage.group(1) or 0}" if stage else "")


class UnsupportedOperation(Exception):
    """What a backend raises that has no source distributions (PEP 517)."""


def build_sdist(sdist_directory: str, config_settings: object = None) -> str:
    """There is no source distribution: the package is built in a checkout, by `pip install .` or `pip wheel .`."""
    raise UnsupportedOperation("cab has no source distribution: in a checkout, `pip wheel .` makes a wheel")


VERSION = read_version()
(ROOT / "build").mkdir(exist_ok=True)  # for setuptools' own files


class BuildWithCMake(build_py):
    """Copies the Python files, as always, then builds and installs what CMake makes beside them."""

    def run(self) -> None:
        shutil.rmtree(pathlib.Path(self.build_lib) / "cab", ignore_errors=True)  # of an earlier build
        super().run()
        given = os.environ.get("CAB_PYTHON_BUILD")
        folder = pathlib.Path(given).resolve() if given else ROOT / "build" / "python"
        if not given:
            self.configure(folder)
        jobs = os.environ.get("CMAKE_BUILD_PARALLEL_LEVEL", str(os.cpu_count() or 1))
        self.call("cmake", "--build", str(folder), "--target", "cab_python_wheel", "--parallel", jobs)
        target = pathlib.Path(self.build_lib).resolve()
        self.call("cmake", "--install", str(folder), "--component", "python_wheel", "--prefix", str(target))

    def configure(self, folder: pathlib.Path) -> None:
        """Configures CMake. What CMAKE_ARGS says comes last, so it overrules."""
        (folder / "CMakeCache.txt").unlink(missing_ok=True)  # what CMAKE_ARGS said for an earlier build does not stay
        arguments = ["-DCMAKE_BUILD_TYPE=Release", "-DCAB_BUILD_PYTHON=ON", f"-DPython_EXECUTABLE={sys.executable}"]
        arguments += ["-DBUILD_SHARED_LIBS=OFF", "-DCAB_BUILD_COMMAND=OFF", "-DCAB_BUILD_TESTS=OFF"]
        arguments += ["-DCAB_PYTHON_FILES=ON"]
        if importlib.util.find_spec("pybind11"):  # pip's own, which CMake does not find; Debian's has no module
            arguments.append(f"-Dpybind11_DIR={importlib.import_module('pybind11').get_cmake_dir()}")
        given = shlex.split(os.environ.get("CMAKE_ARGS", ""))
        if shutil.which("ninja") and not any(word.startswith("-G") for word in given):
            arguments += ["-G", "Ninja"]
        arguments += given
        self.call("cmake", "-S", str(ROOT), "-B", str(folder), *arguments)

    def call(self, *command: str) -> None:
        """Runs a command, whose output is that of the build."""
        print(" ".join(command), flush=True)
        subprocess.run(command, check=True)


class PlatformWheel(bdist_wheel):
    """A wheel for this Python and this platform, since there is an extension module in it."""

    def finalize_options(self) -> None:
        super().finalize_options()
        self.root_is_pure = False
