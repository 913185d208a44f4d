#!/usr/bin/env python3
"""Checks the completions of zsh and fish with a program that answers as tfdude does: check_completion.py zsh|fish

Types into the shell on a terminal, as a user does, and waits for what it shows.
"""
import os
import pathlib
import pty
import select
import shutil
import signal
import sys
import tempfile
import time

APPS = pathlib.Path(__file__).parents[2] / "apps" / "tfdude"
# One answer must not be run: $(...) in a name.
ANSWERS = r"""#!/bin/sh
case "$*" in
  "__complete loo") printf 'lookup\tpose of B in A\n' ;;
  "__complete lookup ha"*) printf 'hand_left\tof arms\nhand_$(touch was_run)\tof nobody\n' ;;
  "__complete info re") echo :files ;;
  "__complete "*) ;;
  *) echo "called with: $*" ;;
esac
"""
# What is typed, and what the shell then shows.
CASES = {"tfdude loo\t": "kup ", "tfdude info re\t": "cord.mcap",
         "tfdude lookup hand_left \r": "called with: lookup hand_left"}
LISTING = {"zsh": "tfdude lookup ha\t\t", "fish": "complete -C 'tfdude lookup ha'\r"}
SETUP = {
    "zsh": (["zsh", "-f", "-i"], "PS1=; PATH=$PWD:$PATH; fpath=($PWD/functions $fpath); autoload -U compinit; "
                                 "compinit -u -D; setopt noautomenu; echo re''ady\n"),
    "fish": (["fish", "--no-config", "-i"], f"set PATH $PWD $PATH; source {APPS}/completion.fish; echo re''ady\n"),
}


class Terminal:
    def __init__(self, command: "list[str]", folder: str) -> None:
        self.process, self.file = pty.fork()
        if self.process == 0:
            os.chdir(folder)
            os.environ.update(TERM="dumb", HOME=folder, LC_ALL="C.UTF-8")
            os.execvp(command[0], command)

    def type_and_await(self, typed: str, wanted: str) -> None:
        os.write(self.file, typed.encode())
        shown, deadline = "", time.monotonic() + 30
        while wanted not in shown:
            if not select.select([self.file], [], [], max(0, deadline - time.monotonic()))[0]:
                sys.exit(f"after {typed!r} the shell does not show {wanted!r}, but {shown!r}")
            shown += os.read(self.file, 4096).decode(errors="replace")

    def close(self) -> None:
        os.kill(self.process, signal.SIGKILL)
        os.waitpid(self.process, 0)


def main() -> None:
    shell = sys.argv[1]
    if not shutil.which(shell):
        print(f"SKIPPED: there is no {shell}")
        return
    command, setup = SETUP[shell]
    with tempfile.TemporaryDirectory() as folder:
        program = pathlib.Path(folder, "tfdude")
        program.write_text(ANSWERS)
        program.chmod(0o755)
        pathlib.Path(folder, "record.mcap").touch()
        pathlib.Path(folder, "functions").mkdir()
        shutil.copy(APPS / "completion.zsh", pathlib.Path(folder, "functions", "_tfdude"))
        terminal = Terminal(command, folder)
        terminal.type_and_await(setup, "ready")
        for typed, wanted in [*CASES.items(), (LISTING[shell], "of nobody")]:
            terminal.type_and_await(typed, wanted)
            terminal.type_and_await("\x15", "")  # erases the line
        terminal.close()
        if pathlib.Path(folder, "was_run").exists():
            sys.exit("a name was run as a command")


main()
