#!/usr/bin/env python3
"""Shows that the simulator finds old bugs: mutations.py [--check] [--seeds N] [NAME...].

Each patch in tests/simulation/mutations takes a correction out of one or more sources of src/. The changed sources are
compiled in a temporary directory with the commands of the release build, and linked before the library, whose objects
of these sources are then not used. Seeds run until one fails. A patch that does not apply, or that no seed shows, is an
error. --check only tries to apply the patches.
"""

import argparse
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
BUILD = ROOT / "build/release"
PROGRAM = "bin/simulate"


def changed_sources(patch):
    """The files that a patch changes."""
    names = re.findall(r"^\+\+\+ b/(\S+)$", patch.read_text(), re.MULTILINE)
    for name in names:
        if not re.fullmatch(r"src/.*\.cpp", name):
            sys.exit(f"{patch.name}: {name} is no source of src/")
    return names


def apply(patch, folder):
    """Copies the sources, and patches the copies."""
    names = changed_sources(patch)
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, folder / name)
    done = subprocess.run(["git", "apply", patch], cwd=folder, capture_output=True, text=True)
    if done.returncode != 0 or not names:
        print(f"{patch.stem}: does not apply\n{done.stderr}")
        return None
    return names


def commands():
    """The commands of the release build that build the program."""
    lines = subprocess.run(["ninja", "-C", BUILD, "-t", "commands", PROGRAM], capture_output=True, text=True,
                           check=True).stdout.splitlines()
    return [shlex.split(line) for line in lines]


def run(command):
    subprocess.run(command, cwd=BUILD, check=True)


def compile_changed(name, folder, all_commands):
    """@return the object"""
    command = next(one for one in all_commands if str(ROOT / name) in one)
    output = str(folder / (name.replace("/", "_") + ".o"))
    arguments = []
    skip = False
    for argument in command:
        # The file of dependencies is that of the build.
        if not skip and argument not in ("-MD", "-MT", "-MF"):
            arguments.append(argument)
        skip = argument in ("-MT", "-MF")
    arguments[arguments.index("-o") + 1] = output
    arguments[arguments.index(str(ROOT / name))] = str(folder / name)
    # A warning about what is no longer used would say nothing.
    run(arguments + ["-w"])
    return output


def link(objects, folder, all_commands):
    """@return the program"""
    # Ninja wraps it as ": && g++ ... && :".
    command = [one for one in all_commands[-1] if one not in (":", "&&")]
    at = command.index("-o")
    program = str(folder / "simulate")
    run(command[:at] + ["-o", program] + objects + command[at + 2:])
    return program


def find(patch, seeds):
    """@return whether a seed fails"""
    begin = time.monotonic()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        names = apply(patch, folder)
        if names is None:
            return False
        all_commands = commands()
        objects = [compile_changed(one, folder, all_commands) for one in names]
        program = link(objects, folder, all_commands)
        built = time.monotonic()
        ran = subprocess.run([program, "--count", str(seeds), "--first"], capture_output=True, text=True)
    seed = re.search(r"^seed (\d+)", ran.stdout, re.MULTILINE)
    if ran.returncode == 0 or not seed:
        print(f"{patch.stem}: not found by {seeds} seeds")
        return False
    broken = re.search(r"^  (\D[^:\n]*: \d+ ms: .*)$", ran.stdout, re.MULTILINE)
    print(f"{patch.stem}: seed {seed[1]}, built in {built - begin:.0f} s, found in {time.monotonic() - built:.1f} s\n"
          f"  {broken[1] if broken else 'the second run differs'}", flush=True)
    return True


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="only try to apply the patches")
    parser.add_argument("--seeds", type=int, default=1000, help="how many at most, for each patch")
    parser.add_argument("names", nargs="*", metavar="NAME", help="of patches; all by default")
    options = parser.parse_args()
    patches = [HERE / "mutations" / f"{name}.patch" for name in options.names]
    patches = patches or sorted((HERE / "mutations").glob("*.patch"))
    good = bool(patches)
    for patch in patches:
        if options.check:
            with tempfile.TemporaryDirectory() as name:
                good = apply(patch, pathlib.Path(name)) is not None and good
        else:
            try:
                good = find(patch, options.seeds) and good
            except subprocess.CalledProcessError:
                print(f"{patch.stem}: does not compile")
                good = False
    print(f"{len(patches)} mutations: {'all' if good else 'not all'} {'apply' if options.check else 'were found'}")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
