"""What tests of the Python package share."""

from __future__ import annotations

import collections.abc
import pathlib
import sys

import pytest
import tfdude

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tests/support"))
from domain_lease import lease_domain  # noqa: E402


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
    """A DDS domain that nobody else on this computer uses now."""
    domain, claim = lease_domain()
    with claim:
        yield domain
