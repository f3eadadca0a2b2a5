"""defrec as the repository has it in which this recipe lies: conan create
<repository>/cmake/packaging/ports/conan --build=missing

The library and the cpu plugin; not the programs.
"""
import os
import re

from conan import ConanFile
from conan.errors import ConanInvalidConfiguration
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy, load
from conan.tools.gnu import PkgConfigDeps

required_conan_version = ">=2.0"
ROOT = os.path.join("..", "..", "..", "..")
SOURCES = (
    "CMakeLists.txt",
    "LICENSE",
    "backends/*",
    "bindings/c/*",
    "cmake/*",
    "include/*",
    "plugins/*",
    "sdk/*",
)


class DefrecConan(ConanFile):
    name = "defrec"
    description = "Recovers in real time how a tissue surface deforms in stereo video"
    license = "Apache-2.0"
    topics = ("stereo", "tracking", "surgery")
    package_type = "shared-library"
    settings = "os", "arch", "compiler", "build_type"

    def set_version(self):
        project = load(self, os.path.join(self.recipe_folder, ROOT, "CMakeLists.txt"))
        self.version = re.search(r"^project\(defrec VERSION ([0-9.]+) ", project, re.MULTILINE)[1]

    def export_sources(self):
        for pattern in SOURCES:
            copy(self, pattern, os.path.join(self.recipe_folder, ROOT), self.export_sources_folder)

    def layout(self):
        self.folders.root = ROOT
        cmake_layout(self)

    def requirements(self):
        self.requires("eigen/3.4.0", visible=False)
        self.requires("highway/1.0.3", visible=False)
        self.requires("yaml-cpp/0.8.0", visible=False)

    def build_requirements(self):
        self.tool_requires("cmake/[>=3.25]")
        self.tool_requires("ninja/[>=1.10]")
        self.tool_requires("pkgconf/[>=2.0]")

    def validate(self):
        if self.settings.os != "Linux":
            raise ConanInvalidConfiguration(
                "defrec is built for Linux here; docs/deployment/windows.md says how for Windows"
            )

    def generate(self):
        toolchain = CMakeToolchain(self, generator="Ninja")
        toolchain.cache_variables["DEFREC_LIBRARY_ONLY"] = "ON"
        toolchain.cache_variables["DEFREC_BUILD_CUDA"] = "OFF"
        toolchain.cache_variables["DEFREC_BUILD_VULKAN"] = "OFF"
        toolchain.generate()
        CMakeDeps(self).generate()
        PkgConfigDeps(self).generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        CMake(self).install()
        copy(self, "LICENSE", self.source_folder, os.path.join(self.package_folder, "licenses"))

    def package_info(self):
        # Its own CMake package, which knows where plugins go.
        self.cpp_info.set_property("cmake_find_mode", "none")
        self.cpp_info.set_property("pkg_config_name", "defrec")
        self.cpp_info.builddirs = [os.path.join("lib", "cmake", "defrec")]
        self.cpp_info.libs = ["defrec"]
