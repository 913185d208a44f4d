"""Places on the Earth beside the closed forms of WGS84, in the longest floating-point type of numpy."""

from __future__ import annotations

import numpy as np
import pytest
import tfdude
from tfdude import FrameSpec, Geodetic, Transform, Utm

L = np.longdouble
A, F = L(6378137), 1 / L("298.257223563")
E2 = F * (2 - F)
PI = L("3.14159265358979323846264338327950288")

PLACES = [(48.137154, 11.576124, 519.0), (-33.8567844, 151.2152967, 4.2), (0.0, 0.0, 0.0), (89.9, -120.0, 10.0),
          (-90.0, 0.0, 2835.0), (64.1, -21.9, -3.0), (27.98785, 86.92503, 8848.86)]


def ecef(latitude, longitude, altitude) -> np.ndarray:
    phi, lam = L(latitude) * PI / 180, L(longitude) * PI / 180
    N = A / np.sqrt(1 - E2 * np.sin(phi) ** 2)
    return np.array([(N + L(altitude)) * np.cos(phi) * np.cos(lam), (N + L(altitude)) * np.cos(phi) * np.sin(lam),
                     (N * (1 - E2) + L(altitude)) * np.sin(phi)])


def enu(latitude, longitude, altitude) -> np.ndarray:
    """The axes east, north and up, as the columns of the rotation of a homogeneous matrix."""
    phi, lam = L(latitude) * PI / 180, L(longitude) * PI / 180
    up = np.array([np.cos(phi) * np.cos(lam), np.cos(phi) * np.sin(lam), np.sin(phi)])
    east = np.array([-np.sin(lam), np.cos(lam), L(0)])
    X = np.eye(4, dtype=L)
    X[:3, 0], X[:3, 1], X[:3, 2] = east, np.cross(up, east), up
    X[:3, 3] = ecef(latitude, longitude, altitude)
    return X


def inverse(X) -> np.ndarray:
    Y = np.eye(4, dtype=L)
    Y[:3, :3] = X[:3, :3].T
    Y[:3, 3] = -X[:3, :3].T @ X[:3, 3]
    return Y


def adjoint(X) -> np.ndarray:
    R, (x, y, z) = X[:3, :3], X[:3, 3]
    T = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], dtype=L)
    return np.block([[R, T @ R], [np.zeros((3, 3), dtype=L), R]])


@pytest.mark.parametrize("place", PLACES)
def test_places_and_axes(place):
    X = Geodetic(*place).enu
    assert np.abs(X.matrix - enu(*place))[:3, 3].max() < 5e-9
    assert np.abs(X.matrix - enu(*place))[:3, :3].max() < 1e-15
    assert np.array_equal(X.covariance, np.zeros((6, 6)))
    back = Geodetic.from_ecef(ecef(*place))
    assert back.latitude == pytest.approx(place[0], abs=1e-13) and back.altitude == pytest.approx(place[2], abs=1e-8)
    if abs(place[0]) < 90:
        assert back.longitude == pytest.approx(place[1], abs=1e-12)
    for bad in ([np.nan, 0, 0], [np.inf, 0, 0]):
        with pytest.raises(tfdude.InvalidArgumentException):
            Geodetic.from_ecef(bad)


def mercator(latitude, longitude, zone):
    """Krüger's series in n, to the sixth power."""
    n = F / (2 - F)
    alpha = [n / 2 - 2 * n**2 / 3 + 5 * n**3 / 16 + 41 * n**4 / 180 - 127 * n**5 / 288 + 7891 * n**6 / 37800,
             13 * n**2 / 48 - 3 * n**3 / 5 + 557 * n**4 / 1440 + 281 * n**5 / 630 - 1983433 * n**6 / 1935360,
             61 * n**3 / 240 - 103 * n**4 / 140 + 15061 * n**5 / 26880 + 167603 * n**6 / 181440,
             49561 * n**4 / 161280 - 179 * n**5 / 168 + 6601661 * n**6 / 7257600,
             34729 * n**5 / 80640 - 3418889 * n**6 / 1995840, 212378941 * n**6 / 319334400]
    phi, lam = L(latitude) * PI / 180, (L(longitude) - (6 * zone - 183)) * PI / 180
    e = np.sqrt(E2)
    t = np.sinh(np.arctanh(np.sin(phi)) - e * np.arctanh(e * np.sin(phi)))
    xi, eta = np.arctan2(t, np.cos(lam)), np.arctanh(np.sin(lam) / np.sqrt(1 + t * t))
    k = 2 * np.arange(1, 7)
    radius = A / (1 + n) * (1 + n**2 / 4 + n**4 / 64 + n**6 / 256) * L("0.9996")
    x = radius * (eta + sum(a * np.cos(j * xi) * np.sinh(j * eta) for a, j in zip(alpha, k)))
    y = radius * (xi + sum(a * np.sin(j * xi) * np.cosh(j * eta) for a, j in zip(alpha, k)))
    return np.array([x + 500000, y + (0 if latitude >= 0 else 10000000)])


@pytest.mark.parametrize("place", [p for p in PLACES if abs(p[0]) < 80])
def test_utm_with_zone_scale_and_convergence(place):
    utm = Geodetic(*place).utm
    assert utm.zone == int((place[1] + 180) // 6) + 1 and utm.north == (place[0] >= 0)
    assert np.abs(mercator(place[0], place[1], utm.zone) - [utm.easting, utm.northing]).max() < 1e-6
    assert utm.altitude == place[2]
    back = Utm(utm.zone, utm.north, utm.easting, utm.northing, utm.altitude).geodetic
    assert back.latitude == pytest.approx(place[0], abs=1e-12) and back.longitude == pytest.approx(place[1], abs=1e-12)
    # A step of 2 m to the north on the ellipsoid, on the map.
    d = L(1) / 111000
    step = mercator(L(place[0]) + d, place[1], utm.zone) - mercator(L(place[0]) - d, place[1], utm.zone)
    length = np.linalg.norm((ecef(L(place[0]) + d, place[1], 0) - ecef(L(place[0]) - d, place[1], 0)).astype(float))
    if place[0] != 0:  # there the two ends have other false northings
        assert np.linalg.norm(step.astype(float)) / length == pytest.approx(utm.scale, abs=1e-8)
        assert -np.arctan2(step[0], step[1]) == pytest.approx(utm.convergence, abs=1e-8)


def test_poles_have_another_map():
    utm = Geodetic(89.9, -120).utm
    assert utm.zone == 0 and utm.north
    assert Utm(0, True, utm.easting, utm.northing).geodetic.latitude == pytest.approx(89.9)


COVARIANCE = np.diag([0.5, 0.4, 1.0, 1e-3, 2e-3, 3e-3]) ** 2


def test_covariance_at_levers_of_7000_km(network):
    """Two sites, each with an uncertain attitude: seen from the centre of the Earth that is kilometres, between them it
    is metres."""
    place_1, place_2 = (48.137154, 11.576124, 519.0), (48.0, 11.7, 560.0)
    X_1, X_2 = (Transform(Geodetic(*p).enu.translation, Geodetic(*p).enu.quaternion, COVARIANCE)
                for p in (place_1, place_2))
    frames = [FrameSpec("earth"), FrameSpec("site_1", "earth", X_1), FrameSpec("site_2", "earth", X_2),
              FrameSpec("robot", "site_2", Transform((100, 50, 1), covariance=np.eye(6) * 1e-4))]
    with tfdude.Node("map", frames, network=network) as node:
        X = node.lookup("site_1", "robot")
        Y = np.eye(4, dtype=L)
        Y[:3, 3] = 100, 50, 1
        X_1R = inverse(enu(*place_1)) @ enu(*place_2) @ Y
        assert np.abs(X.matrix - X_1R).max() < 1e-8
        sigma = adjoint(inverse(X_1R)) @ COVARIANCE @ adjoint(inverse(X_1R)).T
        sigma += adjoint(inverse(Y)) @ COVARIANCE @ adjoint(inverse(Y)).T + np.eye(6) * 1e-4
        assert np.abs(X.stddev - np.sqrt(np.diag(sigma))).max() < 1e-6
        deviations = np.sqrt(np.diag(sigma)).astype(float)
        assert np.abs((X.covariance - sigma) / np.outer(deviations, deviations)).max() < 1e-9
        # And back: the centre of the Earth, seen from the robot.
        X = node.lookup("robot", "earth")
        X_RE = inverse(enu(*place_2) @ Y)
        sigma = adjoint(inverse(X_RE)) @ (np.eye(6) * 1e-4) @ adjoint(inverse(X_RE)).T
        X_SE = inverse(enu(*place_2))
        sigma += adjoint(inverse(X_SE)) @ COVARIANCE @ adjoint(inverse(X_SE)).T
        deviations = np.sqrt(np.diag(sigma)).astype(float)
        assert deviations.max() > 5000
        assert np.abs(X.stddev / deviations - 1).max() < 1e-12
        assert np.abs((X.covariance - sigma) / np.outer(deviations, deviations)).max() < 1e-12


def test_a_lookup_in_latitude_and_longitude(network):
    yaw = 0.3
    X = Geodetic(48.0, 11.5, 500).enu @ Transform((0, 0, 0), (0, 0, np.sin(yaw / 2), np.cos(yaw / 2)), COVARIANCE)
    with tfdude.Node("map", [FrameSpec("earth"), FrameSpec("car", "earth", X)], network=network) as node:
        seen = node.lookup("earth", "car").geodetic
        assert seen.place.latitude == pytest.approx(48, abs=1e-12)
        assert seen.place.longitude == pytest.approx(11.5, abs=1e-12)
        assert seen.place.altitude == pytest.approx(500, abs=1e-8)
        assert seen.utm.zone == 32 and seen.utm.north
        assert seen.X_NB.rpy == pytest.approx([0, 0, yaw], abs=1e-14)
        # East and north of what was given along the car's axes.
        R = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
        expected = np.sqrt(np.diag(R @ np.diag([0.25, 0.16]) @ R.T))
        assert seen.X_NB.stddev_in_parent[:3] == pytest.approx([*expected, 1.0])
        with pytest.raises(tfdude.TransformException, match="not in an earth frame: the position is 0 m"):
            node.lookup("car", "car").geodetic


def test_a_fix_of_a_receiver(network):
    """NavSatFix: a measured position corrects the position, and says nothing of the rotation."""
    sigma = np.array([[4.0, 1.0, 0], [1.0, 3.0, 0], [0, 0, 9.0]])
    fix = Geodetic(48, 11.5, 500).fix(sigma)
    assert fix.covariance[:3, :3] == pytest.approx(sigma)
    start = Geodetic(48.00001, 11.5, 500).enu.with_covariance(np.diag([100.0] * 3 + [0.1] * 3))
    with tfdude.Node("map", [FrameSpec("earth"), FrameSpec("car", "earth", start)], network=network) as node:
        assert node.observe("earth", "car", fix).accepted
        X = node.lookup("earth", "car")
        place = X.geodetic.place
        assert place.latitude == pytest.approx(48, abs=1e-6)
        assert X.stddev[:3].max() < 3.1
        assert X.stddev[3:] == pytest.approx(np.sqrt([0.1] * 3), rel=1e-3)
    with pytest.raises(ValueError):
        Geodetic(48, 11.5).fix(-sigma)


def test_a_frame_with_a_geodetic_origin_in_a_configuration(tmp_path):
    file = tmp_path / "map.yaml"
    file.write_text("frames:\n  - {id: earth}\n"
                    "  - {id: map, parent: earth, geodetic: [48.137154, 11.576124, 519]}\n"
                    "  - {id: dock, parent: earth, geodetic: [48.137154, 11.576124, 519], rpy: [0, 0, 0.5]}\n")
    earth, site, dock = tfdude.load_config(str(file)).frames
    assert np.allclose(site.X_PC.matrix, Geodetic(48.137154, 11.576124, 519).enu.matrix, atol=1e-12)
    assert (site.X_PC.inverse() @ dock.X_PC).rpy == pytest.approx([0, 0, 0.5])
    for key, why in [("geodetic: [91, 0, 0]", "geodetic: latitude is 91, not within -90 and 90 degrees"),
                     ("geodetic: [1, 0, .nan]", "geodetic[2] is not a finite number"),
                     ("geodetic: [1, 0, 0], xyz: [0, 0, 0]", "geodetic is given beside xyz or matrix, one is enough")]:
        file.write_text("frames:\n  - {id: earth}\n  - {id: map, parent: earth, " + key + "}\n")
        with pytest.raises(tfdude.TransformException) as error:
            tfdude.load_config(str(file))
        assert str(error.value).endswith("map.yaml:3: frame 'map': " + why)
    for place in [(91, 0), (0, 600), (0, 0, 1e10), (float("nan"), 0)]:
        with pytest.raises(ValueError):
            Geodetic(*place)
    with pytest.raises(ValueError):
        Utm(61, True, 0, 0).geodetic
