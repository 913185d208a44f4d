"""Types the shell blocks of README.md into one shell, line by line, twice; compiles and runs its C++ blocks.

    type_blocks.py BUILD_DIR CXX [CXX_FLAGS...]

BUILD_DIR replaces build/release. Everything runs in its own DDS domain, with an empty home directory.
"""
import os
import re
import select
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LINE_SECONDS = 60


def blocks(text, language):
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def lines_of(block):
    return [line for line in block.replace("\\\n", " ").splitlines() if line.strip()]


def lease_domain():
    """Reserves a DDS domain, as tests/support/domain_lease.cpp does. It is free again when the socket is closed."""
    for i in range(200):
        domain = 20 + (os.getpid() * 7 + i) % 200
        lease = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            lease.bind(f"\0tfdude-test-domain-{domain}")
            return domain, lease
        except OSError:
            lease.close()
    raise SystemExit("all DDS domains for tests are taken")


class Shell:
    """Passes typed lines to bash; a mark with the status follows the output of each line."""

    def __init__(self, environment):
        self.bash = subprocess.Popen(
            ["bash", "--noprofile", "--norc"], cwd=ROOT, env=environment,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True)
        self.output = b""

    def type(self, line):
        """Returns the output of the line and of background jobs, and the status."""
        self.bash.stdin.write(f"{line}\necho; echo '=== status' $?\n".encode())
        self.bash.stdin.flush()
        deadline = time.monotonic() + LINE_SECONDS
        while not (mark := re.search(rb"\n=== status (\d+)\n", self.output)):
            ready, _, _ = select.select([self.bash.stdout], [], [], max(0, deadline - time.monotonic()))
            new = os.read(self.bash.stdout.fileno(), 65536) if ready else b""
            if not new:
                raise SystemExit(f"no end of: {line}\n{self.output.decode()}")
            self.output += new
        printed, self.output = self.output[:mark.start()], self.output[mark.end():]
        return printed.decode(), int(mark[1])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        """Kills programs that still run, for example after a line has failed."""
        try:
            os.killpg(self.bash.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        self.bash.wait(LINE_SECONDS)


def type_all(shell_blocks, environment):
    with Shell(environment) as shell:
        for line in (line for block in shell_blocks for line in lines_of(block)):
            printed, status = shell.type(line)
            print(f"$ {line}\n{printed.strip()}\n", flush=True)
            if status != 0:
                raise SystemExit(f"status {status} of: {line}")
            if line.startswith("tfdude ") and not printed.strip():
                raise SystemExit(f"no output of: {line}")


def compile_and_run(number, code, build, compiler, environment, work):
    source = work / f"block_{number}.cpp"
    source.write_text(code)
    program = source.with_suffix("")
    subprocess.run([*compiler, "-std=c++17", "-Wall", "-Wextra", "-Werror", f"-I{ROOT}/include",
                    "-isystem", "/usr/include/eigen3", source, f"-L{build}/lib", "-ltfdude",
                    f"-Wl,-rpath,{build}/lib", "-o", program], check=True)
    done = subprocess.run([program], env=environment, timeout=LINE_SECONDS, check=True,
                          stdout=subprocess.PIPE, text=True)
    print(f"C++ block {number}: {done.stdout}")
    if not done.stdout:
        raise SystemExit(f"no output of C++ block {number}")


def main():
    build, compiler = Path(sys.argv[1]).resolve(), sys.argv[2:]
    text = (ROOT / "README.md").read_text()
    shell_blocks = [block.replace("$PWD/build/release", str(build)) for block in blocks(text, "sh")]
    programs = blocks(text, "cpp")
    if not shell_blocks or not programs:
        raise SystemExit("README.md has no blocks to try")
    domain, _lease = lease_domain()
    with tempfile.TemporaryDirectory() as home:
        environment = {**os.environ, "HOME": home, "TFDUDE_DOMAIN": str(domain)}
        for _ in range(2):
            type_all(shell_blocks, environment)
        for number, code in enumerate(programs):
            compile_and_run(number, code, build, compiler, {**environment, "TFDUDE_PROFILE": "local"}, Path(home))


if __name__ == "__main__":
    main()
