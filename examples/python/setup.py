"""Builds the module from the sources of the library, of which this folder is a part."""
import os
import re
import shutil
import subprocess
from pathlib import Path

from pybind11.setup_helpers import ParallelCompile, Pybind11Extension
from setuptools import setup

here = Path(__file__).resolve().parent
root = here.parents[1]
built = root / "build" / "python"
built.mkdir(parents=True, exist_ok=True)

project = re.search(r"project\([^)]*?VERSION\s+([\d.]+)", (root / "CMakeLists.txt").read_text(encoding="utf-8"))
version = project.group(1)


def eigen():
    """The folder of Eigen's headers."""
    if "EIGEN3_INCLUDE_DIR" in os.environ:
        return os.environ["EIGEN3_INCLUDE_DIR"]
    if shutil.which("pkg-config"):
        found = subprocess.run(["pkg-config", "--cflags-only-I", "eigen3"], capture_output=True, text=True)
        if found.returncode == 0 and found.stdout.startswith("-I"):
            return found.stdout.split()[0][2:]
    return "/usr/include/eigen3"


shared = ["atomic_file", "process_identity", "warnings"]  # with the programs
sources = [*sorted((root / "src").glob("*.cpp")), *(root / f"examples/support/{name}.cpp" for name in shared),
           *sorted((here / "src").glob("*.cpp"))]

ParallelCompile("CMAKE_BUILD_PARALLEL_LEVEL").install()
setup(
    version=version,
    packages=["globalmatch"],
    package_data={"globalmatch": ["py.typed", "*.pyi"]},
    ext_modules=[
        Pybind11Extension(
            "globalmatch._globalmatch",
            [os.path.relpath(source, here) for source in sources],
            include_dirs=[str(root / "include"), str(root / "examples"), eigen()],
            define_macros=[("GLOBALMATCH_COMPILED", None), ("GLOBALMATCH_VERSION", f'"{version}"')],
            extra_compile_args=["-O3"],
            cxx_std=20,
        )
    ],
    zip_safe=False,
    # All that is built goes beside what CMake builds.
    options={
        "build": {"build_base": str(built / "build")},
        "egg_info": {"egg_base": str(built)},
    },
)
