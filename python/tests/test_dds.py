"""Over DDS: several processes, a Node in Python, errors of opening."""

import subprocess
import sys
import threading
import time

import numpy as np
import pytest
import tfdude
from helpers import eventually
from tfdude import FrameSpec, Transform

NODE = """
import sys
import tfdude
frames = [tfdude.FrameSpec("hand", "tool", tfdude.Transform((0, 0, 1), stddev=[0.01] * 6))]
with tfdude.Node("hand", frames, domain=int(sys.argv[1]), profile="local") as node:
    print("ready", flush=True)
    sys.stdin.readline()
"""


@pytest.fixture
def domain(dds_domain):
    return {"domain": dds_domain, "profile": "local"}


@pytest.fixture
def hand(domain):
    process = subprocess.Popen(
        [sys.executable, "-c", NODE, str(domain["domain"])], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "ready\n"
    yield process
    if process.poll() is None:
        process.communicate("\n", timeout=30)
    process.wait(30)


def test_a_node_in_python_serves_others(domain, hand):
    frames = [FrameSpec("base"), FrameSpec("tool", "base", Transform.exact((1, 0, 0)))]
    with tfdude.Node("arm", frames, **domain) as arm:
        X = arm.lookup("base", "hand", timeout=20)
        assert np.allclose(X.translation, [1, 0, 1]) and np.allclose(X.stddev, 0.01)
        with tfdude.Client(**domain) as client:
            assert client.lookup("base", "hand") == X
            client.update("hand", Transform.exact((0, 0, 2)))
            assert arm.lookup("tool", "hand").translation[2] == 2
            assert client.lookup_many([("base", "hand")] * 50).poses[:, 2].tolist() == [2] * 50
            watch = client.watch("base", "hand")
            client.update("hand", Transform.exact((0, 0, 3)), 1_000_000_000)
            assert eventually(lambda: watch.latest().translation[2] == 3)
            hand.communicate("\n", timeout=30)
            assert eventually(lambda: not all(p.reachable for p in client.partitions()))
            with pytest.raises(tfdude.UnreachableException) as raised:
                client.lookup("base", "hand")
            assert raised.value.partition == "hand"


def test_close_ends_the_wait_for_others(domain):
    client = tfdude.Client(discovery=60, timeout=60, **domain)
    calls = [client.roots, lambda: client.lookup("a", "b"), lambda: client.exists("a"), client.partitions]
    codes = []

    def run(call):
        try:
            codes.append(call())
        except tfdude.TransformException as error:
            codes.append(error.code)

    threads = [threading.Thread(target=run, args=(call,)) for call in calls]
    for thread in threads:
        thread.start()
    time.sleep(0.05)
    client.close()
    for thread in threads:
        thread.join(20)
    assert codes == ["transport"] * len(calls)


@pytest.fixture
def arm(domain):
    frames = [FrameSpec("base"), FrameSpec("tool", "base", Transform.exact((1, 0, 0)))]
    with tfdude.Node("arm", frames, **domain) as arm:
        yield arm


def info(client, name):
    return next(p for p in client.partitions() if p.name == name)


def test_lookups_in_memory(domain, arm, hand):
    with tfdude.Client(**domain) as client:
        client.lookup("base", "hand", timeout=20)
        client.find_memory()
        assert info(client, "hand").in_memory and info(client, "arm").in_memory
        client.update("hand", Transform.exact((0, 0, 5)))
        X = client.lookup("base", "hand", last_known=True)
        assert X.translation[2] == 5 and X.lost == []
    with tfdude.Client(shared_memory=False, **domain) as client:
        assert client.lookup("base", "hand", timeout=20).translation[2] == 5
        client.find_memory()
        assert not info(client, "hand").in_memory
        assert info(client, "hand").why_not_in_memory == "it is switched off here"


def test_last_values(domain, arm, hand):
    with tfdude.Client(**domain) as client:
        X = client.lookup("base", "hand", timeout=20)
        client.find_memory()
        assert np.array_equal(client.lookup("base", "hand").matrix, X.matrix)
        hand.kill()
        assert eventually(lambda: not info(client, "hand").reachable)
        with pytest.raises(tfdude.UnreachableException):
            client.lookup("base", "hand")
        last = client.lookup("base", "hand", last_known=True)
        assert np.array_equal(last.matrix, X.matrix)
        [(partition, seconds)] = last.lost
        assert partition == "hand" and 0 <= seconds < 60


def test_taken_partition(domain, hand):
    with pytest.raises(tfdude.TransformException) as raised:
        tfdude.Node("hand", **domain)
    assert raised.value.code == "partition_taken"


def test_errors_of_opening(domain):
    with pytest.raises(tfdude.InvalidArgumentException):
        tfdude.Client(domain=300)
    with pytest.raises(tfdude.TransformException) as raised:
        tfdude.Client(profile="/nowhere.xml")
    assert raised.value.code == "config"
