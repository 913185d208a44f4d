"""Values in pickles and as copies: the same in all digits."""

from __future__ import annotations

import copy
import multiprocessing
import pickle

import numpy as np
import pytest
import tfdude
from tfdude import FrameSpec, Geodetic, Joint, Transform

START = 1_000_000_000_000_000_000


def properties(value: object) -> object:
    """All that can be read of a value, as text with all digits: of other values in it, theirs."""
    if value is None or isinstance(value, (bool, int, float, str)):
        return repr(value)
    if isinstance(value, np.ndarray):
        return repr(value.tolist())
    if isinstance(value, (list, tuple)):
        return [properties(one) for one in value]
    if isinstance(value, dict):
        return {key: properties(one) for key, one in value.items()}
    if not type(value).__module__.startswith("tfdude"):
        return repr(value)
    told = {"class": type(value).__name__}
    for name in dir(type(value)):
        # What can be asked of each other without an end.
        if name in ("geodetic", "utm", "enu") or name.startswith("_"):
            continue
        if isinstance(getattr(type(value), name), property):
            try:
                told[name] = properties(getattr(value, name))
            except tfdude.TransformException as error:
                told[name] = str(error)
    return told


def check(value: object) -> None:
    told = properties(value)
    assert len(told) > 1
    for protocol in range(2, pickle.HIGHEST_PROTOCOL + 1):
        assert properties(pickle.loads(pickle.dumps(value, protocol))) == told
    assert properties(copy.copy(value)) == told
    assert properties(copy.deepcopy([value])[0]) == told
    assert type(value).__name__ in repr(value)


def some_transforms() -> list[Transform]:
    rng = np.random.default_rng(7)
    some = [Transform(), Transform.exact((1, 2, 3))]
    for _ in range(200):
        A = rng.normal(size=(6, 6))
        some.append(Transform.exp(rng.normal(size=6), A @ A.T))
    # Rotations that creation would round again.
    for X, Y in zip(some[2:40], some[40:]):
        some.append(X @ Y)
    return some


def test_transforms():
    for X in some_transforms():
        same = pickle.loads(pickle.dumps(X))
        assert same == X and same.complete == X.complete
        assert same.quaternion.tobytes() == X.quaternion.tobytes()
        assert copy.deepcopy(X) == X
    check(some_transforms()[-1])


def test_what_calls_return(network, node, client):
    for i in range(3):
        node.update("tool", Transform((i, 0, 0), stddev=[0.1] * 6), START + i * 100_000_000)
    node.update("upper", Transform((0, 0, 1)))
    X = client.lookup("base", "tool", START + 50_000_000)
    assert type(pickle.loads(pickle.dumps(X))) is tfdude.StampedTransform
    for value in [X, client.lookup("base", "lower"), client.velocity("upper", "tool"), *client.frames(),
                  *client.path("base", "tool"), *client.partitions(), *client.history("tool")]:
        check(value)
    observed = client.observe("upper", "tool", Transform((2, 0, 0), stddev=[0.1] * 6))
    check(observed)
    node.correlate("upper", {"heat": (0, 0, 1e-3, 0, 0, 0)})
    nothing = client.why("base", "nowhere")
    assert properties(pickle.loads(pickle.dumps(nothing))) == properties(nothing)
    for value in [client.why("base", "lower"), nothing.cause, client.can_lookup("base", "nowhere")]:
        check(value)
    possible = pickle.loads(pickle.dumps([client.can_lookup("base", "tool"), client.can_lookup("base", "nowhere")]))
    assert [bool(one) for one in possible] == [True, False]
    Q = np.diag([1e-4, 2e-4, 3e-4])
    for points in [client.transform("base", "lower", (0, 0, 1)), client.transform("base", "lower", np.eye(3), order=4),
                   client.transform("base", "lower", np.eye(3), covariance=Q, direction=True),
                   client.transform("base", "lower", np.zeros((0, 3)))]:
        check(points)


def test_descriptions_of_frames():
    X = Transform((1, 2, 3), stddev=[0.1, 0.2, 0.3, 0.01, 0.02, 0.03])
    check(Joint("elbow", "prismatic", (0, 1, 0), limits=(-1, 2), position=0.5, variance=1e-4, strict=True))
    joint = Joint("elbow", limits=(-1, 2), position=0.5, variance=1e-4)
    for frame in [FrameSpec("a", "b", X), FrameSpec("a", "b", X, joint=joint),
                  FrameSpec("a", "b", X, span=3.5, count=77, process_noise=np.eye(6) * 1e-3, drifts=True)]:
        check(frame)
    # What no property shows is also there: a node behaves as with the original.
    frames = [FrameSpec("root"), FrameSpec("arm", "root", joint=joint)]
    with tfdude.Node("one", pickle.loads(pickle.dumps(frames)), network=tfdude.LoopbackNetwork()) as node:
        info = node.joints("one")[0]
        assert info.limits == (-1, 2) and info.position == 0.5 and info.variance == 1e-4
        check(info)
        assert np.allclose(node.lookup("root", "arm").rpy, [0, 0, 0.5])


def test_shared_errors_of_a_graph(tmp_path):
    file = tmp_path / "graph.g2o"
    information = "1 0 0 0 0 0 2 0 0 0 0 3 0 0 0 4 0 0 5 0 6"
    file.write_text("".join(f"VERTEX_SE3:QUAT {i} {i} 0 0 0 0 0 1\n" for i in range(3)) + "FIX 0\n" +
                    "".join(f"EDGE_SE3:QUAT {i} {i + 1} 1 0 0 0 0 0 1 {information}\n" for i in range(2)))
    frames = tfdude.read_frames(str(file))
    assert any(frame.sources for frame in frames)
    for frame in frames:
        check(frame)


def test_places():
    for value in [Geodetic(48.137154, 11.576124, 519), Geodetic(-85, 0).utm, Geodetic(10, 20).enu.geodetic]:
        check(value)
    assert repr(Geodetic(48, 11.5, 7)) == "Geodetic(latitude=48.0, longitude=11.5, altitude=7.0)"
    assert repr(Geodetic(0, 3).utm).startswith("Utm(zone=31, north=True, easting=500000.0")


def shifted(X: Transform) -> Transform:
    return X @ Transform.exact((1, 0, 0))


def test_another_process_gets_them():
    X = some_transforms()[5]
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        assert pool.apply(shifted, (X,)) == shifted(X)


def test_what_is_no_value_is_rejected():
    state = Transform((1, 2, 3)).__getstate__()
    for wrong in [(), (1, 2), state[:1], (state[0],) * 2, ((([0, 0, 0, 0], [0, 0, 0])), state[1]),
                  (([0, 0, 0, 1], [float("nan"), 0, 0]), state[1]), (state[0], ([-1.0] * 21, True)),
                  (state[0], ([0.0] * 20, True))]:
        with pytest.raises((ValueError, TypeError, RuntimeError)):
            Transform.__new__(Transform).__setstate__(wrong)
