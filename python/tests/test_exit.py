"""Threads, the end of the interpreter, fork() and signals: nothing hangs, crashes or is left silently."""

import os
import signal
import subprocess
import sys
import textwrap

import pytest

PREPARE = """
import os, sys, threading, time
import tfdude
from tfdude import FrameSpec, Transform
network = tfdude.LoopbackNetwork()
node = tfdude.Node("arm", [FrameSpec("base"), FrameSpec("tool", "base", Transform.exact())], network=network)
client = tfdude.Client(network=network)
client.lookup("base", "tool")
"""
TIMEOUT = 30


def run(text, prepare=PREPARE, literal=False):
    """The program's output; it must end by itself, without an error."""
    text = textwrap.dedent(text)
    program = subprocess.run(
        [sys.executable, "-c", prepare + (repr(text) if literal else text)],
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
    )
    assert program.returncode == 0, program.stderr
    assert program.stderr == ""
    return program.stdout


def test_exit_with_everything_open():
    run("""
        watch = client.watch("base", "tool")
        subscription = client.on_change(print)
        events = client.events()
        stream = client.stream(["tool"])
    """)


def test_threads_read_the_first_arrays_at_once():
    run("""
        barrier = threading.Barrier(4)
        def read():
            barrier.wait()
            client.lookup("base", "tool").translation
        threads = [threading.Thread(target=read) for _ in range(4)]
        for thread in threads: thread.start()
        for thread in threads: thread.join()
    """)


def test_exit_while_daemon_threads_wait():
    run("""
        for _ in range(4):
            threading.Thread(target=lambda: client.lookup("base", "never", timeout=float("inf")), daemon=True).start()
        watch = client.watch("base", "tool")
        threading.Thread(target=lambda: watch.wait_for_more(10**9, float("inf")), daemon=True).start()
        threading.Thread(target=lambda: list(client.events()), daemon=True).start()
        time.sleep(0.2)
    """)


def test_exit_while_daemon_threads_call():
    run("""
        def work():
            while True:
                try:
                    client.lookup("base", "tool")
                    node.update("tool", Transform.exact())
                    client.lookup("base", "nowhere")
                except Exception:
                    pass
        for _ in range(4):
            threading.Thread(target=work, daemon=True).start()
        time.sleep(0.2)
    """)


def test_exit_during_callbacks():
    run("""
        subscription = client.on_change(lambda change: time.sleep(0.01))
        def work():
            i = 0
            while True:
                node.add(f"frame{i}", "tool", Transform())
                i += 1
                time.sleep(0.001)
        threading.Thread(target=work, daemon=True).start()
        time.sleep(0.3)
    """)


def test_exit_during_asyncio():
    run("""
        import asyncio
        async def main():
            asyncio.create_task(client.lookup_async("base", "never", timeout=float("inf")))
            await asyncio.sleep(0.05)
        asyncio.run(main())
    """)


def test_calls_of_cancelled_tasks_do_not_hold_up_the_end():
    run("""
        import asyncio
        from tfdude import aio
        async def main():
            async with aio.Client(client) as shared:
                for wait in (shared.watch("base", "never", timeout=float("inf")),
                             shared.lookup_many("base", ["never"], timeout=float("inf")),
                             shared.can_lookup("base", "never", timeout=float("inf")),
                             shared.velocity("base", "never", timeout=float("inf"))):
                    try:
                        await asyncio.wait_for(wait, 0.05)
                        assert False
                    except asyncio.TimeoutError:
                        pass
        asyncio.run(main())
    """)


def test_nothing_works_once_the_interpreter_ends():
    out = run(
        """
        try:
            client.lookup("base", "tool")
            tfdude.Client(network=network)
        except SystemExit as error:
            print(error)
        """,
        # Functions of atexit run in reverse order: this one after that of tfdude.
        "import atexit\natexit.register(lambda: exec(LATE, globals()))\n" + PREPARE + "LATE = ",
        literal=True,
    )
    assert out == "the interpreter ends\n"


def test_child_of_a_fork_gets_a_clear_error():
    out = run("""
        import warnings
        # Python 3.12 and later warn of what is tested here.
        warnings.filterwarnings("ignore", "This process .* is multi-threaded", DeprecationWarning)
        watch = client.watch("base", "tool", timeout=10)
        edges = client.watch_edges(["tool"], timeout=10)
        events = client.events()
        messages = tfdude.MessageFilter(client, "base")
        child = os.fork()
        if child == 0:
            failures = 0
            for call in (lambda: client.lookup("base", "tool"), lambda: node.update("tool", Transform()),
                         lambda: tfdude.Client(network=network), lambda: client.stream(["tool"]),
                         watch.latest, watch.lookup, lambda: watch.messages, watch.check,
                         lambda: edges.lookup("base", "tool"), lambda: edges.messages, watch.wait_next,
                         lambda: watch.wait_for_more(0), events.get, lambda: events.get(1), lambda: next(iter(events)),
                         messages.get, lambda: messages.get(1), lambda: next(iter(messages))):
                try:
                    call()
                except tfdude.TransformException as error:
                    assert "fork" in str(error), error
                    failures += 1
            client.close()
            X = Transform.exact() @ Transform.exact()  # mathematics works
            sys.stdout.write(f"{failures} failures")
            sys.exit()  # an orderly end, with destructors
        _, status = os.waitpid(child, 0)
        assert status == 0, status
        client.lookup("base", "tool")  # the parent goes on
    """)
    assert out == "18 failures"


def test_fork_before_use_works():
    run(
        """
        child = os.fork()
        with tfdude.Client(network=network) as client:
            assert client.frames() == []
        if child:
            assert os.waitpid(child, 0)[1] == 0
        """,
        "import os, tfdude\nnetwork = tfdude.LoopbackNetwork()\n",
    )


def test_multiprocessing_by_spawn(tmp_path):
    script = tmp_path / "spawning.py"
    script.write_text(
        "import multiprocessing, tfdude\n"
        "def work(_):\n"
        "    with tfdude.Node('arm', [tfdude.FrameSpec('base')], network=tfdude.LoopbackNetwork()) as node:\n"
        "        return node.own_frames\n"
        "if __name__ == '__main__':\n"
        "    work(0)\n"
        "    with multiprocessing.get_context('spawn').Pool(1) as pool:\n"
        "        assert pool.map(work, [0, 1]) == [1, 1]\n"
    )
    program = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=TIMEOUT)
    assert program.returncode == 0 and program.stderr == "", program.stderr


@pytest.mark.parametrize(
    "wait",
    [
        'client.lookup("base", "never", timeout=float("inf"))',
        'client.watch("base", "tool").wait_for_more(10**9, float("inf"))',
        "next(client.events())",
    ],
)
def test_interrupt_ends_a_wait(wait):
    program = subprocess.Popen(
        [sys.executable, "-c", PREPARE + f"print('waiting', flush=True)\n{wait}\n"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert program.stdout.readline() == "waiting\n"
    os.kill(program.pid, signal.SIGINT)
    _, error = program.communicate(timeout=TIMEOUT)
    assert "KeyboardInterrupt" in error
