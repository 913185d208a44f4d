"""Points, directions and poses in another frame, with their covariance."""

from __future__ import annotations

import numpy as np
import pytest

from tfdude import FrameSpec, LoopbackNetwork, Node, Transform, TransformException, UnspecifiedCovariance


def node(X: Transform) -> Node:
    return Node("arm", [FrameSpec("base"), FrameSpec("hand", "base", X)], network=LoopbackNetwork())


def skew(v: np.ndarray) -> np.ndarray:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def test_covariance_of_points_is_linear_in_second_order():
    rng = np.random.default_rng(5)
    A = rng.normal(size=(6, 6)) * 0.01
    X = Transform.from_rpy((1, 2, 3), (0.1, -0.2, 0.3), A @ A.T)
    points = rng.normal(size=(4, 3))
    own = np.diag([1e-4, 2e-4, 3e-4])
    moved = X.transform(points, own)
    R = X.matrix[:3, :3]
    assert len(moved) == 4
    assert np.allclose(moved.coordinates, X.apply(points), atol=1e-14)
    J = [R @ np.hstack([np.eye(3), -skew(p)]) for p in points]
    for i in range(4):
        assert np.allclose(moved.covariance[i], J[i] @ X.covariance @ J[i].T + R @ own @ R.T, atol=1e-15)
    joint = moved.joint_covariance
    assert joint.shape == (12, 12)
    assert np.allclose(joint[0:3, 6:9], J[0] @ X.covariance @ J[2].T, atol=1e-15)
    assert np.allclose(joint[3:6, 3:6], moved.covariance[1], atol=1e-15)


def test_a_single_point_and_a_direction():
    X = Transform.from_rpy((1, 0, 0), (0, 0, np.pi / 2), "exact")
    one = X.transform((1, 0, 0))
    assert one.coordinates.shape == (3,) and one.covariance.shape == (3, 3)
    assert np.allclose(one.coordinates, (1, 1, 0))
    assert np.allclose(X.transform((1, 0, 0), direction=True).coordinates, (0, 1, 0))
    wide = X.with_covariance(np.diag([0, 0, 0, 0, 0, 0.04]))
    assert np.allclose(wide.transform((1, 0, 0)).bias, (0, -0.02, 0))
    assert wide.transform((1, 0, 0), order=4).covariance[1, 1] > 0


def test_points_of_a_client_are_those_of_its_lookup():
    X = Transform.from_rpy((1, 2, 3), (0.1, 0.2, 0.3), np.eye(6) * 1e-4)
    with node(X) as arm:
        points = np.arange(12.0).reshape(4, 3)
        moved = arm.transform("base", "hand", points)
        assert np.array_equal(moved.covariance, arm.lookup("base", "hand").transform(points).covariance)
        assert moved.transform.stamp is None
        X_HC = Transform((0, 0, 1), covariance=np.eye(6) * 1e-6)
        X_BC = arm.transform("base", "hand", X_HC)
        assert np.allclose(X_BC.matrix, (X @ X_HC).matrix, atol=1e-14)
        assert np.allclose(X_BC.covariance, (X @ X_HC).covariance, atol=1e-15)
        with pytest.raises(TransformException):
            arm.transform("base", "nowhere", points)
        with pytest.raises(TypeError):
            arm.transform("base", "hand", X_HC, direction=True)


def test_wrong_points_and_unspecified_covariance():
    X = Transform((1, 2, 3))
    moved = X.transform((0, 0, 0))
    assert np.allclose(moved.coordinates, (1, 2, 3))
    assert np.array_equal(moved.covariance_of_specified, np.zeros((3, 3)))
    for name in ("covariance", "joint_covariance"):
        with pytest.raises(UnspecifiedCovariance):
            getattr(moved, name)
    for wrong in ((1, 2), np.zeros((2, 4)), "abc", (1, 2, np.nan)):
        with pytest.raises((ValueError, TypeError)):
            X.transform(wrong)
    for sigma in (-np.eye(3), np.zeros((2, 3, 3)), np.ones(3)):
        with pytest.raises(ValueError):
            X.transform((1, 2, 3), sigma)
    with pytest.raises(ValueError):
        X.transform((1, 2, 3), order=3)


def test_numpy_may_have_any_layout():
    X = Transform.from_rpy((1, 2, 3), (0.1, 0.2, 0.3), "exact")
    points = np.asfortranarray(np.arange(24, dtype=np.float32).reshape(8, 3))
    assert np.allclose(X.transform(points[::2]).coordinates, X.apply(np.ascontiguousarray(points[::2])))
    assert len(X.transform(np.zeros((0, 3)))) == 0
