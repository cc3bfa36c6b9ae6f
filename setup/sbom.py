#!/usr/bin/env python3
"""Writes the software bill of materials of a build as CycloneDX JSON.

Components are the Debian packages whose headers were compiled in or whose libraries are loaded, by
ninja's dependency log, readelf and ldd, and the PyPI packages that solidtex-export needs. Those
that solidtex compiles in or links itself need an entry in licenses.toml beside this program.
Exit code: 0 the file is written, 1 it is not, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import functools
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterable, Iterator
from importlib import metadata
from pathlib import Path
from typing import NamedTuple

from cyclonedx.contrib.license.factories import LicenseFactory
from cyclonedx.model import Property
from cyclonedx.model.bom import Bom
from cyclonedx.model.component import Component, ComponentType
from cyclonedx.output import make_outputter
from cyclonedx.schema import OutputFormat, SchemaVersion
from packageurl import PackageURL
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

LICENSES = Path(__file__).with_name("licenses.toml")
EXAMPLE = "example: .venv/bin/python setup/sbom.py build -o build/solidtex.cdx.json"
NOT_SHIPPED = ("tests/", "benchmarks/", "_deps/")  # folders of a build


class SbomError(Exception):
    """Nothing can be written; the text says what to do."""


class Package(NamedTuple):
    """A package of Debian or PyPI. `source` is the source package without version number."""

    kind: str
    name: str
    version: str
    source: str


@functools.cache
def licenses() -> dict[str, dict[str, str]]:
    return tomllib.loads(LICENSES.read_text(encoding="utf-8"))


def lines_of(*command: str | Path) -> list[str]:
    try:
        done = subprocess.run(command, check=True, capture_output=True, text=True)
    except FileNotFoundError as error:
        raise SbomError(f"found no program {command[0]}: {error}") from error
    except subprocess.CalledProcessError as error:
        raise SbomError(f"{' '.join(map(str, command))}: {error.stderr.strip()}") from error
    return done.stdout.splitlines()


def headers(build: Path, folders: tuple[str, ...] = ("",)) -> set[str]:
    """Headers outside the repository that objects of these folders of `build` include."""
    found, wanted = set(), False
    for line in lines_of("ninja", "-C", build, "-t", "deps"):
        if not line.startswith(" "):
            wanted = line.startswith(folders) and not line.startswith(NOT_SHIPPED)
        elif wanted and line.strip().startswith("/"):
            found.add(line.strip())
    return found


def binaries(build: Path) -> list[Path]:
    """Programs, libraries and modules that are installed."""
    programs = [p for p in (build / "bin").glob("solidtex-*") if p.suffix == ""]
    libraries = [*build.glob("lib/libsolidtex.so"), *build.glob("lib/openimageio/*.so")]
    found = [*programs, *libraries, *build.glob("python/solidtex/*.so")]
    if not found:
        raise SbomError(f"{build}: found no programs, expected a finished build; {EXAMPLE}")
    return found


def needed(binary: Path) -> set[str]:
    """Names of the libraries that `binary` itself links."""
    lines = lines_of("readelf", "-d", binary)
    return {m[1] for line in lines if (m := re.search(r"\(NEEDED\).*\[(.*)\]", line))}


@functools.cache
def loaded(binary: Path) -> dict[str, str]:
    """Paths of all libraries that the loader finds for `binary`, by name."""
    lines = lines_of("ldd", binary)
    return {m[1]: m[2] for line in lines if (m := re.match(r"\s+(\S+) => (/\S+)", line))}


def debian_packages(files: Iterable[str]) -> set[Package]:
    """Debian packages that own these files. Files of no package are left out."""
    paths = sorted({str(real) for f in files for real in (Path(f), Path(f).resolve())})
    if not paths:
        return set()
    # dpkg-query fails where one file has no owner, and prints the others' owners all the same.
    done = subprocess.run(["dpkg-query", "-S", *paths], capture_output=True, text=True, check=False)
    names = {line.split(": ")[0].split(", ")[0] for line in done.stdout.splitlines()}
    form = "${Package} ${Version} ${source:Package}\n"
    rows = lines_of("dpkg-query", "-W", "-f", form, *sorted(names)) if names else []
    found = (row.split() for row in rows)
    return {Package("deb", name, version, plain(source)) for name, version, source in found}


def plain(source: str) -> str:
    """A source package's name without version number: gcc of gcc-12, boost of boost1.74."""
    return re.sub(r"(-\d+|\d+\.[\d.]+|(?<!\d)\d)$", "", source)


def direct_packages(build: Path) -> set[Package]:
    """Packages that solidtex compiles in or links itself."""
    installed = binaries(build)
    files = headers(build)
    for binary in installed:
        paths = loaded(binary)
        files |= {paths[name] for name in needed(binary) if name in paths}
    return debian_packages(files) | set(pypi_packages(["nanobind"]))


def indirect_packages(build: Path) -> set[Package]:
    """Packages whose libraries the loader brings along."""
    return debian_packages({path for b in binaries(build) for path in loaded(b).values()})


def pypi_packages(names: Iterable[str]) -> Iterator[Package]:
    """The packages and what they need, without extras, as far as they are installed."""
    seen: set[str] = set()
    waiting = list(names)
    while waiting:
        name = canonicalize_name(waiting.pop())
        if name in seen:
            continue
        seen.add(name)
        try:
            package = metadata.distribution(name)
        except metadata.PackageNotFoundError:
            continue
        yield Package("pypi", name, package.version, name)
        for text in package.requires or []:
            needs = Requirement(text)
            if needs.marker is None or needs.marker.evaluate({"extra": ""}):
                waiting.append(needs.name)


def license_of(package: Package) -> str | None:
    table = "debian" if package.kind == "deb" else "pypi"
    stated = licenses()[table].get(package.source)
    if stated is None and package.kind == "pypi":
        return metadata.metadata(package.name).get("License-Expression")
    return stated


def unlicensed(packages: Iterable[Package]) -> list[str]:
    return sorted({p.source for p in packages if license_of(p) is None})


def component(package: Package, linked: str) -> Component:
    license = license_of(package)
    namespace = "debian" if package.kind == "deb" else None
    return Component(
        name=package.name,
        version=package.version,
        type=ComponentType.LIBRARY,
        bom_ref=f"{package.kind}:{package.name}",
        purl=PackageURL(package.kind, namespace, package.name, package.version),
        licenses=[LicenseFactory().make_from_string(license)] if license else [],
        properties=[Property(name="solidtex:linked", value=linked)],
    )


def bill(build: Path) -> Bom:
    direct = direct_packages(build)
    if missing := unlicensed(direct):
        raise SbomError(f"{LICENSES.name}: found no license of {', '.join(missing)}; add them")
    linked = {package: "direct" for package in direct}
    for package in indirect_packages(build) - direct:
        linked[package] = "indirect"
    for package in pypi_packages(["solidtex-export"]):
        linked.setdefault(package, "python")
    bom = Bom()
    license = LicenseFactory().make_from_string("Apache-2.0")
    bom.metadata.component = Component(
        name="solidtex",
        version=metadata.version("solidtex-export"),
        type=ComponentType.APPLICATION,
        licenses=[license],
        bom_ref="solidtex",
    )
    parts = [component(package, kind) for package, kind in sorted(linked.items())]
    bom.components.update(parts)
    bom.register_dependency(bom.metadata.component, parts)
    return bom


def main(arguments: list[str] | None = None) -> int:
    p = argparse.ArgumentParser(description=__doc__, epilog=EXAMPLE,
                                formatter_class=argparse.RawDescriptionHelpFormatter)  # fmt: skip
    p.add_argument("build", type=Path, help="folder of a finished build with Ninja")
    p.add_argument("-o", dest="output", type=Path, required=True, help="file to write")
    p.add_argument("--force", action="store_true", help="replace a file that exists")
    args = p.parse_args(arguments)
    try:
        if args.output.exists() and not args.force:
            raise SbomError(f"{args.output} exists; --force replaces it")
        output = make_outputter(bill(args.build), OutputFormat.JSON, SchemaVersion.V1_6)
        output.output_to_file(str(args.output), allow_overwrite=True, indent=2)
    except (SbomError, OSError) as error:
        print(f"sbom.py: {error}", file=sys.stderr)
        return 1
    print(args.output)
    return 0


if __name__ == "__main__":
    sys.exit(main())
