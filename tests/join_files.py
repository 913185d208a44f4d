#!/usr/bin/env python3
"""Joins test files into one that is compiled in their place (cmake/Catch2Tests.cmake), which takes less than half of
their time. Each file gets a namespace of its own, so that files may use the same names. Compilers, assertions and
debuggers name the lines of the files themselves.

    join_files.py JOINED_FILE FILE...
    join_files.py --self-test
"""
import pathlib
import re
import sys

PROJECT = re.compile(r"^namespace tfdude(::\w+)* \{", re.MULTILINE)
LAST_INCLUDE = re.compile(r".*^#include [^\n]*\n", re.MULTILINE | re.DOTALL)


def joined(files):
    """@param files  names and texts"""
    parts = []
    for number, (name, text) in enumerate(files):
        own = f"file_{number}"
        text, found = PROJECT.subn(lambda line: f"{line[0][:-2]}::{own} {{", text)
        if not found:
            # All of it is in the global namespace.
            end = LAST_INCLUDE.match(text).end()
            text = f"{text[:end].rstrip()}\nnamespace {own} {{{text[end:]}}}  // namespace {own}\n"
        parts.append(f'#line 1 "{name}"\n{text}')
    return "\n".join(parts)


def self_test():
    inside = ("a.cpp", "#include <a>\n\nnamespace tfdude {\nint a;\n}\n\nnamespace tfdude::x {\nint b;\n}\n")
    outside = ("b.cpp", '// B\n#include <a>\n#include "b"\n\nusing std::a;\nint a;\n')
    assert joined([inside, outside]).split("\n") == [
        '#line 1 "a.cpp"', "#include <a>", "", "namespace tfdude::file_0 {", "int a;", "}", "",
        "namespace tfdude::x::file_0 {", "int b;", "}", "",
        '#line 1 "b.cpp"', "// B", "#include <a>", '#include "b"', "namespace file_1 {", "using std::a;", "int a;",
        "}  // namespace file_1", ""]
    print("ok")


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    output, *files = map(pathlib.Path, sys.argv[1:])
    output.write_text(joined((path, path.read_text()) for path in files))


if __name__ == "__main__":
    main()
