"""Runs the Conan recipe with stand-ins for what it imports, as Conan is not packaged by Debian.

usage: run_recipe.py ROOT PACKAGE_FOLDER
"""

import importlib.util
import pathlib
import shutil
import sys
import types


class Stub:
    """What a recipe writes to, whatever its name."""

    def __getattr__(self, name):
        value = Stub()
        setattr(self, name, value)
        return value

    def clear(self):
        self.cleared = True


class Recipe:
    def __init__(self, root, package):
        self.recipe_folder = self.source_folder = str(root)
        self.package_folder = str(package)
        self.cpp_info, self.info, self.settings = Stub(), Stub(), types.SimpleNamespace(os="Linux")
        self.required = []

    def requires(self, reference, **traits):
        self.required.append(reference)


def copy(recipe, pattern, source, target):
    files = [f for f in pathlib.Path(source).glob(f"**/{pattern}") if f.is_file()] if "*" in pattern else [
        pathlib.Path(source) / pattern]
    assert files, f"{pattern} matches nothing in {source}"
    for file in files:
        place = pathlib.Path(target) / file.relative_to(source)
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(file, place)


def main():
    root, package = map(pathlib.Path, sys.argv[1:])
    shutil.rmtree(package, ignore_errors=True)
    modules = {
        "conan": {"ConanFile": Recipe},
        "conan.tools": {},
        "conan.tools.build": {"check_min_cppstd": lambda recipe, least: None},
        "conan.tools.files": {"copy": copy, "load": lambda recipe, path: pathlib.Path(path).read_text()},
        "conan.tools.layout": {"basic_layout": lambda recipe: None},
    }
    for name, contents in modules.items():
        sys.modules[name] = types.ModuleType(name)
        vars(sys.modules[name]).update(contents)
    specification = importlib.util.spec_from_file_location("conanfile", root / "conanfile.py")
    conanfile = importlib.util.module_from_spec(specification)
    sys.dont_write_bytecode = True
    specification.loader.exec_module(conanfile)
    recipe = conanfile.GlobalmatchConan(root, package)
    recipe.set_version()
    recipe.requirements()
    recipe.package_id()
    recipe.package()
    recipe.package_info()
    for pattern in recipe.exports_sources:
        assert list(root.glob(pattern)), f"exports_sources: {pattern} matches nothing"
    assert recipe.info.cleared and recipe.cpp_info.libdirs == []
    assert (package / "licenses/LICENSE").exists()
    for header in (root / "include").glob("**/*.hpp"):
        packaged = package / header.relative_to(root)
        assert packaged.read_bytes() == header.read_bytes(), f"{packaged} differs"
    print(recipe.name, recipe.version, *recipe.required)


main()
