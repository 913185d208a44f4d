#!/usr/bin/env python3
"""The server as its clients see it: the protocol of the page, and who is rejected. Needs Debian's
python3-websockets."""

import asyncio
import contextlib
import json
import math
import os
import signal
import socket
import struct
import subprocess
import tempfile
import time
import unittest
import urllib.error
import urllib.request

import rig

try:
    import websockets
except ImportError:
    rig.skip("python3-websockets is missing")

HEADER = struct.Struct("<BBHIqI")


class Page:
    """What a page knows."""

    def __init__(self, socket):
        self.socket = socket
        self.structure = None
        self.values = {}  # id: (stamp or None, translation, quaternion), in the parent
        self.sigmas = {}  # id: "unspecified", "zero", or 21 numbers
        self.last = {}    # op: message
        self.binary = 0
        self.base = 0
        self.bytes = 0

    async def read(self):
        message = await asyncio.wait_for(self.socket.recv(), rig.WAIT)
        self.bytes += len(message)
        if isinstance(message, bytes):
            self.binary += 1
            self.take(message)
            return
        message = json.loads(message)
        self.last[message["op"]] = message
        if message["op"] == "structure":
            self.structure = message

    def take(self, message):
        kind, _, _, version, base, count = HEADER.unpack_from(message)
        if version != self.structure["version"]:
            return  # as the page: it was made just before the structure changed
        self.base = base
        at = HEADER.size
        for _ in range(count):
            (word,) = struct.unpack_from("<I", message, at)
            frame = self.structure["frames"][word & 0x1FFFFFFF][0]
            if kind == 1:
                at = self.take_value(message, at + 4, word, frame, base)
                continue
            at += 4
            if word >> 31:
                self.sigmas[frame] = "unspecified"
            elif word >> 29 & 1:
                self.sigmas[frame] = "zero"
            else:
                self.sigmas[frame] = struct.unpack_from("<21f", message, at)
                at += 84
        assert at == len(message)

    def take_value(self, message, at, word, frame, base):
        layout = struct.Struct("<i3d3h" if word >> 29 & 1 else "<i3f3h")
        stamp, x, y, z, *parts = layout.unpack_from(message, at)
        parts = [part / 32767 / math.sqrt(2) for part in parts]
        parts.insert(word >> 30, math.sqrt(max(0, 1 - sum(part * part for part in parts))))
        self.values[frame] = (None if stamp == -2**31 else base + stamp * 100_000, [x, y, z], parts)
        return at + layout.size

    async def until(self, condition):
        while not condition(self):
            await self.read()

    async def send(self, **request):
        await self.socket.send(json.dumps(request))


def connect(robot, **options):
    options.setdefault("subprotocols", ["tfdude.v1"])
    return websockets.connect(robot.url.replace("http", "ws"), max_size=None, **options)


# From version 14 on, as in Debian 13, the client is another one.
RENEWED = int(websockets.__version__.split(".")[0]) >= 14
REJECTION = websockets.InvalidStatus if RENEWED else websockets.InvalidStatusCode
# What a client takes from the network before it is read.
FEW_BYTES = {"max_queue": 1} if RENEWED else {"max_queue": 1, "read_limit": 1024}


def close(a, b, tolerance):
    """Whether two lists, also of lists, are equal within a tolerance."""
    if isinstance(a, list) or isinstance(a, tuple):
        return len(a) == len(b) and all(close(one, other, tolerance) for one, other in zip(a, b))
    return abs(a - b) <= tolerance


def same_rotation(p, q, tolerance):
    return 1 - abs(sum(a * b for a, b in zip(p, q))) <= tolerance


class Protocol(rig.RigTest):
    def test_connections_that_say_nothing_keep_nobody_out(self):
        address = self.robot.url.split("//")[1].split("/")[0].split(":")
        silent = [socket.create_connection((address[0], int(address[1]))) for _ in range(300)]
        try:
            start = time.monotonic()
            with urllib.request.urlopen(self.robot.url, timeout=rig.WAIT) as reply:
                self.assertEqual(reply.status, 200)
            self.assertLess(time.monotonic() - start, 5)
        finally:
            for one in silent:
                one.close()

    # Once, these locked the page out for 30 s.
    def test_connections_that_do_not_read_keep_nobody_out(self):
        address = self.robot.url.split("//")[1].split("/")[0].split(":")
        deaf = []
        try:
            for _ in range(70):
                one = socket.socket()
                deaf.append(one)
                one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
                one.settimeout(rig.WAIT)
                one.connect((address[0], int(address[1])))
                try:
                    one.sendall(f"GET / HTTP/1.1\r\nHost: {':'.join(address)}\r\n\r\n".encode() * 50)
                except OSError:
                    pass  # it has made room
            start = time.monotonic()
            for _ in range(5):
                with urllib.request.urlopen(self.robot.url, timeout=rig.WAIT) as reply:
                    self.assertEqual(reply.status, 200)
            self.assertLess(time.monotonic() - start, 5)
        finally:
            for one in deaf:
                one.close()

    def test_all_frames_and_their_values(self):
        async def talk():
            async with connect(self.robot) as socket:
                page = Page(socket)
                await page.until(lambda p: p.structure and len(p.values) == 11 and len(p.sigmas) == 11)
                return page
        page = self.run_async(talk())
        frames = page.structure["frames"]
        self.assertEqual(len(frames), 12)
        owners = [one["name"] for one in page.structure["partitions"]]
        self.assertEqual(owners, ["arm", "base"])
        for frame, parent, owner in frames:
            listed = next(one for one in self.robot.ask("frames")["frames"] if one["id"] == frame)
            self.assertEqual(owners[owner], listed["partition"])
            if frame == "world":
                continue
            self.assertEqual(frames[parent][0], listed["parent"])
            answer = self.robot.ask("lookup", listed["parent"], frame)
            _, translation, quaternion = page.values[frame]
            self.assertTrue(close(translation, answer["translation"], 1e-6), frame)
            self.assertTrue(same_rotation(quaternion, answer["rotation"], 1e-8), frame)
            sigma = page.sigmas[frame]
            rows = answer.get("covariance")
            if rows is None:
                self.assertEqual(sigma, "unspecified", frame)
            elif sigma == "zero":
                self.assertTrue(close(rows, [[0] * 6] * 6, 0), frame)
            else:
                upper = [rows[i][j] for i in range(6) for j in range(i, 6)]
                self.assertTrue(all(math.isclose(a, b, rel_tol=1e-6, abs_tol=1e-15) for a, b in zip(sigma, upper)))

    def test_a_pair_is_what_the_command_line_says(self):
        async def ask():
            async with connect(self.robot) as socket:
                page = Page(socket)
                await page.send(op="pair", a="lidar", b="tool0")
                await page.until(lambda p: "translation" in p.last.get("pair", {}))
                return page.last["pair"]
        answer = self.run_async(ask())
        said = self.robot.ask("lookup", "lidar", "tool0")
        for key in ("from", "to", "partitions", "basis"):
            self.assertEqual(answer[key], said[key], key)
        key = "covariance" if said.get("covariance") else "covariance_of_specified"
        for one in ("rotation", "translation", key):
            self.assertTrue(close(answer[one], said[one], 1e-12), one)
        self.assertEqual([one["partition"] for one in answer["path"]], ["base", "arm"])

    def test_why_is_what_the_command_line_says(self):
        async def ask(a, b):
            async with connect(self.robot) as socket:
                page = Page(socket)
                await page.send(op="pair", a=a, b=b)
                await page.until(lambda p: "pair" in p.last)
                await page.send(op="why")
                await page.until(lambda p: "why" in p.last)
                return page.last["why"]
        answer, said = self.run_async(ask("lidar", "tool0")), self.robot.ask("why", "lidar", "tool0")
        for key in ("from", "to", "cause", "is_rotation", "assumed_joints", "unspecified"):
            self.assertEqual(answer[key], said[key], key)
        for kind in ("edges", "joints"):
            self.assertEqual([one["name"] for one in answer[kind]], [one["name"] for one in said[kind]])
        cause = self.run_async(ask("world", "tool"))["cause"]
        self.assertEqual((cause["obstacle"], cause["frame"], cause["similar"][0]), ("unknown_frame", "tool", "tool0"))

    def test_an_impossible_pair_says_why(self):
        async def ask():
            async with connect(self.robot) as socket:
                page = Page(socket)
                await page.send(op="pair", a="world", b="nowhere")
                await page.until(lambda p: "nowhere" in p.last.get("pair", {}).get("error", ""))
                return page.last["pair"]
        self.assertEqual(self.run_async(ask())["to"], "nowhere")

    def test_malformed_messages_close_that_connection_only(self):
        async def talk():
            async with connect(self.robot) as good:
                for bad in ("", "{", "[]", '{"op":"add"}', '{"op":"past","at":-1}', '{"op":"pair","a":"x"}', b"\x01",
                            "[" * 4000, '{"op":"pair","a":"' + "x" * 70000 + '"}'):
                    async with connect(self.robot) as socket:
                        try:
                            await socket.send(bad)
                        except websockets.ConnectionClosed:
                            pass
                        with self.assertRaises(websockets.ConnectionClosed):
                            while True:
                                await asyncio.wait_for(socket.recv(), rig.WAIT)
                page = Page(good)
                await page.send(op="live")
                await page.until(lambda p: p.structure)
        self.run_async(talk())

    def status_of(self, **headers):
        request = urllib.request.Request(self.robot.url, headers=headers)
        try:
            with urllib.request.urlopen(request, timeout=rig.WAIT) as reply:
                return reply.status
        except urllib.error.HTTPError as error:
            return error.code

    def test_strangers_are_rejected(self):
        self.assertEqual(self.status_of(), 200)
        self.assertEqual(self.status_of(Host="robot.example:8765"), 403)
        self.assertEqual(self.status_of(Origin="http://evil.example"), 403)

        async def refused(**options):
            with self.assertRaises(REJECTION) as caught:
                async with connect(self.robot, **options):
                    pass
            return caught.exception.response.status_code if RENEWED else caught.exception.status_code
        self.assertEqual(self.run_async(refused(origin="http://evil.example")), 403)
        self.assertEqual(self.run_async(refused(subprotocols=["other.v1"])), 400)
        self.assertEqual(self.run_async(refused(subprotocols=None)), 400)

    def test_other_paths_do_not_exist(self):
        for path in ("nothing", "../main.cpp", "%2e%2e/main.cpp", "three/three.js"):
            with self.assertRaises(urllib.error.HTTPError) as caught:
                urllib.request.urlopen(self.robot.url + path, timeout=rig.WAIT)
            self.assertEqual(caught.exception.code, 404)


def flat(numbers):
    return [one for row in numbers for one in (flat(row) if isinstance(row, list) else [float(row)])]


class Moving(unittest.TestCase):
    def test_the_past_is_that_of_all_owners_and_a_slow_page_misses_pictures(self):
        with rig.Rig() as robot:
            robot.move()

            async def talk():
                async with connect(robot) as socket, connect(robot, **FEW_BYTES) as slow:
                    page = Page(socket)
                    await page.until(lambda p: p.binary > 60)
                    stamp = page.values["tool0"][0] or page.values["wrist_3_link"][0]
                    await page.send(op="pair", a="world", b="tool0")
                    await page.send(op="past", at=str(stamp))
                    await page.until(lambda p: p.last.get("pair", {}).get("past"))
                    past = page.last["pair"]
                    said = robot.ask("lookup", "world", "tool0", "--at", f"{stamp // 10**9}.{stamp % 10**9:09}")
                    self.assertEqual(str(past["stamp_ns"]), str(said["stamp_ns"]))
                    # One may be read in the memory of the owners, which adds up in another order.
                    for key in ("translation", "rotation", "covariance"):
                        numbers = list(zip(flat(past[key]), flat(said[key]), strict=True))
                        self.assertLess(max(abs(a - b) for a, b in numbers), 1e-12, key)
                    await page.send(op="live")
                    begin = page.binary
                    await page.until(lambda p: p.binary > begin + 60)
                    late = Page(slow)
                    await late.until(lambda p: "wrist_3_link" in p.values
                                     and (p.values["wrist_3_link"][0] or 0) > page.values["wrist_3_link"][0])
            asyncio.run(asyncio.wait_for(talk(), 3 * rig.WAIT))


class Greedy(unittest.TestCase):
    def test_a_page_that_asks_and_does_not_read_takes_little_memory(self):
        with rig.Rig() as robot:

            def memory():
                with open(f"/proc/{robot.web.pid}/status", encoding="ascii") as status:
                    return next(int(line.split()[1]) for line in status if line.startswith("VmRSS:"))

            async def talk():
                async with connect(robot, **FEW_BYTES) as socket:
                    page = Page(socket)
                    await page.until(lambda p: p.binary > 0)
                    before = memory()
                    for i in range(20000):  # of 1.3 kB each
                        await page.send(op="past", at=str(i))
                        if i % 100 == 0:
                            await asyncio.sleep(0)
                    await asyncio.sleep(1)
                    self.assertLess(memory() - before, 8000)
                    # The last wish is fulfilled when the page reads again.
                    await page.until(lambda p: p.base == 19999)
            asyncio.run(asyncio.wait_for(talk(), 3 * rig.WAIT))


class Token(unittest.TestCase):
    def test_others_need_the_token(self):
        with rig.Rig("--bind", "0.0.0.0") as robot:
            address, token = robot.url.split("?token=")
            self.assertEqual(len(token), 32)
            with self.assertRaises(urllib.error.HTTPError) as caught:
                urllib.request.urlopen(address, timeout=rig.WAIT)
            self.assertEqual(caught.exception.code, 401)
            with urllib.request.urlopen(robot.url, timeout=rig.WAIT) as reply:
                cookie = reply.headers["Set-Cookie"].split(";")[0]
            with urllib.request.urlopen(urllib.request.Request(address + "app.js", headers={"Cookie": cookie}),
                                        timeout=rig.WAIT) as reply:
                self.assertEqual(reply.status, 200)


class SlowFile(unittest.TestCase):
    def test_a_pipe_that_says_nothing_does_not_keep_a_server_that_is_to_end(self):
        with tempfile.TemporaryDirectory() as folder:
            pipe = os.path.join(folder, "robot.urdf")
            os.mkfifo(pipe)
            server = subprocess.Popen([rig.BIN / "tfdude-web", "--port", "0", "--urdf", pipe],
                                      stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            try:
                writer = rig.eventually(lambda: self.writer_of(pipe), "a server that reads")
                server.terminate()
                self.assertEqual(server.wait(timeout=rig.WAIT), -signal.SIGTERM)
                os.close(writer)
            finally:
                server.kill()
                server.wait()

    def writer_of(self, pipe):
        """None: nobody reads it yet."""
        with contextlib.suppress(OSError):
            return os.open(pipe, os.O_WRONLY | os.O_NONBLOCK)
        return None


if __name__ == "__main__":
    unittest.main()
