#!/usr/bin/env python3
"""Finds words that CONTRIBUTING.md rules out: in comments, messages and pages, and as parts of identifiers.

A word in prose that is also the name of a field, an identifier or a key is written in backticks or quotes there, or
with its underscores or parentheses, and is not found.
"""
import io
import pathlib
import re
import sys
import tokenize

ROOT = pathlib.Path(__file__).resolve().parent.parent

# In prose: a pattern, and what to write.
PROSE = {
    r"\brefus(e|es|ed|ing|al)\b": "reject",
    r"\bheld by\b": "owned by",
    r"\bnewcomers?\b": "new participant",
    r"\bhangs? together\b": "correlated",
    r"\b(begin|begins|start|starts) anew\b": "restart, retry",
    r"\bpassed over\b": "ignored",
    r"\bnewest common instant\b": "latest common time",
    r"\blesser name\b": "alphabetically first",
}
# A comment that has no subject.
SUBJECTLESS = r"^(Who|Whoever|It)\b"
# Whole identifiers, and what they became.
IDENTIFIERS = {
    "told_of": "note_update, note_announced_epoch", "told_all": "replace_reports", "unhang": "make_root",
    "hang_on_joints": "attach_joints", "let_go": "detach_joint", "still_in": "check_owns_partition",
    "outlived": "survived", "heir": "winning_claim",
}
SOURCES = r"\.(cpp|hpp|ipp|idl|js|py|pyi)$"
PAGES = r"\.md$"
# Texts of the past, and the list of these words.
LEFT_OUT = r"^(CHANGELOG\.md|CONTRIBUTING\.md|bench/REPORT\.md|scripts/check_words\.py)$"


def comments_of(text):
    """The comments of C++ or JavaScript: the number of the line, and the text."""
    for number, line in enumerate(text.splitlines(), 1):
        found = re.search(r"(?:^|[^:\"'])//[/!]?<?\s?(.*)$", line)
        if found:
            yield number, found.group(1)


def comments_of_python(text):
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string[1:].strip()
        elif token.type == tokenize.STRING and token.string.startswith(('"""', 'r"""')):
            for offset, line in enumerate(token.string.splitlines()):
                yield token.start[0] + offset, line


def prose_of(name, text):
    if name.endswith((".py", ".pyi")):
        return list(comments_of_python(text))
    if re.search(PAGES, name):
        return list(enumerate(text.splitlines(), 1))
    return list(comments_of(text))


def without_names(line):
    """The line without what is a name: in backticks or quotes, with an underscore, or a call."""
    return re.sub(r"`[^`]*`|\"[^\"]*\"|\b\w*_\w*\b|\b\w+\(\)|\b\w+::\w+", " ", line)


def findings(name, text):
    before = (0, "")
    for number, line in prose_of(name, text):
        for pattern, better in PROSE.items():
            found = re.search(pattern, without_names(line), re.IGNORECASE)
            if found:
                yield number, f"'{found.group(0)}': write '{better}'"
        begins = before[0] != number - 1 or not before[1].strip()
        if begins and re.search(SOURCES, name) and re.match(SUBJECTLESS, line):
            yield number, "the comment begins without its subject"
        before = (number, line)
    if re.search(SOURCES, name):
        for number, line in enumerate(text.splitlines(), 1):
            for word in re.findall(r"\b[A-Za-z_]\w*\b", line):
                if word.rstrip("_") in IDENTIFIERS:
                    yield number, f"'{word}': now {IDENTIFIERS[word.rstrip('_')]}"


def main():
    folders = ("apps", "bench", "docs", "examples", "idl", "include", "python", "src", "tests")
    files = [*ROOT.glob("*.md"), *(file for folder in folders for file in (ROOT / folder).rglob("*"))]
    names = sorted(str(file.relative_to(ROOT)) for file in files)
    found = 0
    for name in names:
        if not re.search(SOURCES + "|" + PAGES, name) or re.search(LEFT_OUT, name):
            continue
        for number, what in findings(name, (ROOT / name).read_text(encoding="utf-8")):
            found += 1
            print(f"{name}:{number}: {what}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
