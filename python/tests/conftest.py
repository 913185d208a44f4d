"""What tests of the Python package share."""

from __future__ import annotations

import collections.abc
import contextlib
import os
import socket

import pytest
import tfdude


@pytest.fixture
def network() -> tfdude.LoopbackNetwork:
    return tfdude.LoopbackNetwork()


@pytest.fixture
def node(network: tfdude.LoopbackNetwork) -> collections.abc.Iterator[tfdude.Node]:
    """A base with an arm of two links; 'tool' has no covariance."""
    frames = [
        tfdude.FrameSpec("base", "", tfdude.Transform.exact()),
        tfdude.FrameSpec("upper", "base", tfdude.Transform((0, 0, 1), stddev=[0.01] * 3 + [0.001] * 3)),
        tfdude.FrameSpec("lower", "upper", tfdude.Transform((1, 0, 0), stddev=[0.01] * 3 + [0.001] * 3)),
        tfdude.FrameSpec("tool", "lower", tfdude.Transform((0, 0.1, 0))),
    ]
    with tfdude.Node("arm", frames, network=network) as opened:
        yield opened


@pytest.fixture
def client(network: tfdude.LoopbackNetwork, node: tfdude.Node) -> collections.abc.Iterator[tfdude.Client]:
    with tfdude.Client(network=network) as opened:
        yield opened


@pytest.fixture
def dds_domain() -> collections.abc.Iterator[int]:
    """A DDS domain that no other test on this computer uses now; claimed as by tests/support/domain_lease.cpp."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as claim:
        for i in range(200):
            domain = 20 + (os.getpid() * 7 + i) % 200
            with contextlib.suppress(OSError):
                claim.bind(f"\0tfdude-test-domain-{domain}")
                yield domain
                return
    raise RuntimeError("all DDS domains for tests are taken")
