#!/usr/bin/env python3
"""Checks that all files say the version of CMakeLists.txt, and that docs/compatibility.md says the versions that the
code has. --self-test tests this program. --print prints the version.
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
VERSION = (r"project\(tfdude VERSION (\d+\.\d+\.\d+)", "CMakeLists.txt")
PROTOCOL = (r"kProtocolVersion\{(\d+), (\d+)\}", "include/tfdude/types/version.hpp")
STATE = (r"kFormat = (\d+)", "src/store/schema.hpp")
# Files that name the package of the library, whose number is that of the soname.
NAMES_PACKAGE = ["README.md", "Containerfile", "docs/install.md", "docs/compatibility.md", "debian/control"]


def find(source, read):
    pattern, name = source
    found = re.search(pattern, read(name))
    if not found:
        sys.exit(f"{name}: no {pattern}")
    return ".".join(found.groups())


def differences(read, installed):
    """@param read  gives the text of a file   @param installed  names of debian/libtfdude*.install"""
    version = find(VERSION, read)
    protocol = find(PROTOCOL, read)
    soname = version.rpartition(".")[0]
    wanted = {
        "CHANGELOG.md": [(r"\A.*?^## \[([^]]+)\] - \d{4}-\d\d-\d\d$", version)],
        "debian/changelog": [(r"\Atfdude \((.*?)\)", version)],
        "docs/compatibility.md": [(r"now (\S+) \(`tfdude --version`\)", version), (r"\| protocol (\S+) \|", protocol),
                                  (r"\| format (\d+) \|", find(STATE, read)), (r"libtfdude\.so\.([\d.]+)`", soname),
                                  (r"find_package\(tfdude ([\d.]+)\)", soname)],
        "docs/transport.md": [(r"version of its own, now (\d+\.\d+);", protocol)],
    }
    for name, checks in wanted.items():
        text = read(name)
        for pattern, value in checks:
            found = re.search(pattern, text, re.MULTILINE | re.DOTALL)
            if not found or found[1] != value:
                yield f"{name}: {found[1] if found else 'nothing'} instead of {value} ({pattern})"
    for name in NAMES_PACKAGE:
        numbers = set(re.findall(r"libtfdude(\d+\.\d+)", read(name)))
        if numbers != {soname}:
            yield f"{name}: packages of the library {sorted(numbers)} instead of {soname}"
    if installed != [f"libtfdude{soname}.install"]:
        yield f"debian: {installed} instead of libtfdude{soname}.install"


def self_test():
    def read(name):
        return (ROOT / name).read_text()
    installed = [path.name for path in ROOT.glob("debian/libtfdude[0-9]*.install")]
    assert not list(differences(read, installed))
    later = list(differences(lambda name: read(name).replace("VERSION 0.", "VERSION 9."), installed))
    assert len(later) == 6 + len(NAMES_PACKAGE), later
    assert len(list(differences(lambda name: read(name).replace("kFormat = ", "kFormat = 1"), installed))) == 1
    later = differences(lambda name: read(name).replace("kProtocolVersion{", "kProtocolVersion{9"), installed)
    assert len(list(later)) == 2
    assert len(list(differences(read, installed + ["libtfdude0.0.install"]))) == 1
    print("ok")


def main():
    def read(name):
        return (ROOT / name).read_text()
    if "--self-test" in sys.argv:
        return self_test()
    if "--print" in sys.argv:
        return print(find(VERSION, read))
    found = list(differences(read, [path.name for path in ROOT.glob("debian/libtfdude[0-9]*.install")]))
    if found:
        sys.exit("\n".join(found))
    print(f"version {find(VERSION, read)} everywhere")


if __name__ == "__main__":
    main()
