#!/usr/bin/env python3
"""Runs Conan's recipe, and that of its test package, where there is no Conan: run_recipe.py RECIPE
WORK

The modules that they import are stand-ins, which call the methods in Conan's order, and CMake for
them; libraries are this machine's. The sources that the recipe exports are configured, and what the
build reads must be among them; built are those of the repository, which ccache knows. Leaves the
package in WORK/package.
"""
import fnmatch
import importlib.util
import os
import pathlib
import re
import shutil
import subprocess
import sys
import types


class Attributes(dict):
    """What Conan has as objects with attributes: folders, cpp_info."""

    __getattr__ = dict.__getitem__
    __setattr__ = dict.__setitem__

    def set_property(self, name, value):
        self[name] = value


class ConanFile:
    def __init__(self, recipe_folder):
        declared = self.settings
        self.settings = Attributes(
            os="Linux", arch="x86_64", build_type="Release", compiler=Attributes(cppstd="gnu17")
        )
        assert set(declared) == set(self.settings), declared
        self.recipe_folder = str(recipe_folder)
        self.folders = Attributes()
        self.cpp = Attributes(build=Attributes())
        self.cpp_info = Attributes()
        self.required, self.cache_variables = [], {}

    def requires(self, reference, visible=True):
        self.required.append(reference)

    def tool_requires(self, reference):
        assert re.fullmatch(r"[a-z]+/\[>=[0-9.]+\]", reference), reference

    def run(self, command, env):
        subprocess.run([command], check=True)


class CMakeToolchain:
    def __init__(self, recipe, generator):
        assert generator == "Ninja"
        self.recipe, self.cache_variables = recipe, {}

    def generate(self):
        self.recipe.cache_variables = self.cache_variables


class Generator:
    def __init__(self, recipe):
        pass

    def generate(self):
        pass


class CMake:
    def __init__(self, recipe):
        self.recipe = recipe

    def configure(self):
        build = pathlib.Path(self.recipe.build_folder)
        # Conan's toolchain file has the profile's C++ standard (a detected one has the compiler's
        # default), the folders of GNUInstallDirs, and where the packages are whose CMake files are
        # their own.
        prefixes = ";".join(getattr(self.recipe, "package_prefixes", []))
        toolchain = build / "conan_toolchain.cmake"
        build.mkdir(parents=True)
        standard = self.recipe.settings.compiler.cppstd.removeprefix("gnu")
        toolchain.write_text(
            f"set(CMAKE_CXX_STANDARD {standard})\nset(CMAKE_INSTALL_LIBDIR"
            ' "lib")\nset(CMAKE_INSTALL_BINDIR "bin")\nlist(PREPEND CMAKE_PREFIX_PATH'
            f' "{prefixes}")\n'
        )
        options = [f"-D{name}={value}" for name, value in self.recipe.cache_variables.items()]
        command = [
            "cmake",
            "-S",
            self.recipe.source_folder,
            "-B",
            build,
            "-G",
            "Ninja",
            f"--toolchain={toolchain}",
            "-DCMAKE_BUILD_TYPE=Release",
        ]
        printed = subprocess.run(
            command + options,
            check=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        ).stdout
        print(printed)
        unused = printed.partition("Manually-specified variables were not used by the project:")[
            2
        ].split()
        unknown = set(unused) & set(self.recipe.cache_variables)
        assert not unknown, f"the project does not know the recipe's {unknown}"

    def build(self):
        subprocess.run(["cmake", "--build", self.recipe.build_folder, "-j", "2"], check=True)

    def install(self):
        subprocess.run(
            [
                "cmake",
                "--install",
                self.recipe.build_folder,
                "--prefix",
                self.recipe.package_folder,
            ],
            check=True,
        )


def cmake_layout(recipe, src_folder="."):
    recipe.folders.source = src_folder
    recipe.cpp.build.bindir = recipe.build_folder


def copy(recipe, pattern, src, dst):
    src, dst = pathlib.Path(src).resolve(), pathlib.Path(dst)
    found = [
        path
        for path in src.glob(pattern.split("*")[0] or "*")
        for path in ([path] if path.is_file() else path.rglob("*"))
    ]
    found = [
        path
        for path in found
        if path.is_file() and fnmatch.fnmatch(str(path.relative_to(src)), pattern)
    ]
    assert found, f"{pattern} is no file of {src}"
    for path in found:
        (dst / path.relative_to(src)).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(path, dst / path.relative_to(src))


def load(recipe, path):
    return pathlib.Path(path).read_text()


MODULES = {
    "conan": {"ConanFile": ConanFile},
    "conan.errors": {"ConanInvalidConfiguration": ValueError},
    "conan.tools": {},
    "conan.tools.build": {"can_run": lambda recipe: True},
    "conan.tools.cmake": {
        "CMake": CMake,
        "CMakeDeps": Generator,
        "CMakeToolchain": CMakeToolchain,
        "cmake_layout": cmake_layout,
    },
    "conan.tools.files": {"copy": copy, "load": load},
    "conan.tools.gnu": {"PkgConfigDeps": Generator},
}


def load_recipe(folder):
    spec = importlib.util.spec_from_file_location(f"recipe_{folder.name}", folder / "conanfile.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    (recipe,) = [
        value
        for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, ConanFile) and value is not ConanFile
    ]
    return recipe(folder)


def check_inputs(recipe):
    inputs = subprocess.run(
        ["ninja", "-C", recipe.build_folder, "-t", "inputs", "all"],
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    ).stdout
    sources = [line for line in inputs.split("\n") if line.startswith(recipe.source_folder)]
    missing = [path for path in sources if not pathlib.Path(path).exists()]
    assert (
        len(sources) > 100 and not missing
    ), f"of {len(sources)} sources the recipe does not export {missing}"


def check_headers(recipe, exported):
    """Whether all that the build has read of the repository is exported."""
    deps = subprocess.run(
        ["ninja", "-C", recipe.build_folder, "-t", "deps"],
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    ).stdout
    root, build = pathlib.Path(recipe.source_folder), pathlib.Path(recipe.build_folder)
    # A compiler cache may have made them relative to the build folder.
    paths = {
        pathlib.Path(os.path.normpath(build / line.strip()))
        for line in deps.split("\n")
        if line.startswith("    ")
    }
    read = {
        path.relative_to(root)
        for path in paths
        if path.is_relative_to(root) and not path.is_relative_to(build)
    }
    missing = sorted(str(path) for path in read if not (exported / path).exists())
    assert (
        len(read) > 100 and not missing
    ), f"of {len(read)} files that are read the recipe does not export {missing}"


def create(folder, work):
    recipe = load_recipe(folder)
    recipe.set_version()
    recipe.source_folder = recipe.export_sources_folder = str(work / "source")
    recipe.build_folder, recipe.package_folder = str(work / "configured"), str(work / "package")
    recipe.export_sources()
    recipe.layout()
    assert (folder / recipe.folders.root / recipe.folders.source / "CMakeLists.txt").is_file()
    recipe.requirements()
    recipe.build_requirements()
    recipe.validate()
    recipe.settings.os = "Windows"
    try:
        recipe.validate()
    except ValueError:
        recipe.settings.os = "Linux"
    else:
        raise AssertionError("the recipe would build for Windows")
    recipe.generate()
    CMake(recipe).configure()
    check_inputs(recipe)
    recipe.source_folder, recipe.build_folder = str((folder / recipe.folders.root).resolve()), str(
        work / "build"
    )
    recipe.build()
    check_headers(recipe, work / "source")
    recipe.package()
    recipe.package_info()
    return recipe


def test(folder, work, recipe):
    tested = load_recipe(folder)
    tested.tested_reference_str = f"{recipe.name}/{recipe.version}"
    tested.build_folder = str(work / "test_package")
    tested.requirements()
    assert tested.required == [tested.tested_reference_str]
    tested.layout()
    tested.source_folder = str(folder / tested.folders.source)
    tested.package_prefixes = [
        f"{recipe.package_folder}/{builddir}" for builddir in recipe.cpp_info.builddirs
    ]
    tested.build()
    tested.test()


def main():
    folder, work = (pathlib.Path(argument).resolve() for argument in sys.argv[1:])
    shutil.rmtree(work, ignore_errors=True)
    for name, members in MODULES.items():
        sys.modules[name] = types.ModuleType(name)
        vars(sys.modules[name]).update(members)
    sys.dont_write_bytecode = True
    recipe = create(folder, work)
    package = pathlib.Path(recipe.package_folder)
    for library in recipe.cpp_info.libs:
        assert (package / "lib" / f"lib{library}.so").exists(), library
    assert (package / "lib" / "pkgconfig" / f"{recipe.cpp_info.pkg_config_name}.pc").exists()
    assert (package / "licenses" / "LICENSE").exists()
    test(folder / "test_package", work, recipe)
    (work / "required.txt").write_text(
        "\n".join([f"{recipe.name}/{recipe.version}", *recipe.required]) + "\n"
    )


if __name__ == "__main__":
    main()
