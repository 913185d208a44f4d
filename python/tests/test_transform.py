"""Transforms: their numbers, arrays and operations."""

import gc
import os
import pickle
import subprocess
import sys

import numpy as np
import pytest
import scipy.linalg
import tfdude
from scipy.spatial.transform import Rotation
from tfdude import Transform

COVARIANCE = np.diag([0.01, 0.02, 0.03, 0.001, 0.002, 0.003])


def random_transform(rng: np.random.Generator) -> Transform:
    factor = rng.normal(size=(6, 6)) * 0.1
    rotation = Rotation.random(random_state=rng.integers(1 << 30))
    return Transform(rng.normal(size=3), rotation.as_quat(), factor @ factor.T)


def skew(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def hat(xi):
    """The 4x4 matrix of a twist."""
    return np.block([[skew(xi[3:]), np.reshape(xi[:3], (3, 1))], [np.zeros((1, 4))]])


def adjoint(matrix):
    R, t = matrix[:3, :3], matrix[:3, 3]
    return np.block([[R, skew(t) @ R], [np.zeros((3, 3)), R]])


def test_default_is_identity_of_unspecified_covariance():
    X = Transform()
    assert np.array_equal(X.matrix, np.eye(4))
    assert not X.complete


def test_unspecified_covariance_cannot_be_overlooked():
    X = Transform((1, 2, 3))
    for name in ("covariance", "stddev", "stddev_in_parent", "left_covariance", "ros_covariance"):
        with pytest.raises(tfdude.UnspecifiedCovariance):
            getattr(X, name)
    assert np.array_equal(X.covariance_of_specified, np.zeros((6, 6)))
    with pytest.raises(tfdude.UnspecifiedCovariance):
        (X @ Transform.exact()).covariance
    with pytest.raises(tfdude.UnspecifiedCovariance):
        X.inverse().covariance


def test_exact_has_to_be_said():
    assert np.array_equal(Transform(covariance="exact").covariance, np.zeros((6, 6)))
    assert Transform.exact().complete
    assert not Transform(covariance="unspecified").complete
    with pytest.raises(tfdude.InvalidArgumentException):
        Transform(covariance="perfect")


def test_arrays_cannot_be_changed_and_outlive_the_transform():
    X = Transform((1, 2, 3), (0, 0, 0, 1), COVARIANCE)
    for array in (X.matrix, X.covariance, X.translation, X.quaternion, X.stddev, X.log()):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
    translation, quaternion = X.translation, X.quaternion
    assert translation.base is not None  # a view, which keeps its transform
    del X
    gc.collect()
    assert translation.tolist() == [1, 2, 3]
    assert quaternion.tolist() == [0, 0, 0, 1]


def test_quaternion_is_that_of_scipy():
    R = Rotation.from_euler("xyz", [0.1, -0.2, 0.3])
    X = Transform((0, 0, 0), R.as_quat())
    assert np.allclose(X.matrix[:3, :3], R.as_matrix(), atol=1e-15)
    assert np.allclose(Rotation.from_quat(X.quaternion).as_matrix(), R.as_matrix(), atol=1e-15)
    assert np.allclose(X.rpy, [0.1, -0.2, 0.3], atol=1e-15)
    assert np.allclose(Transform.from_rpy((0, 0, 0), (0.1, -0.2, 0.3)).quaternion, R.as_quat(), atol=1e-15)


def test_from_matrix():
    rng = np.random.default_rng(1)
    X = random_transform(rng)
    Y = Transform.from_matrix(X.matrix, X.covariance)
    assert np.allclose(Y.matrix, X.matrix, atol=1e-14)
    for wrong in (np.diag([1, 1, -1, 1]), np.diag([2, 1, 1, 1]), np.eye(4) + np.eye(4, k=-3), np.full((4, 4), np.nan)):
        with pytest.raises(ValueError):
            Transform.from_matrix(wrong)


def test_compose_and_inverse_with_covariance():
    rng = np.random.default_rng(2)
    for _ in range(20):
        X_AB, X_BC = random_transform(rng), random_transform(rng)
        X_AC = X_AB @ X_BC
        assert np.allclose(X_AC.matrix, X_AB.matrix @ X_BC.matrix, atol=1e-13)
        Ad = adjoint(np.linalg.inv(X_BC.matrix))
        assert np.allclose(X_AC.covariance, Ad @ X_AB.covariance @ Ad.T + X_BC.covariance, atol=1e-13)
        X_BA = X_AB.inverse()
        assert np.allclose(X_BA.matrix, np.linalg.inv(X_AB.matrix), atol=1e-13)
        Ad = adjoint(X_AB.matrix)
        assert np.allclose(X_AB.adjoint(), Ad, atol=1e-13)
        assert np.allclose(X_BA.covariance, Ad @ X_AB.covariance @ Ad.T, atol=1e-13)
        assert np.allclose(X_AB.left_covariance, X_BA.covariance, atol=1e-13)


def test_compose_refuses_what_is_no_transform():
    with pytest.raises(TypeError):
        Transform() @ np.eye(4)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.1, 3.0, np.pi])
def test_exp_and_log(angle):
    xi = np.array([0.3, -0.2, 0.1, 0.6 * angle, 0.0, 0.8 * angle])
    X = Transform.exp(xi)
    assert np.allclose(X.matrix, scipy.linalg.expm(hat(xi)), atol=1e-13)
    assert np.allclose(Transform.exp(X.log()).matrix, X.matrix, atol=1e-13)
    if angle < np.pi:
        assert np.allclose(X.log(), xi, atol=1e-12)


def test_points():
    rng = np.random.default_rng(3)
    X = random_transform(rng)
    points = rng.normal(size=(5, 3))
    expected = points @ X.matrix[:3, :3].T + X.translation
    assert np.allclose(X.apply(points), expected, atol=1e-14)
    assert np.allclose(X.apply(points[2]), expected[2], atol=1e-14)
    assert X.apply(np.empty((0, 3))).shape == (0, 3)
    with pytest.raises(ValueError):
        X.apply(np.zeros((3, 2)))


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.int64, np.uint8, ">f8"])
def test_dtypes_and_strides(dtype):
    padded = np.zeros(6, dtype)
    padded[::2] = [1, 2, 3]
    X = Transform(padded[::2], covariance=np.asfortranarray(COVARIANCE))
    assert X.translation.tolist() == [1, 2, 3]
    assert np.array_equal(X.covariance, COVARIANCE)
    assert Transform(padded[::-2]).translation.tolist() != [1, 2, 3]


def test_upper_triangle():
    upper = COVARIANCE[np.triu_indices(6)]
    assert np.array_equal(Transform(covariance=upper).covariance, COVARIANCE)


def test_stddev():
    X = Transform(stddev=[0.1, 0.2, 0.3, 0.01, 0.02, 0.03])
    assert np.allclose(X.stddev, [0.1, 0.2, 0.3, 0.01, 0.02, 0.03])
    assert np.allclose(np.sqrt(np.diag(X.covariance)), X.stddev)
    with pytest.raises(TypeError):
        Transform(covariance="exact", stddev=[0] * 6)


@pytest.mark.parametrize(
    "arguments",
    [
        {"translation": [1, 2]},
        {"translation": [[1, 2, 3]]},
        {"quaternion": [0, 0, 1]},
        {"covariance": np.eye(5)},
        {"covariance": np.zeros(20)},
        {"stddev": [1] * 5},
    ],
)
def test_wrong_shapes(arguments):
    with pytest.raises(ValueError, match=next(iter(arguments)) + r" must have the shape \("):
        Transform(**arguments)


@pytest.mark.parametrize("translation", ["abc", ["a", "b", "c"], [1j, 0, 0], [None, 0, 0], object()])
def test_no_numbers(translation):
    with pytest.raises(TypeError, match="translation"):
        Transform(translation)


@pytest.mark.parametrize(
    "arguments",
    [
        {"translation": [np.nan, 0, 0]},
        {"translation": [np.inf, 0, 0]},
        {"translation": [1e10, 0, 0]},
        {"quaternion": [0, 0, 0, np.nan]},
        {"quaternion": [0, 0, 0, 2]},
        {"covariance": np.full((6, 6), np.nan)},
        {"covariance": -np.eye(6)},
        {"covariance": np.eye(6) + np.eye(6, k=1)},
        {"stddev": [-1, 0, 0, 0, 0, 0]},
        {"stddev": [0, 0, 0, 0, 0, np.inf]},
    ],
)
def test_invalid_numbers(arguments):
    with pytest.raises(tfdude.InvalidArgumentException) as raised:
        Transform(**arguments)
    assert raised.value.code == "invalid_input"
    assert isinstance(raised.value, ValueError)


def test_exp_refuses_what_is_not_finite():
    with pytest.raises(tfdude.InvalidArgumentException):
        Transform.exp([0, 0, 0, np.nan, 0, 0])
    with pytest.raises(tfdude.InvalidArgumentException):
        Transform.exp([0, np.inf, 0, 0, 0, 0])


def test_interpolate():
    X = Transform.exact().interpolate(Transform.exact((1, 0, 0)), 0.25)
    assert np.allclose(X.translation, [0.25, 0, 0])
    with pytest.raises(ValueError):
        X.interpolate(X, 1.5)


def test_equality_and_text():
    X = Transform((1, 2, 3), stddev=[0.5] * 6)
    assert X == Transform((1, 2, 3), stddev=[0.5] * 6)
    assert X != Transform((1, 2, 3))
    assert X != "X"
    assert repr(X) == (
        "Transform(translation=[1, 2, 3], quaternion=[0, 0, 0, 1], stddev=[0.5, 0.5, 0.5, 0.5, 0.5, 0.5])"
    )
    assert eval(repr(X), {"Transform": Transform}) == X
    assert "covariance='unspecified'" in repr(Transform())
    assert "-0" not in repr(Transform([-0.0, 0, 1], [0, -0.0, 0, 1]))
    assert X.with_covariance(None) == Transform((1, 2, 3))


def test_deviations_beside_coordinates():
    # Turned by 90 degrees about z: the child's x is the parent's y.
    X = Transform((1, 2, 0), [0, 0, 0.5**0.5, 0.5**0.5], stddev=[0.001, 0.1, 0.002, 0.01, 0.02, 0.03])
    assert np.allclose(X.stddev_in_parent, [0.1, 0.001, 0.002, 0.01, 0.02, 0.03])
    assert np.allclose(X.stddev_in_parent[:3], np.sqrt(np.diag(X.ros_covariance))[:3])
    assert "stddev_in_parent=[0.1" in repr(X)
    assert "stddev=" not in repr(X)


GERMAN = """
import locale, tfdude
locale.setlocale(locale.LC_ALL, "de_DE.UTF-8")
assert locale.localeconv()["decimal_point"] == ","
print(repr(tfdude.Transform((0.5, 1234.5, 0))))
try:
    tfdude.Transform((0, 0, 0), (0, 0, 0, 0.5))
except ValueError as error:
    print(error)
"""


def test_texts_do_not_follow_the_locale(tmp_path):
    subprocess.run(["localedef", "-i", "de_DE", "-f", "UTF-8", tmp_path / "de_DE.UTF-8"], check=True)
    environment = {**os.environ, "LOCPATH": str(tmp_path)}
    program = [sys.executable, "-c", GERMAN]
    text = subprocess.run(program, env=environment, check=True, stdout=subprocess.PIPE, text=True).stdout
    assert "translation=[0.5, 1234.5, 0]" in text
    assert "norm 0.5," in text


def test_errors_can_be_pickled():
    given = tfdude.ExtrapolationException("not_yet", "no data", frame="a", partition="b", available=(1, 2))
    error = pickle.loads(pickle.dumps(given))
    assert (error.code, str(error), error.frame, error.partition) == ("not_yet", "no data", "a", "b")
    assert error.available == (1, 2)
    plain = pickle.loads(pickle.dumps(tfdude.LookupException("unknown_frame", "no frame")))
    assert (plain.frame, plain.partition, plain.available) == (None, None, None)
