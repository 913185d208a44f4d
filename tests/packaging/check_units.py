#!/usr/bin/env python3
"""Checks the units of systemd by systemd-analyze, which needs no running systemd: check_units.py BUILD_DIR"""
import pathlib
import shutil
import subprocess
import sys
import tempfile

MOST_EXPOSED = 30  # in tenths; 100 is a service without any restriction


def main() -> None:
    if not shutil.which("systemd-analyze"):
        print("SKIPPED: there is no systemd-analyze; Debian's package is systemd")
        return
    build = pathlib.Path(sys.argv[1])
    template = (build / "systemd" / "tfduded@.service").read_text()
    target = (pathlib.Path(__file__).parents[2] / "systemd" / "tfdude.target").read_text()
    with tempfile.TemporaryDirectory() as folder:
        service = pathlib.Path(folder, "tfduded@arm.service")
        lines = [f"ExecStart={build}/bin/tfduded {line.split(maxsplit=1)[1]}" if line.startswith("ExecStart=") else line
                 for line in template.splitlines()]
        service.write_text("\n".join(lines) + "\n")
        units = [service, pathlib.Path(folder, "tfdude.target")]
        units[1].write_text(target)
        verified = subprocess.run(["systemd-analyze", "verify", "--man=no", "--recursive-errors=no", *units],
                                  capture_output=True, text=True, check=False)
        if verified.returncode != 0 or folder in verified.stderr:
            sys.exit("systemd-analyze verify: " + verified.stderr)
        rated = subprocess.run(["systemd-analyze", "security", "--offline=true", "--no-pager",
                                f"--threshold={MOST_EXPOSED}", service], capture_output=True, text=True, check=False)
        print(rated.stdout.strip().rpartition("\n")[2], rated.stderr)
        sys.exit(rated.returncode)


main()
