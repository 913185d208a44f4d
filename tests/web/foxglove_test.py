#!/usr/bin/env python3
"""Foxglove's WebSocket protocol, as its specification describes it. Needs Debian's python3-websockets."""

import asyncio
import json
import math
import struct
import unittest

import rig

try:
    import websockets
except ImportError:
    rig.skip("python3-websockets is missing")


class Viewer:
    """A client that knows the specification."""

    def __init__(self, socket):
        self.socket = socket
        self.channels = {}       # topic: channel
        self.info = None
        self.warnings = []
        self.data = []           # (subscription, time, payload)

    async def read(self):
        message = await asyncio.wait_for(self.socket.recv(), rig.WAIT)
        if isinstance(message, bytes):
            op, subscription, time = struct.unpack_from("<BIQ", message)
            assert op == 1
            self.data.append((subscription, time, message[13:]))
            return
        message = json.loads(message)
        if message["op"] == "serverInfo":
            self.info = message
        elif message["op"] == "advertise":
            self.channels.update({one["topic"]: one for one in message["channels"]})
        elif message["op"] == "unadvertise":
            self.channels = {topic: one for topic, one in self.channels.items()
                             if one["id"] not in message["channelIds"]}
        elif message["op"] == "status":
            self.warnings.append(message["message"])

    async def until(self, condition):
        while not condition():
            await self.read()

    async def subscribe(self, subscription, topic):
        await self.until(lambda: topic in self.channels)
        await self.send(op="subscribe", subscriptions=[{"id": subscription, "channelId": self.channels[topic]["id"]}])

    async def next(self, subscription):
        self.data = [one for one in self.data if one[0] != subscription]
        await self.until(lambda: any(one[0] == subscription for one in self.data))
        return next(payload for one, _, payload in self.data if one == subscription)

    async def send(self, **message):
        await self.socket.send(json.dumps(message))


class Cdr:
    """Reads CDR, little-endian."""

    def __init__(self, data):
        assert data[:4] == b"\0\1\0\0"
        self.data, self.at = data[4:], 0

    def read(self, kind):
        size = struct.calcsize(kind)
        self.at += -self.at % size
        (value,) = struct.unpack_from("<" + kind, self.data, self.at)
        self.at += size
        return value

    def text(self):
        length = self.read("I")
        text = self.data[self.at:self.at + length - 1].decode()
        self.at += length
        return text


def transforms_in(payload):
    cdr = Cdr(payload)
    found = {}
    for _ in range(cdr.read("I")):
        stamp = cdr.read("i") * 10**9 + cdr.read("I")
        parent, child = cdr.text(), cdr.text()
        found[child] = (parent, stamp, [cdr.read("d") for _ in range(3)], [cdr.read("d") for _ in range(4)])
    assert cdr.at == len(cdr.data)
    return found


def connect(robot, protocol="foxglove.websocket.v1"):
    return websockets.connect(robot.url.replace("http", "ws"), max_size=None, subprotocols=[protocol])


class Foxglove(rig.RigTest):
    def assert_pose(self, frame, translation, rotation, parent):
        said = self.robot.ask("lookup", parent, frame)
        for one, other in zip(translation, said["translation"]):
            self.assertAlmostEqual(one, other, delta=1e-12)
        self.assertAlmostEqual(abs(sum(a * b for a, b in zip(rotation, said["rotation"]))), 1, delta=1e-12)

    def test_both_names_of_the_protocol(self):
        async def talk(protocol):
            async with connect(self.robot, protocol) as socket:
                viewer = Viewer(socket)
                await viewer.until(lambda: viewer.info and viewer.channels)
                return socket.subprotocol, viewer
        for protocol in ("foxglove.sdk.v1", "foxglove.websocket.v1"):
            chosen, viewer = self.run_async(talk(protocol))
            self.assertEqual(chosen, protocol)
            self.assertEqual(viewer.info["capabilities"], [])
            self.assertEqual({topic: one["schemaName"] for topic, one in viewer.channels.items()},
                             {"transforms": "foxglove.FrameTransforms", "/tf": "tf2_msgs/msg/TFMessage",
                              "uncertainty": "foxglove.SceneUpdate", "events": "foxglove.Log"})
            for one in viewer.channels.values():
                if one["schemaEncoding"] == "jsonschema":
                    self.assertEqual(json.loads(one["schema"])["title"], one["schemaName"])

    def test_transforms_as_json_and_as_cdr(self):
        async def talk():
            async with connect(self.robot) as socket:
                viewer = Viewer(socket)
                await viewer.subscribe(7, "transforms")
                await viewer.subscribe(9, "/tf")
                await viewer.until(lambda: {one[0] for one in viewer.data} == {7, 9})
                return [next(data for one, _, data in viewer.data if one == wanted) for wanted in (7, 9)]
        as_json, as_cdr = self.run_async(talk())
        transforms = json.loads(as_json)["transforms"]
        self.assertEqual(len(transforms), 11)
        for one in transforms:
            self.assert_pose(one["child_frame_id"], [one["translation"][k] for k in "xyz"],
                             [one["rotation"][k] for k in "xyzw"], one["parent_frame_id"])
        found = transforms_in(as_cdr)
        self.assertEqual(len(found), 11)
        for child, (parent, _, translation, rotation) in found.items():
            self.assert_pose(child, translation, rotation, parent)

    def test_ellipsoids_have_the_axes_of_the_covariance(self):
        async def talk():
            async with connect(self.robot) as socket:
                viewer = Viewer(socket)
                await viewer.subscribe(1, "uncertainty")
                while True:
                    for one in json.loads(await viewer.next(1))["entities"]:
                        if one["id"] == "tool0":
                            return one
        entity = self.run_async(talk())
        self.assertEqual(entity["frame_id"], "world")
        said = self.robot.ask("lookup", "world", "tool0")
        rows = said.get("covariance") or said["covariance_of_specified"]
        sphere = entity["spheres"][0]
        # The sum of the squared semi-axes is k² times the trace of the covariance of position.
        squares = sum((sphere["size"][k] / 2) ** 2 for k in "xyz")
        self.assertAlmostEqual(squares, 9 * sum(rows[i][i] for i in range(3)), delta=1e-6 * squares + 1e-11)
        turn = [sphere["pose"]["orientation"][k] for k in "xyzw"]
        self.assertAlmostEqual(math.sqrt(sum(a * a for a in turn)), 1, delta=1e-12)

    def test_unsubscribed_channels_are_silent_and_wishes_that_cannot_be_met_are_named(self):
        async def talk():
            async with connect(self.robot) as socket:
                viewer = Viewer(socket)
                await viewer.subscribe(1, "uncertainty")
                await viewer.next(1)
                await viewer.subscribe(3, "uncertainty")
                await viewer.until(lambda: viewer.warnings)
                await viewer.send(op="unsubscribe", subscriptionIds=[1])
                await viewer.send(op="unsubscribe", subscriptionIds=[1])
                await viewer.until(lambda: len(viewer.warnings) == 2)
                viewer.data.clear()
                await viewer.send(op="subscribe", subscriptions=[{"id": 2, "channelId": 999}])
                await viewer.send(op="getParameters", parameterNames=[])
                await viewer.send(op="subscribeConnectionGraph")
                await socket.send(struct.pack("<BI", 1, 5) + b"data")
                await viewer.until(lambda: len(viewer.warnings) == 6)
                await asyncio.sleep(0.5)
                return viewer
        viewer = self.run_async(talk())
        self.assertEqual(viewer.data, [])
        self.assertIn("has a subscription already", viewer.warnings[0])
        self.assertIn("999", viewer.warnings[2])

    def test_a_client_that_lies_about_lengths_is_closed_and_others_are_not(self):
        async def talk():
            async with connect(self.robot) as good:
                viewer = Viewer(good)
                for bad in (b"", b"\x01\x00", struct.pack("<BIII", 2, 1, 1, 2**32 - 1),
                            struct.pack("<BIII", 2, 1, 1, 1),
                            struct.pack("<BBfBQI", 3, 0, 1.0, 0, 0, 9) + b"12345678", b"\x09", "[1]", "{", '{"op":1}',
                            '{"op":"subscribe"}', '{"op":"subscribe","subscriptions":[1]}',
                            '{"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]}',
                            '{"op":"unsubscribe","subscriptionIds":[4294967296]}'):
                    async with connect(self.robot) as socket:
                        await socket.send(bad)
                        with self.assertRaises(websockets.ConnectionClosed):
                            while True:
                                await asyncio.wait_for(socket.recv(), rig.WAIT)
                await viewer.subscribe(1, "uncertainty")
                await viewer.next(1)
        self.run_async(talk())

    def test_events_are_a_log(self):
        async def talk():
            async with connect(self.robot) as socket:
                viewer = Viewer(socket)
                await viewer.subscribe(4, "events")
                guest = self.robot.start("tfduded", "--partition", "guest", "--no-state", ready="ready")
                guest.kill()
                lines = []
                while not any("guest" in line["message"] and line["level"] == 3 for line in lines):
                    lines.append(json.loads(await viewer.next(4)))
                return lines
        lines = self.run_async(talk())
        self.assertIn(2, [line["level"] for line in lines if "guest" in line["message"]])
        self.assertTrue(all(line["timestamp"]["sec"] > 0 for line in lines))

    def test_a_pair_of_a_page_is_a_channel(self):
        async def talk():
            page = websockets.connect(self.robot.url.replace("http", "ws"), subprotocols=["tfdude.v1"])
            async with connect(self.robot) as socket:
                viewer = Viewer(socket)
                async with page as shown:
                    await shown.send(json.dumps({"op": "pair", "a": "world", "b": "tool0"}))
                    await viewer.subscribe(3, "pairs/world/tool0")
                    answer = json.loads(await viewer.next(3))
                await viewer.until(lambda: "pairs/world/tool0" not in viewer.channels)
                return answer
        self.assertEqual(self.run_async(talk())["to"], "tool0")


if __name__ == "__main__":
    unittest.main()
