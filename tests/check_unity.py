#!/usr/bin/env python3
"""Checks that files of one folder can be compiled together (cmake/Unity.cmake): what their unnamed namespaces define
has different names in different files. --self-test tests this program.

Two functions may have one name if their parameters differ, and two aliases if they stand for the same type. Names
inside of classes and functions, and those of enumerators without a scope, are not looked at.
"""
import collections
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
FOLDERS = ["src/**/", "apps/**/", "python/src/", "tests/faults/", "tests/simulation/"]
HIDDEN = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'', re.DOTALL)
TYPE = re.compile(r"(?:template <[^{]*?> )?(?:struct|class|enum(?: class)?|union) (?:\[\[\w+\]\] )?(\w+)")
FUNCTION = re.compile(r"[^(=]*?(\w+)\s*\((.*)\)[^()]*$")


def outer_text(text):
    """What is directly in unnamed namespaces; each block inside of it is left empty."""
    text = HIDDEN.sub(lambda found: '""' if found[0][0] == '"' else " ", text)
    for start in re.finditer(r"\bnamespace\s*\{", text):
        depth = 1
        kept = []
        for character in text[start.end():]:
            if character == "{":
                depth += 1
                kept += "{" if depth == 2 else ""
            elif character == "}":
                depth -= 1
                kept += "};" if depth == 1 else ""
            elif depth == 1:
                kept += character
            if depth == 0:
                break
        yield "".join(kept)


def definitions(text):
    """Yields what makes two definitions the same, for each definition in unnamed namespaces."""
    for outer in outer_text(text):
        for statement in outer.split(";"):
            statement = " ".join(re.sub(r"^\s*#.*$", "", statement, flags=re.MULTILINE).split())
            if found := re.match(r"using (\w+) = (.*)", statement):
                yield "type", found[1], found[2]
            elif found := TYPE.match(statement):
                yield "type", found[1], ""
            elif found := FUNCTION.match(statement.split("{")[0]):
                if "{" in statement:
                    yield "function", found[1], re.sub(r"\s*\b\w+\s*(?=,|$)", "", found[2])
            elif found := re.match(r"(?:inline |static |const |constexpr )+.*?(\w+)(?:\[\w*\])*(?: =| ?\{)", statement):
                yield "constant", found[1], ""


def clashes(files):
    """@param files  names and texts of the files of one folder"""
    seen = collections.defaultdict(dict)
    for name, text in files.items():
        for kind, word, rest in definitions(text):
            # A type may not have the name of a type, whatever the rest, but an alias may be repeated.
            seen[(kind, word) if kind != "function" else (kind, word, rest)].setdefault(name, rest)
    return [f"{' and '.join(sorted(where))} have the same {key[0]} {key[1]} in an unnamed namespace"
            for key, where in seen.items()
            if len(where) > 1 and (key[0] != "type" or len(set(where.values())) > 1 or "" in where.values())]


def self_test():
    one = "namespace a {\nnamespace {\n// kNot = 1;\nconstexpr int kMost = 1;\nstruct Way { int kept = 1; };\n"
    one += "using V = int;\nint size(int a) { return a; }\n}\n}\n"
    assert sorted(word for _, word, _ in definitions(one)) == ["V", "Way", "kMost", "size"], list(definitions(one))
    def count(other):
        return len(clashes({"one.cpp": one, "two.cpp": f"namespace {{\n{other}\n}}"}))
    assert count("constexpr double kMost{2};") == 1
    assert count("constexpr double kLeast{2};\nusing V = int;\nint size(long a) { return 1; }") == 0
    assert count("using V = long;") == 1
    assert count("class Way {};") == 1
    assert count("using Way = int;") == 1
    assert count("int size(int b) { return b; }") == 1
    assert count("") == 0
    print("ok")


def main():
    if "--self-test" in sys.argv:
        return self_test()
    folders = sorted({path.parent for pattern in FOLDERS for path in ROOT.glob(pattern + "*.cpp")})
    found = [f"{folder.relative_to(ROOT)}: {clash}" for folder in folders
             for clash in clashes({path.name: path.read_text() for path in sorted(folder.glob("*.cpp"))})]
    if found:
        sys.exit("\n".join(found))
    print(f"{len(folders)} folders, nothing found")


if __name__ == "__main__":
    main()
