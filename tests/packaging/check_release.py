#!/usr/bin/env python3
"""Checks scripts/release on a copy of this repository: its short checks pass, find what is wrong, and are noted."""
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]


def git(folder, *arguments):
    return subprocess.run(["git", "-C", str(folder), "-c", "user.name=t", "-c", "user.email=t@t", *arguments],
                          check=True, capture_output=True, text=True).stdout


def main():
    with tempfile.TemporaryDirectory() as folder:
        copy = pathlib.Path(folder)
        names = git(ROOT, "ls-files", "-z", "--cached", "--others", "--exclude-standard").split("\0")
        present = "\0".join(name for name in names if name and (ROOT / name).exists())
        subprocess.run(["cp", "--parents", "-t", folder, *present.split("\0")], cwd=ROOT, check=True)
        git(copy, "init", "-q")
        git(copy, "add", "-A")
        git(copy, "commit", "-q", "-m", "all")

        def release(*checks):
            done = subprocess.run(["scripts/release", "--only", *checks], cwd=copy, capture_output=True, text=True)
            report = next(copy.glob("build/release-*.txt")).read_text()
            results = dict(line.split("\t") for line in report.splitlines() if "\t" in line)
            return done.returncode, results, report

        status, results, report = release("clean", "version", "links")
        assert status == 0, report
        assert results["links"].startswith("passed on") and results["demo"] == "not checked", report
        assert f"\ncommit {git(copy, 'rev-parse', 'HEAD')}" in report, report

        page = copy / "docs/README.md"
        page.write_text(page.read_text() + "[x](nowhere.md)\n")
        status, results, report = release("clean", "links")
        assert status == 1 and results["clean"].startswith("FAILED") and results["links"].startswith("FAILED"), report
        assert results["version"] == "not checked" and ", with changes\n" in report, report

        git(copy, "checkout", "-q", "docs")
        version = subprocess.run([sys.executable, "tests/check_version.py", "--print"], cwd=copy, check=True,
                                 capture_output=True, text=True).stdout.strip()
        git(copy, "tag", f"v{version}")
        status, results, report = release("version")
        assert status == 1 and results["version"].startswith("FAILED"), report
        status, results, report = release("clean")
        assert status == 0 and results["version"].startswith("FAILED"), "what was found before is lost: " + report
    print("ok")


if __name__ == "__main__":
    main()
