"""Types the commands of README.md and docs/install.md into a shell, line by line, in a fresh clone of this checkout.

    type_blocks.py BUILD_DIR
    type_blocks.py BUILD_DIR --tutorial
    type_blocks.py --self-test

The clone's build/release is a link to BUILD_DIR, and `cmake --preset` does nothing, so that nothing is built again.
README.md is typed twice, because a user may run its tour twice. Its C++ program is built against the installed package,
as docs/install.md says. --tutorial types docs/tutorial.md instead, whose files must be those of examples/tutorial. All
runs in a DDS domain and an empty home directory of its own.
"""
import fcntl
import os
import pty
import re
import select
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import termios
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
from domain_lease import lease_domain  # noqa: E402

LINE_SECONDS = 120
COLUMNS = 80
COLOUR = re.compile(rb"\x1b\[[0-9;]*m")
MARK = re.compile(rb"\n=== status (\d+)\n")


def blocks(text, language):
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def lines_of(block):
    return [line for line in block.replace("\\\n", " ").splitlines() if line.strip()]


class Shell:
    """An interactive bash on a terminal of its own. Its prompt shows the status of the line before."""

    def __init__(self, folder, environment):
        self.output = b""
        self.pid, self.terminal = pty.fork()
        if self.pid == 0:
            os.chdir(folder)
            os.execvpe("bash", ["bash", "--noprofile", "--norc", "--noediting", "-i"],
                       {**environment, "PS1": r"\n=== status $?\n"})
        fcntl.ioctl(self.terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 24, COLUMNS, 0, 0))
        settings = termios.tcgetattr(self.terminal)
        settings[3] &= ~termios.ECHO
        termios.tcsetattr(self.terminal, termios.TCSANOW, settings)
        self.read_until_prompt("the start of bash")

    def type(self, line):
        """Returns the output of the line and of background jobs, and the status."""
        os.write(self.terminal, f"{line}\n".encode())
        if "# until Ctrl-C" in line:
            deadline = time.monotonic() + 3
            while self.read(deadline) and "after some seconds" in line:
                pass
            os.write(self.terminal, b"\x03")
        return self.read_until_prompt(line)

    def read_until_prompt(self, what):
        deadline = time.monotonic() + LINE_SECONDS
        entered = False
        while not (mark := MARK.search(self.output)):
            if not self.read(deadline):
                raise SystemExit(f"no end of: {what}\n{self.output.decode()}")
            if b"until you press Enter" in self.output and not entered:
                os.write(self.terminal, b"\n")
                entered = True
        printed, self.output = self.output[:mark.start()], self.output[mark.end():]
        return printed.decode(), int(mark[1])

    def read(self, deadline):
        """Waits for output. Returns whether there was any before the deadline."""
        ready, _, _ = select.select([self.terminal], [], [], max(0, deadline - time.monotonic()))
        try:
            new = os.read(self.terminal, 65536) if ready else b""
        except OSError:  # bash has ended
            new = b""
        self.output = COLOUR.sub(b"", (self.output + new).replace(b"\r\n", b"\n"))
        return bool(new)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        """Kills bash and what it started, for example after a line has failed."""
        for process in Path("/proc").glob("[0-9]*"):
            try:
                session = (process / "stat").read_text().rpartition(")")[2].split()[3]
                if int(session) == self.pid:
                    os.kill(int(process.name), signal.SIGKILL)
            except (FileNotFoundError, ProcessLookupError):
                pass  # it has just ended
        os.waitpid(self.pid, 0)
        os.close(self.terminal)


def fault_of(line, printed, status):
    """None if all is well with the line."""
    until_interrupted = "# until Ctrl-C" in line
    # A program that Ctrl-C kills before it can react has status 130.
    if status != 0 and not (until_interrupted and status == 130):
        return f"status {status}"
    if re.match("tfdude (?!events)", line) and not printed.strip():
        return "no output"
    # What a person reads fits the terminal, but for errors, which are one line.
    if not line.startswith("tfdude ") or until_interrupted or "--json" in line or "|| true" in line:
        return None
    for printed_line in printed.splitlines():
        from_background = printed_line.startswith("[")  # a daemon's log, or bash about a job
        if len(printed_line) > COLUMNS and not from_background:
            return f"more than {COLUMNS} columns"
    return None


def type_all(shell_blocks, folder, environment):
    """Returns all output."""
    transcript = ""
    with Shell(folder, environment) as shell:
        for line in (line for block in shell_blocks for line in lines_of(block)):
            printed, status = shell.type(line)
            print(f"$ {line}", flush=True)
            if (fault := fault_of(line, printed, status)) is not None:
                raise SystemExit(f"{fault} of: {line}\n{printed}")
            transcript += printed
    return transcript


def check_samples(samples, transcript):
    """The output that a page shows is output of its commands."""
    for line in (line for block in samples for line in block.splitlines()):
        if line not in transcript:
            raise SystemExit(f"no command printed this line: {line}")


def clone(folder, environment):
    """A clone of the last commit, with the changes of tracked files that are not committed yet."""
    subprocess.run(["git", "clone", "--quiet", ROOT, folder], env=environment, check=True)
    changes = subprocess.run(["git", "-C", ROOT, "diff", "--binary", "HEAD"], env=environment, check=True,
                             stdout=subprocess.PIPE).stdout
    if changes:
        subprocess.run(["git", "-C", folder, "apply"], env=environment, check=True, input=changes)


def put_in_front_of_cmake(folder):
    """A cmake that does not configure or build the clone, and passes on all else."""
    folder.mkdir()
    wrapper = folder / "cmake"
    wrapper.write_text(f"""#!/bin/sh
case "$*" in
  *--preset*) exit 0 ;;
  *) exec {shutil.which("cmake")} "$@" ;;
esac
""")
    wrapper.chmod(0o755)


def prepare(build, work, domain):
    """A clone with its build folder, and the environment of a new user."""
    home, checkout = work / "home", work / "tf-dude"
    home.mkdir()
    (home / ".gitconfig").write_text("[safe]\n\tdirectory = *\n")  # the checkout may belong to another user
    put_in_front_of_cmake(work / "bin")
    environment = {**os.environ, "HOME": str(home), "TFDUDE_DOMAIN": str(domain), "TERM": "xterm",
                   "PATH": f"{work}/bin:{os.environ['PATH']}", "CXXFLAGS": "-Wall -Wextra -Werror"}
    clone(checkout, environment)
    (checkout / "build").mkdir()
    (checkout / "build/release").symlink_to(build)
    return checkout, environment


def try_tutorial(build, work, domain):
    checkout, environment = prepare(build, work, domain)
    page = (checkout / "docs/tutorial.md").read_text()
    shown = re.findall(r"^`([^`\n]+)`:\n\n```\w+\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    files = {file.name: file.read_text() for file in (checkout / "examples/tutorial").iterdir()}
    if dict(shown) != files:
        wrong = [name for name in {*files, *dict(shown)} if dict(shown).get(name) != files.get(name)]
        raise SystemExit(f"docs/tutorial.md does not show these files of examples/tutorial as they are: {wrong}")
    transcript = type_all(blocks(page, "sh"), checkout, environment)
    check_samples(blocks(page, "text"), transcript)


def try_pages(build, work, domain):
    checkout, environment = prepare(build, work, domain)
    project = work / "project"
    project.mkdir()
    readme = (checkout / "README.md").read_text()
    install = (checkout / "docs/install.md").read_text()
    (program,) = blocks(readme, "cpp")
    (lists,) = blocks(install, "cmake")
    in_clone, in_project = blocks(install, "sh")
    transcript = type_all(blocks(readme, "sh"), checkout, environment)
    type_all(blocks(readme, "sh"), checkout, environment)
    type_all([in_clone], checkout, environment)
    (project / "CMakeLists.txt").write_text(lists)
    (project / "main.cpp").write_text(program)
    transcript += type_all([in_project], project, {**environment, "TFDUDE_PROFILE": "local"})
    check_samples(blocks(readme, "text"), transcript)


def fails(*arguments):
    try:
        type_all(*arguments)
    except SystemExit:
        return True
    return False


def self_test(work):
    """Finds what it must find."""
    environment = {**os.environ, "HOME": str(work), "PATH": f"{work}:{os.environ['PATH']}"}
    program = work / "tfdude"
    program.write_text("#!/bin/sh\nprintf '%s' \"$1\"\n")
    program.chmod(0o755)
    assert not fails(["true\n", "tfdude words\n"], work, environment)
    assert fails(["true\nfalse\ntrue\n"], work, environment)
    assert fails(["no-such-program\n"], work, environment)
    assert fails(["tfdude ''\n"], work, environment)
    assert fails([f"tfdude {'x' * (COLUMNS + 1)}\n"], work, environment)
    assert not fails(["sleep 1000  # until Ctrl-C\n"], work, environment)
    assert not fails(["echo It runs until you press Enter.; read -r\n"], work, environment)
    assert "two\n" in type_all(["sh -c 'echo two' &\nwait\n"], work, environment)
    check_samples(["one\ntwo\n"], "zero\none\ntwo\n")
    try:
        check_samples(["one\nthree\n"], "zero\none\ntwo\n")
    except SystemExit:
        return
    raise AssertionError("a sample that no command printed is accepted")


def main():
    with tempfile.TemporaryDirectory() as work:
        if sys.argv[1:] == ["--self-test"]:
            self_test(Path(work))
        else:
            domain, _lease = lease_domain()
            try_it = try_tutorial if sys.argv[2:] == ["--tutorial"] else try_pages
            try_it(Path(sys.argv[1]).resolve(), Path(work), domain)


if __name__ == "__main__":
    main()
