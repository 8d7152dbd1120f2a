"""conan create packaging/conan"""

import os
import re

from conan import ConanFile
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, CMakeToolchain, cmake_layout
from conan.tools.files import copy, rmdir

required_conan_version = ">=2.0"


class MisConan(ConanFile):
    name = "mis"
    description = "Multiple importance sampling weights for renderers"
    license = "MIT"
    topics = ("rendering", "ray-tracing", "monte-carlo", "header-only")
    package_type = "header-library"
    settings = "os", "arch", "compiler", "build_type"
    no_copy_source = True

    @property
    def _root(self):
        return os.path.join(self.recipe_folder, "..", "..")

    def set_version(self):
        with open(os.path.join(self._root, "include", "mis", "version.hpp"), encoding="utf-8") as header:
            numbers = re.findall(r"^#define MIS_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)$", header.read(), re.M)
        self.version = self.version or ".".join(numbers)

    def export_sources(self):
        for pattern in ["CMakeLists.txt", "LICENSE", "cmake/*", "include/*"]:
            copy(self, pattern, self._root, self.export_sources_folder)

    def layout(self):
        cmake_layout(self)

    def validate(self):
        if self.settings.get_safe("compiler.cppstd"):
            check_min_cppstd(self, 17)

    def package_id(self):
        self.info.clear()

    def generate(self):
        toolchain = CMakeToolchain(self)
        for part in ["TESTS", "EXAMPLES", "BENCHMARKS"]:
            toolchain.cache_variables[f"MIS_BUILD_{part}"] = False
        toolchain.generate()

    def build(self):
        CMake(self).configure()

    def package(self):
        copy(self, "LICENSE", self.source_folder, os.path.join(self.package_folder, "licenses"))
        CMake(self).install()
        rmdir(self, os.path.join(self.package_folder, "share"))

    def package_info(self):
        self.cpp_info.bindirs = []
        self.cpp_info.libdirs = []
        self.cpp_info.set_property("cmake_file_name", "mis")
        self.cpp_info.set_property("cmake_target_name", "mis::mis")
        self.cpp_info.set_property("pkg_config_name", "mis")
