#!/usr/bin/env python3
"""Checks the manual pages of a build against --help: check_manual.py BUILD_DIR

Each program and each command has a page with all of its options, and man formats the page without a warning.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys


def run(*command: str) -> "subprocess.CompletedProcess[str]":
    environment = dict(os.environ, LC_ALL="C.UTF-8", MANROFFSEQ="", MANWIDTH="1000")
    return subprocess.run(command, capture_output=True, text=True, check=True, env=environment)


def commands_of(help_text: str) -> "list[str]":
    """They stand below the headings of their groups; options begin with a hyphen, arguments with a capital."""
    return re.findall(r"(?m)^  ([a-z]\S*)", help_text)


def check(program: pathlib.Path, words: "list[str]", pages: pathlib.Path) -> "list[str]":
    """The pages of a program or a command, and of those below it, as their names."""
    help_text = run(str(program), *words, "--help").stdout
    name = "-".join([program.name, *words])
    page = pages / (name + ".1")
    formatted = run("man", "--warnings", "-E", "UTF-8", "-l", "-Tutf8", "-Z", str(page))
    if formatted.stderr:
        sys.exit(f"{page}: {formatted.stderr}")
    text = page.read_text().replace("\\-", "-")
    missing = [option for option in re.findall(r"(?m)^  (?:-\w,)?(--[\w-]+)", help_text) if option not in text]
    if missing or "EXIT STATUS" not in text or ".SH EXAMPLES" not in text:
        sys.exit(f"{page} is incomplete: {missing}\n{text}")
    return [name, *(below for command in commands_of(help_text) if (words, command) != ([], "web")
                    for below in check(program, [*words, command], pages))]


def main() -> None:
    if not shutil.which("man"):
        print("SKIPPED: there is no man; Debian's package is man-db")
        return
    build = pathlib.Path(sys.argv[1])
    programs = ["tfduded", "tfdude", "tfdude-ros", "tfdude-web"]
    named = sorted(page for program in programs for page in check(build / "bin" / program, [], build / "man"))
    written = sorted(page.stem for page in (build / "man").iterdir())
    if named != written:
        sys.exit(f"pages without a command, or the other way round: {set(named) ^ set(written)}")
    print(f"{len(named)} pages")


main()
