"""Spack's package: `spack dev-build solidtex@develop` in a clone builds that clone."""
# ruff: noqa: F403, F405 (the star is how packages of Spack import)

from spack.package import *
from spack_repo.builtin.build_systems.cmake import CMakePackage, generator


class Solidtex(CMakePackage):
    """Solid textures learned from one photograph, evaluated anywhere in 3D space."""

    license("Apache-2.0", when="~cgal")
    license("Apache-2.0 AND GPL-3.0-or-later", when="+cgal")
    version("develop")

    variant("tools", default=False, description="Build the programs beside solidtex-render")
    variant("renderer", default=False, description="Build the path tracer and solidtex-render")
    variant("cgal", default=False, description="Repair and cut meshes (GPL; renderer only)")
    variant("openvdb", default=False, description="Let solidtex-bake write .vdb")

    depends_on("c", type="build")
    depends_on("cxx", type="build")
    depends_on("cmake@3.25:", type="build")
    depends_on("ninja", type="build")
    depends_on("pkgconfig", type="build")
    depends_on("intel-oneapi-tbb")
    depends_on("highway")
    depends_on("nlohmann-json")

    with when("+tools"):
        depends_on("benchmark")
        depends_on("c-blosc")
        depends_on("cli11")
        depends_on("fmt")
        depends_on("glm")
        depends_on("isa-l")
        depends_on("libpng")
        depends_on("openexr@3:")
        depends_on("openimageio")
    with when("+renderer"):
        depends_on("cli11")
        depends_on("embree@3.13:")
        depends_on("fmt")
        depends_on("glm")
        depends_on("openimageio")
        depends_on("valijson")
    depends_on("cgal", when="+renderer+cgal")
    depends_on("openvdb", when="+tools+openvdb")

    generator("ninja")

    def cmake_args(self):
        return [
            self.define_from_variant("SOLIDTEX_BUILD_TOOLS", "tools"),
            self.define_from_variant("SOLIDTEX_BUILD_RENDERER", "renderer"),
            self.define_from_variant("SOLIDTEX_WITH_CGAL", "cgal"),
            self.define_from_variant("SOLIDTEX_WITH_OPENVDB", "openvdb"),
            self.define("SOLIDTEX_BUILD_OPENIMAGEIO", False),
            self.define("SOLIDTEX_BUILD_PYTHON", False),
            self.define("SOLIDTEX_BUILD_TESTS", False),
            self.define("SOLIDTEX_HARDENED", True),
        ]
