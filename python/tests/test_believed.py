"""What was believed before: of one owner, and of several."""

import asyncio

import pytest
import tfdude

SECOND = 1_000_000_000


@pytest.fixture
def owners(network):
    odom = tfdude.FrameSpec("odom", "map", moving=True, span=600, believed=30)
    hand = tfdude.FrameSpec("hand", "odom", tfdude.Transform.exact((10, 0, 0)), believed=30.0)
    with tfdude.Node("base", [tfdude.FrameSpec("map"), odom], network=network) as base:
        with tfdude.Node("arm", [hand], network=network) as arm:
            for k in range(10):
                base.update("odom", tfdude.Transform.exact((k, 0, 0)), (100 + k) * SECOND)
            yield base, arm


@pytest.fixture
def client(network, owners):
    with tfdude.Client(network=network) as client:
        yield client


def test_answers_as_of_then(client, owners):
    base, arm = owners
    then = client.now()
    base.update("odom", tfdude.Transform.exact((50, 0, 0)), 104_500_000_000)
    between = client.now()
    arm.update("hand", tfdude.Transform.exact((20, 0, 0)))

    def x(at, believed_at):
        return client.lookup("map", "hand", at, believed_at=believed_at).translation[0]

    at = 104_500_000_000
    assert x(at, then) == 14.5
    assert x(at, between) == 60
    assert x(at, client.now()) == 70
    assert x(at, None) == 70
    for moment, expected in ((then, 14.5), (between, 60), (client.now(), 70)):
        many = client.lookup_many("map", ["hand", "map"], at, believed_at=moment)
        assert many.poses[:, 0].tolist() == [expected, 0]
        assert client.lookup_many([("map", "hand")], [at, at], believed_at=moment).poses[1, 0] == expected
        assert client.trajectory("map", "hand", [at], believed_at=moment).poses[0, 0] == expected
    assert x(None, then) == 19
    assert asyncio.run(client.lookup_async("map", "hand", at, believed_at=then)).translation[0] == 14.5


def test_errors_say_what_can_be_asked_for(client, owners):
    with pytest.raises(tfdude.ExtrapolationException, match="the edge of '(odom|hand)'.* since "):
        client.lookup("map", "hand", believed_at=client.now() - 3600 * SECOND)
    with pytest.raises(tfdude.ExtrapolationException, match="clock"):
        client.lookup("map", "hand", believed_at=client.now() + 3600 * SECOND)


def test_nothing_is_remembered_by_default(network):
    with tfdude.Node("base", [tfdude.FrameSpec("map"), tfdude.FrameSpec("odom", "map")], network=network) as node:
        with pytest.raises(tfdude.ExtrapolationException, match="'odom'.*`believed`"):
            node.lookup("map", "odom", believed_at=node.now())


def test_the_time_is_not_negative():
    with pytest.raises(ValueError, match="believed"):
        tfdude.FrameSpec("odom", "map", believed=-1)
