"""Pose graphs of g2o beside a dense solve in numpy, with derivatives by differences, in g2o's own coordinates."""

from __future__ import annotations

import itertools
import pathlib

import numpy as np
import pytest
import tfdude
from helpers import eventually
from tfdude import FrameSpec, Transform

H = 1e-6  # of differences


def product(a, b):
    """Of quaternions x y z w."""
    (ax, ay, az, aw), (bx, by, bz, bw) = a, b
    return np.array([aw * bx + bw * ax + ay * bz - az * by, aw * by + bw * ay + az * bx - ax * bz,
                     aw * bz + bw * az + ax * by - ay * bx, aw * bw - ax * bx - ay * by - az * bz])


def turned(q, p):
    return product(product(q, np.array([*p, 0.0])), q * [-1, -1, -1, 1])[:3]


def times(X, Y):
    return (X[0] + turned(X[1], Y[0]), product(X[1], Y[1]))


def inverse(X):
    q = X[1] * [-1, -1, -1, 1]
    return (-turned(q, X[0]), q)


def to_mqt(X):
    """g2o's vector of a pose: the translation, and the vector part of the quaternion with w >= 0."""
    return np.array([*X[0], *(X[1][:3] if X[1][3] >= 0 else -X[1][:3])])


def from_mqt(d):
    return (d[:3], np.array([*d[3:], np.sqrt(1 - d[3:] @ d[3:])]))


def angle_vector(X):
    """(translation, angle vector), which is the right perturbation where it is small."""
    e = to_mqt(X)
    e[3:] *= 2
    return e


def difference(error, a, b):
    """The derivatives of error(X_a, X_b) by both poses, which change as in g2o: (6, 12)."""
    columns = []
    for k in range(12):
        values = []
        for h in (H, -H):
            d = from_mqt(h * np.eye(6)[k % 6])
            values.append(error(times(a, d), b) if k < 6 else error(a, times(b, d)))
        columns.append((values[0] - values[1]) / (2 * H))
    return np.stack(columns, axis=-1)


class Graph:
    """Eight poses on a closed way, measured with loops; vertex 0 is fixed."""

    def __init__(self, seed: int, n: int = 8, loops: int = 4, noise: float = 1.0) -> None:
        rng = np.random.default_rng(seed)
        self.n = n
        truth = []
        for i in range(n):
            q = np.array([0.1, -0.2, np.sin(np.pi * i / n), np.cos(np.pi * i / n)])
            truth.append((np.array([3 * np.cos(2 * np.pi * i / n), 3 * np.sin(2 * np.pi * i / n), 0.1 * i]),
                          q / np.linalg.norm(q)))
        pairs = [(i, i + 1) for i in range(n - 1)] + [(n - 1, 0)]
        pairs += [tuple(rng.choice(n, 2, replace=False)) for _ in range(loops)]
        self.edges = []
        for i, j in pairs:
            A = rng.normal(size=(6, 6)) * [0.02, 0.03, 0.01, 0.004, 0.006, 0.01]
            sigma = A.T @ A + np.diag([1e-4] * 3 + [1e-5] * 3)
            d = noise * rng.multivariate_normal(np.zeros(6), sigma)
            Z = times(times(inverse(truth[i]), truth[j]), from_mqt(d))
            self.edges.append((i, j, Z, np.linalg.inv(sigma)))
        self.poses = [times(truth[i], from_mqt(d)) if i else truth[0]
                      for i, d in enumerate(rng.normal(size=(n, 6)) * 0.01)]

    def moved(self, steps):
        return [times(X, from_mqt(steps[6 * (i - 1):6 * i])) if i else X for i, X in enumerate(self.poses)]

    def spread(self, J, i, j):
        """Derivatives by two poses as those by all that are not fixed."""
        wide = np.zeros((6, 6 * self.n))
        wide[:, 6 * i:6 * i + 6] = J[:, :6]
        wide[:, 6 * j:6 * j + 6] = J[:, 6:]
        return wide[:, 6:]

    def errors(self):
        return np.concatenate([to_mqt(times(inverse(Z), times(inverse(self.poses[i]), self.poses[j])))
                               for i, j, Z, _ in self.edges])

    def jacobian(self):
        return np.concatenate([
            self.spread(difference(lambda a, b, Z=Z: to_mqt(times(inverse(Z), times(inverse(a), b))),
                                   self.poses[i], self.poses[j]), i, j)
            for i, j, Z, _ in self.edges])

    def weight(self):
        W = np.zeros((6 * len(self.edges),) * 2)
        for k, edge in enumerate(self.edges):
            W[6 * k:6 * k + 6, 6 * k:6 * k + 6] = edge[3]
        return W

    def solve(self):
        W = self.weight()
        for _ in range(6):
            J = self.jacobian()
            self.poses = self.moved(-np.linalg.solve(J.T @ W @ J, J.T @ W @ self.errors()))
        J = self.jacobian()
        self.sigma = np.linalg.inv(J.T @ W @ J)  # of g2o's coordinates
        return self

    def relative(self, a, b):
        """The covariance of b in a, of the right perturbation."""
        X_ab = times(inverse(self.poses[a]), self.poses[b])
        J = self.spread(difference(lambda A, B: angle_vector(times(inverse(X_ab), times(inverse(A), B))),
                                   self.poses[a], self.poses[b]), a, b)
        return J @ self.sigma @ J.T

    def text(self, fixed=True) -> str:
        def numbers(values):
            return " ".join(repr(float(value)) for value in values)
        lines = [f"VERTEX_SE3:QUAT {i} {numbers(X[0])} {numbers(X[1])}" for i, X in enumerate(self.poses)]
        lines += ["FIX 0"] if fixed else []
        lines += [f"EDGE_SE3:QUAT {i} {j} {numbers(Z[0])} {numbers(Z[1])} {numbers(W[np.triu_indices(6)])}"
                  for i, j, Z, W in self.edges]
        return "\n".join(lines) + "\n"


def read(tmp_path: pathlib.Path, text: str, **options) -> list[FrameSpec]:
    file = tmp_path / "graph.g2o"
    file.write_text(text)
    return tfdude.read_frames(str(file), **options)


def refused(tmp_path, text) -> str:
    with pytest.raises(tfdude.TransformException) as error:
        read(tmp_path, text)
    return str(error.value).replace(str(tmp_path) + "/", "")


@pytest.mark.parametrize("fixed", [True, False])
def test_relative_uncertainties_are_those_of_the_optimizer(tmp_path, network, fixed):
    graph = Graph(1).solve()
    frames = read(tmp_path, graph.text(fixed), prefix="x")
    assert [frame.id for frame in frames] == [f"x{i}" for i in range(8)]
    assert {frame.parent for frame in frames} == {"xmap"}
    with tfdude.Node("slam", [FrameSpec("xmap"), *frames], network=network) as node:
        for a, b in itertools.permutations(range(8), 2):
            X = node.lookup(f"x{a}", f"x{b}")
            R, t = times(inverse(graph.poses[a]), graph.poses[b])[::-1]
            assert np.allclose(X.translation, t, atol=1e-12)
            assert abs(X.quaternion @ R) == pytest.approx(1, abs=1e-12)
            expected = graph.relative(a, b)
            deviations = np.sqrt(np.diag(expected))
            assert np.allclose(X.covariance / np.outer(deviations, deviations),
                               expected / np.outer(deviations, deviations), atol=1e-5), (a, b)
        # In the map, as marginals; the fixed one is exact.
        X = node.lookup("xmap", "x5")
        assert np.allclose(X.covariance, graph.relative(0, 5), rtol=1e-5, atol=1e-9)
        assert np.array_equal(node.lookup("xmap", "x0").covariance, np.zeros((6, 6)))


def test_a_pose_of_a_graph_can_be_observed_later(tmp_path, network):
    """Each edge has a part of its own, which a measurement corrects."""
    graph = Graph(2).solve()
    frames = read(tmp_path, graph.text())
    with tfdude.Node("slam", [FrameSpec("map"), *frames], network=network) as node:
        X = node.lookup("map", "4")
        before = X.stddev
        node.observe("map", "4", Transform(X.translation, X.quaternion, np.eye(6) * 1e-8))
        after = node.lookup("map", "4").stddev
        assert (after < before).all()


def test_a_unit_of_length_and_names(tmp_path):
    graph = Graph(3).solve()
    metres = {frame.id: frame for frame in read(tmp_path, graph.text())}
    halves = {frame.id: frame for frame in read(tmp_path, graph.text(), unit=0.5, names={"map": "odom"})}
    assert halves["3"].parent == "odom"
    assert np.allclose(halves["3"].X_PC.translation, metres["3"].X_PC.translation / 2)
    D = np.diag([0.5] * 3 + [1] * 3)
    assert np.allclose(halves["3"].X_PC.covariance, D @ metres["3"].X_PC.covariance @ D)
    for source, loading in metres["3"].sources.items():
        assert np.allclose(halves["3"].sources[source], D @ loading)
        assert loading.shape[1] <= 36
    # Two graphs share no errors; one file read twice has the same ones.
    assert set(metres["3"].sources) == set(halves["3"].sources)
    other = read(tmp_path, Graph(4).solve().text())[3]
    assert not set(other.sources) & set(metres["3"].sources)


def test_more_than_six_poses_share_several_sources(tmp_path, network):
    graph = Graph(5, n=15, loops=3).solve()
    frames = read(tmp_path, graph.text())
    assert len(frames[14].sources) == 3
    with tfdude.Node("slam", [FrameSpec("map"), *frames], network=network) as node:
        for a, b in [(1, 14), (7, 8), (13, 2)]:
            expected = graph.relative(a, b)
            deviations = np.sqrt(np.diag(expected))
            assert np.allclose(node.lookup(str(a), str(b)).covariance / np.outer(deviations, deviations),
                               expected / np.outer(deviations, deviations), atol=1e-5)


def test_a_tree_is_written_as_a_graph(tmp_path, network):
    """What g2o makes of it, the dense solve here, has the uncertainties of the tree."""
    rng = np.random.default_rng(6)
    frames = []
    for i, parent in enumerate(["base", "a", "a", "c"]):
        q = rng.normal(size=4)
        A = rng.normal(size=(6, 6)) * 0.01
        frames.append(FrameSpec("acde"[i], parent,
                                Transform(rng.normal(size=3), q / np.linalg.norm(q), A @ A.T + np.eye(6) * 1e-5)))
    text = tfdude.write_frames(frames, "g2o")
    lines = [line.split() for line in text.splitlines()]
    assert [line for line in lines if line[0] == "#"] == [
        ["#", "tfdude", "frame", str(i), name] for i, name in enumerate(["base", "a", "c", "d", "e"])]
    assert ["FIX", "0"] in lines
    graph = Graph.__new__(Graph)
    vertices = [line for line in lines if line[0] == "VERTEX_SE3:QUAT"]
    graph.n = len(vertices)
    graph.poses = [(np.array(line[2:5], float), np.array(line[5:9], float)) for line in vertices]
    graph.edges = []
    for line in lines:
        if line[0] == "EDGE_SE3:QUAT":
            W = np.zeros((6, 6))
            W[np.triu_indices(6)] = np.array(line[10:], float)
            W = W + W.T - np.diag(np.diag(W))
            Z = (np.array(line[3:6], float), np.array(line[6:10], float))
            graph.edges.append((int(line[1]), int(line[2]), Z, W))
    graph.solve()
    back = read(tmp_path, text)
    assert [frame.id for frame in back] == ["base", "a", "c", "d", "e"]
    copies = [FrameSpec("map"), *(FrameSpec(f.id + "2", "map", f.X_PC) for f in back)]
    with (tfdude.Node("tree", [FrameSpec("base"), *frames], network=network) as node,
          tfdude.Node("again", copies, network=network) as again):
        assert eventually(lambda: again.exists("e2"))
        for a, b in itertools.permutations(range(5), 2):
            X = node.lookup(back[a].id, back[b].id)
            assert np.allclose(X.covariance, graph.relative(a, b), rtol=1e-4, atol=1e-9)
            assert np.allclose(again.lookup(back[a].id + "2", back[b].id + "2").matrix, X.matrix, atol=1e-12)


def test_a_written_tree_whose_root_is_named_map_is_read_again(tmp_path, network):
    X = Transform((1, 2, 0), covariance=np.eye(6) * 1e-4)
    file = tmp_path / "map.g2o"
    file.write_text(tfdude.write_frames([FrameSpec("odom", "map", X), FrameSpec("base", "odom", X)], "g2o"))
    for names, root in (({}, "map"), ({"map": "world"}, "world")):
        read = tfdude.read_frames(str(file), names=names)
        assert [(frame.id, frame.parent) for frame in read] == [("odom", root), ("base", root)]
    file.write_text("# frame 0 map\nVERTEX_SE3:QUAT 0 1 0 0 0 0 0 1\n")
    with pytest.raises(tfdude.TransformException, match="below itself"):
        tfdude.read_frames(str(file))


def test_graphs_that_are_no_solution_or_not_determined(tmp_path):
    graph = Graph(7)
    vertex = [line for line in graph.text().splitlines() if line.startswith("VERTEX")]
    assert "is not at the solution: it would move by" in refused(tmp_path, graph.text())
    text = graph.solve().text()
    assert refused(tmp_path, text + "VERTEX_SE3:QUAT 9 0 0 0 0 0 0 1\n") == (
        "graph.g2o:22: vertex 9 is not connected with a fixed one")
    first = text.index("EDGE")
    lone = text[:first] + "\n".join(line for line in text[first:].splitlines() if " 3 " not in line[:20])
    flat = lone + "\nEDGE_SE3:QUAT 2 3 " + " ".join(text.splitlines()[11].split()[3:10]) + " 0" * 21 + "\n"
    assert "vertex 3 is not determined: the information of its edges is singular" in refused(tmp_path, flat)
    # Without edges there are only poses.
    frames = read(tmp_path, "\n".join(vertex))
    assert not frames[1].X_PC.complete and not frames[1].sources
    many = "".join(f"VERTEX_SE3:QUAT {i} {i} 0 0 0 0 0 1\n" for i in range(302))
    information = " ".join(map(str, np.eye(6)[np.triu_indices(6)]))
    many += "".join(f"EDGE_SE3:QUAT {i} {i + 1} 1 0 0 0 0 0 1 {information}\n" for i in range(301))
    assert "covariances are computed for 300 at most" in refused(tmp_path, many)


def test_what_is_wrong_is_named_by_its_line(tmp_path):
    text = Graph(8).solve().text()
    edge = next(line for line in text.splitlines() if line.startswith("EDGE"))
    words = edge.split()
    for broken, why in [
            ("VERTEX_SE2 1 0 0 0\n", "graph.g2o:1: 'VERTEX_SE2' is not known: a graph of VERTEX_SE3:QUAT and "
                                     "EDGE_SE3:QUAT is needed"),
            ("VERTEX_SE3:QUAT 1 0 0 0 0 0 0\n", "graph.g2o:1: is not VERTEX_SE3:QUAT ID x y z qx qy qz qw"),
            ("\nVERTEX_SE3:QUAT 1 0 0 0 0 0 0 2\n",
             "graph.g2o:2: rotation has the norm 2, not that of a unit quaternion"),
            ("VERTEX_SE3:QUAT a 0 0 0 0 0 0 1\n", "graph.g2o:1: 'a' is no number of a vertex"),
            (text + "VERTEX_SE3:QUAT 3 0 0 0 0 0 0 1\n", "graph.g2o:22: vertex 3 is given twice"),
            (text + "FIX 77\n", "graph.g2o:22: there is no vertex 77"),
            (text + " ".join([words[0], "0", "77", *words[3:]]), "graph.g2o:22: there is no vertex 77"),
            (text + " ".join([words[0], "1", "1", *words[3:]]), "graph.g2o:22: an edge from a vertex to itself"),
            (text + " ".join(words[:-1]), "graph.g2o:22: is not EDGE_SE3:QUAT FROM TO x y z qx qy qz qw and 21 numbers "
                                          "of information"),
            (text + " ".join([*words[:10], "-1", *words[11:]]),
             "graph.g2o:22: the information is not positive semi-definite"),
            (text + " ".join([*words[:5], "nan", *words[6:]]), "graph.g2o:22: the pose is not x y z qx qy qz qw")]:
        file = tmp_path / "graph.g2o"
        file.write_text(broken)
        with pytest.raises(tfdude.TransformException) as error:
            tfdude.read_frames(str(file), format="g2o")
        assert str(error.value).replace(str(tmp_path) + "/", "") == why
