#!/usr/bin/env python3
"""Checks that relative links of all Markdown files lead to files of the repository, and their anchors to headings.
--self-test tests this program. Links to other hosts are not followed.
"""
import functools
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
CODE = re.compile(r"^ *```.*?^ *```|``[^`\n].*?``|`[^`\n]*`", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(<?([^)\s>]+)>?(?: \"[^\"]*\")?\)|<(?:img|a)\b[^>]*\b(?:src|href)=\"([^\"]+)\"")
HEADING = re.compile(r"^#{1,6} +(.*?) *#*$", re.MULTILINE)


def anchor_of(heading):
    """As GitHub and GitLab make them: small letters, digits, hyphens and underscores."""
    heading = re.sub(r"!?\[([^]]*)\]\([^)]*\)", r"\1", heading)
    return re.sub(r"[^\w\- ]", "", heading.replace("`", "").lower()).replace(" ", "-")


@functools.lru_cache(maxsize=None)
def anchors(path):
    text = path.read_text()
    found = set(re.findall(r"<a (?:id|name)=\"([^\"]+)\"", text))
    for heading in HEADING.findall(re.sub(r"^ *```.*?^ *```", "", text, flags=re.MULTILINE | re.DOTALL)):
        anchor = anchor_of(heading)
        number = 0
        while (name := f"{anchor}-{number}" if number else anchor) in found:
            number += 1
        found.add(name)
    return found


def broken(path, root):
    text = CODE.sub("", path.read_text())
    for match in LINK.finditer(text):
        target = match[1] or match[2]
        if re.match(r"[a-z][a-z0-9+.-]*:", target):
            continue
        name, _, anchor = target.partition("#")
        to = (path.parent / name).resolve() if name else path
        if root not in to.parents and to != root:
            yield f"{target}: outside of the repository"
        elif not to.exists():
            yield f"{target}: no such file"
        elif anchor and (to.suffix != ".md" or anchor not in anchors(to)):
            yield f"{target}: no such heading"


def self_test():
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder).resolve()
        (root / "b.md").write_text("# One\n## Two, `three`: four_5\n## Two, `three`: four_5\n```\n# no\n```\n")
        page = root / "a.md"
        def count(text):
            page.write_text(text)
            anchors.cache_clear()
            return len(list(broken(page, root)))
        assert count("[x](b.md) [x](b.md#one) [x](b.md#two-three-four_5-1) [x](https://x.y/z) `[x](c.md)`\n"
                     "[x](#here)\n# Here\n") == 0
        assert count("[x](c.md)") == 1
        assert count("[x](b.md#no)") == 1
        assert count("[x](b.md#two)") == 1
        assert count("[x](#gone)") == 1
        assert count("[x](../../etc)") == 1
        assert count('<img src="no.png" width="3">') == 1
    print("ok")


def main():
    if "--self-test" in sys.argv:
        return self_test()
    names = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", "*.md"], cwd=ROOT,
                           check=True, capture_output=True, text=True).stdout.split("\0")
    pages = [ROOT / name for name in names if name and (ROOT / name).exists()]
    found = [f"{page.relative_to(ROOT)}: {link}" for page in pages for link in broken(page, ROOT)]
    if found:
        sys.exit("\n".join(found))
    print(f"{len(pages)} pages, no broken links")


if __name__ == "__main__":
    main()
