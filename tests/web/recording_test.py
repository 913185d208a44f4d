#!/usr/bin/env python3
"""A recording that a page sends: who gets it, what is rejected, and what is left when a page or the server ends. Needs
Debian's python3-websockets."""

import asyncio
import contextlib
import ctypes
import json
import os
import pathlib
import struct
import tempfile
import time
import unittest

import rig

try:
    import websockets
except ImportError:
    rig.skip("python3-websockets is missing")

from protocol_test import Page, connect, flat  # noqa: E402

PIECE, AHEAD, MOST_AT_ONCE = 65536, 8, 4


def bomb():
    """1500 chunks of ROS, each of 60 MiB of nothing in 2 kB: a minute of work. None: no compressor."""
    try:
        library = ctypes.CDLL("libzstd.so.1")
    except OSError:
        return None
    library.ZSTD_compress.restype = ctypes.c_size_t

    def text(value):
        return struct.pack("<I", len(value)) + value

    def record(op, body):
        return struct.pack("<BQ", op, len(body)) + body

    schema = struct.pack("<H", 1) + text(b"tf2_msgs/msg/TFMessage") + text(b"ros2msg") + text(b"...")
    channel = struct.pack("<HH", 1, 1) + text(b"/tf") + text(b"cdr") + text(b"")
    # One transform, of a to b at 10 s, so that the file is one of ROS.
    transform = (b"\0\1\0\0" + struct.pack("<III", 1, 10, 0) + struct.pack("<I2s2xI2s2x", 2, b"a\0", 2, b"b\0")
                 + bytes(4) + struct.pack("<7d", 1, 0, 0, 0, 0, 0, 1))
    stamp = struct.pack("<HIQQ", 1, 0, 10**10, 10**10)
    raw = record(3, schema) + record(4, channel) + record(5, stamp + transform) + record(5, stamp + bytes(60 << 20))
    packed = ctypes.create_string_buffer(1 << 20)
    size = library.ZSTD_compress(packed, ctypes.c_size_t(len(packed)), raw, ctypes.c_size_t(len(raw)), 1)
    chunk = (struct.pack("<QQQI", 10**10, 10**10, len(raw), 0) + text(b"zstd") + struct.pack("<Q", size)
             + packed.raw[:size])
    return b"\x89MCAP0\r\n" + record(1, text(b"ros2") + text(b"bomb")) + 1500 * record(6, chunk)


class Sender(Page):
    """A page that can send a file."""

    async def answer(self, *ops):
        """The next message of one of these kinds."""
        for op in ops:
            self.last.pop(op, None)
        await self.until(lambda p: any(op in p.last for op in ops))
        return next(self.last[op] for op in ops if op in self.last)

    async def begin(self, size):
        """Asks again until another file may come."""
        while True:
            said = await self.begin_once(size)
            if "wait a second" not in said.get("error", ""):
                return said
            await asyncio.sleep(0.1)

    async def begin_once(self, size):
        await self.send(op="upload", bytes=size)
        return await self.answer("upload", "recording")

    async def drop(self, content):
        """@return what the server says of it"""
        said = await self.begin(len(content))
        sent = 0
        while said["op"] == "upload":
            while sent < len(content) and sent - said["written"] < AHEAD * PIECE:
                await self.socket.send(content[sent:sent + PIECE])
                sent += PIECE
            said = await self.answer("upload", "recording")
        return said

    async def show(self, at):
        # So that the next messages are those of this instant.
        self.base = None
        await self.send(op="past", at=str(at))
        await self.until(lambda p: p.base == at)


def children(pid):
    """The processes of the server that read recordings."""
    tasks = pathlib.Path(f"/proc/{pid}/task").glob("*/children")
    return [int(one) for task in tasks for one in task.read_text(encoding="ascii").split()]


def open_files(pid, folder):
    """The files in a folder that a process has open, also those without a name: their descriptors."""
    found = []
    for one in pathlib.Path(f"/proc/{pid}/fd").iterdir():
        with contextlib.suppress(OSError):
            if os.readlink(one).startswith(str(folder)):
                found.append(one)
    return found


class Recorded(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.stack = contextlib.ExitStack()
        cls.folder = pathlib.Path(cls.stack.enter_context(tempfile.TemporaryDirectory()))
        cls.temporary = cls.folder / "temporary"
        cls.temporary.mkdir()
        os.environ["TMPDIR"] = str(cls.temporary)
        cls.stack.callback(os.environ.pop, "TMPDIR")
        cls.robot = cls.stack.enter_context(rig.Rig("--max-recording", "8"))
        cls.file = cls.folder / "robot.mcap"
        cls.robot.move()
        cls.robot.ask("add", "only_then", "--parent", "world", "--xyz", "1", "2", "3")
        cls.robot.record(cls.file, 3.5)
        cls.robot.ask("remove", "only_then")
        cls.content = cls.file.read_bytes()

    @classmethod
    def tearDownClass(cls):
        cls.stack.close()

    def run_async(self, coroutine):
        return asyncio.run(asyncio.wait_for(coroutine, 3 * rig.WAIT))

    def assert_nothing_is_left(self):
        rig.eventually(lambda: not children(self.robot.web.pid), "no reader")
        rig.eventually(lambda: not open_files(self.robot.web.pid, self.temporary), "no file")
        self.assertEqual(list(self.temporary.iterdir()), [])

    def test_a_page_sees_its_recording_and_others_the_robot(self):
        async def talk():
            async with connect(self.robot) as one, connect(self.robot) as two:
                page, other = Sender(one), Page(two)
                await page.send(op="pair", a="world", b="tool0")
                await other.send(op="pair", a="world", b="tool0")
                await page.until(lambda p: "pair" in p.last and p.structure)
                self.assertNotIn("only_then", [frame[0] for frame in page.structure["frames"]])
                said = await page.drop(self.content)
                self.assertNotIn("error", said)
                self.assertTrue(said["finished"] and not said["foreign"] and not said["problems"], said)
                start, end = int(said["start"]), int(said["end"])
                self.assertGreater(end - start, 3 * 10**9)
                self.look_at_files()
                for at in (end, start + (end - start) // 2, end - (end - start) // 4):
                    page.last.pop("pair", None)
                    page.values.clear()
                    await page.show(at)
                    await page.until(lambda p: "pair" in p.last)
                    self.assertIn("only_then", page.values)
                    self.assert_as_the_command_line(page, at)
                # The other one saw none of it, and goes on.
                begin = other.binary
                await other.until(lambda p: p.binary > begin + 30 and p.structure)
                self.assertNotIn("only_then", [frame[0] for frame in other.structure["frames"]])
                self.assertNotIn("recording", other.last)
                self.assertFalse(other.last["pair"]["past"])
                self.assertGreater(other.base, end)
                # And back, with the pair that was chosen.
                await page.send(op="robot")
                await page.answer("robot")
                self.assertFalse((await page.answer("pair"))["past"])
                begin = page.binary
                await page.until(lambda p: p.binary > begin + 5)
                self.assertNotIn("only_then", [frame[0] for frame in page.structure["frames"]])
                self.assertGreater(page.base, end)
                self.assert_nothing_is_left()
        self.run_async(talk())

    def look_at_files(self):
        (file,) = open_files(self.robot.web.pid, self.temporary)
        status = file.stat()
        self.assertEqual((status.st_mode & 0o777, status.st_nlink, status.st_size), (0o600, 0, len(self.content)))
        self.assertEqual(list(self.temporary.iterdir()), [])
        (reader,) = children(self.robot.web.pid)
        limits = pathlib.Path(f"/proc/{reader}/limits").read_text(encoding="ascii")
        self.assertIn(str(1536 << 20), limits)

    def assert_as_the_command_line(self, page, at):
        """As of what was known then: its newest common stamp."""
        pair = page.last["pair"]
        stamp = int(pair["stamp_ns"])
        self.assertLessEqual(stamp, at)
        said = self.robot.ask("lookup", "world", "tool0", "--recording", self.file, "--at",
                              f"{stamp // 10**9}.{stamp % 10**9:09}", "--believed-at", f"{at // 10**9}.{at % 10**9:09}")
        self.assertEqual(int(said["stamp_ns"]), stamp)
        for key in ("translation", "rotation", "covariance"):
            if said[key] is None:
                self.assertIsNone(pair[key])
                continue
            numbers = zip(flat(pair[key]), flat(said[key]), strict=True)
            self.assertLess(max(abs(a - b) for a, b in numbers), 1e-12, key)

    def test_what_is_no_recording_is_rejected_and_nothing_changes(self):
        bad = [b"{}" * 100, b"\x89MCAP0\r\n", b"\x89MCAP0\r\n" + bytes(1000), b"\x89MCAP0\r\n" + b"\xff" * 200000,
               self.content[:9], b"#ROSBAG V2.0\n" + bytes(100000)]

        async def talk():
            async with connect(self.robot) as socket:
                page = Sender(socket)
                for content in bad:
                    said = await page.drop(content)
                    self.assertIn("error", said, content[:20])
                    self.assertNotIn("/proc", said["error"])
                    self.assertTrue(said["error"])
                # While a recording is shown, it stays.
                shown = await page.drop(self.content)
                self.assertNotIn("error", shown)
                self.assertIn("error", await page.drop(bad[2]))
                await page.show(int(shown["end"]))
                self.assertNotIn("robot", page.last)
                await page.send(op="robot")
                await page.answer("robot")
                begin = page.binary
                await page.until(lambda p: p.binary > begin + 5)
        self.run_async(talk())
        self.assert_nothing_is_left()

    def test_a_file_that_is_too_large_or_empty_is_rejected_before_it_is_sent(self):
        async def talk():
            async with connect(self.robot) as socket:
                page = Sender(socket)
                for size, why in ((10 << 30, "10240 MiB, and this server takes 8 MiB"), (0, "empty"),
                                  (2**63, "takes 8 MiB")):
                    said = await page.begin(size)
                    self.assertIn(why, said.get("error", ""))
        self.run_async(talk())
        self.assert_nothing_is_left()

    def test_another_file_at_once_has_to_wait(self):
        async def talk():
            async with connect(self.robot) as socket:
                page = Sender(socket)
                await page.begin_once(0)
                self.assertIn("wait a second", (await page.begin_once(100))["error"])
        self.run_async(talk())

    def test_pieces_that_do_not_fit_close_the_connection(self):
        async def talk():
            for pieces in ([b"x"], [bytes(PIECE + 1)], [self.content[:PIECE]] * (AHEAD + 40)):
                async with connect(self.robot) as socket:
                    page = Sender(socket)
                    said = await page.begin(2 * PIECE if len(pieces) == 1 else (AHEAD + 10) * PIECE)
                    self.assertEqual(said["written"], 0)
                    with self.assertRaises(websockets.ConnectionClosed):
                        for piece in pieces:
                            await socket.send(piece)
                        while True:
                            await asyncio.wait_for(socket.recv(), rig.WAIT)
            for extra in (json.dumps({"op": "upload", "bytes": 5}), b""):
                async with connect(self.robot) as socket:
                    page = Sender(socket)
                    await page.begin(2 * PIECE)
                    await socket.send(extra)
                    with self.assertRaises(websockets.ConnectionClosed):
                        while True:
                            await asyncio.wait_for(socket.recv(), rig.WAIT)
        self.run_async(talk())
        self.assert_nothing_is_left()

    def test_a_page_that_vanishes_midway_leaves_nothing(self):
        async def talk():
            async with connect(self.robot) as socket:
                page = Sender(socket)
                await page.begin(4 * PIECE)
                await socket.send(self.content[:PIECE])
                await page.answer("upload")
                self.assertEqual(len(open_files(self.robot.web.pid, self.temporary)), 1)
                socket.transport.abort()
            async with connect(self.robot) as socket:
                page = Sender(socket)
                self.assertNotIn("error", await page.drop(self.content))
                socket.transport.abort()
        self.run_async(talk())
        self.assert_nothing_is_left()

    def test_work_without_end_ends_with_its_page_and_delays_nobody(self):
        content = bomb()
        if content is None:
            self.skipTest("libzstd is missing")

        async def talk():
            async with connect(self.robot) as socket, connect(self.robot) as other:
                page, watcher = Sender(socket), Page(other)
                dropping = asyncio.ensure_future(page.drop(content))
                begin = watcher.binary
                await watcher.until(lambda p: p.binary > begin + 60)
                self.assertFalse(dropping.done())  # it still works
                self.assertEqual(len(children(self.robot.web.pid)), 1)
                dropping.cancel()
                socket.transport.abort()
        self.run_async(talk())
        begin = time.monotonic()
        self.assert_nothing_is_left()
        self.assertLess(time.monotonic() - begin, 10)

    def test_a_file_that_stalls_is_given_up(self):
        async def talk():
            async with connect(self.robot) as socket:
                page = Sender(socket)
                begin = time.monotonic()
                await page.begin(4 * PIECE)
                await socket.send(self.content[:PIECE])
                await page.until(lambda p: "recording" in p.last)
                self.assertIn("too slowly", page.last["recording"]["error"])
                self.assertGreater(time.monotonic() - begin, 9)
                # What was on its way does no harm, and another file is taken.
                await socket.send(bytes(PIECE))
                self.assertNotIn("error", await page.drop(self.content))
        self.run_async(talk())
        self.assert_nothing_is_left()

    def test_many_pages_share_few_places_and_nobody_else_waits(self):
        async def talk():
            pages = [Sender(await connect(self.robot)) for _ in range(50)]
            try:
                await self.drop_on(pages)
            finally:
                for page in pages:  # they have not read all that came, and would wait for it
                    page.socket.transport.abort()
        self.run_async(talk())
        self.assert_nothing_is_left()

    async def drop_on(self, pages):
        async with connect(self.robot) as socket:
            watcher = Page(socket)
            dropping = asyncio.gather(*[page.drop(self.content) for page in pages])
            begin = watcher.binary
            await watcher.until(lambda p: p.binary > begin + 30)
            said = await dropping
        shown = [page for page, one in zip(pages, said) if "error" not in one]
        self.assertEqual(len(shown), MOST_AT_ONCE)
        self.assertTrue(all("which is all" in one["error"] for one in said if "error" in one))
        self.assertEqual(len(children(self.robot.web.pid)), MOST_AT_ONCE)
        # A place that gets free can be had.
        await shown[0].send(op="robot")
        await shown[0].answer("robot")
        other = next(page for page in pages if page not in shown)
        said = await other.drop(self.content)
        while "which is all" in said.get("error", ""):
            said = await other.drop(self.content)
        self.assertNotIn("error", said)

    def test_the_reader_ends_with_the_server(self):
        async def talk(robot):
            async with connect(robot) as socket:
                page = Sender(socket)
                self.assertNotIn("error", await page.drop(self.content))
                (reader,) = children(robot.web.pid)
                robot.web.kill()
                return reader
        with rig.Rig() as robot:
            reader = self.run_async(talk(robot))
            rig.eventually(lambda: not os.path.exists(f"/proc/{reader}"), "the end of the reader")
        self.assertEqual(list(self.temporary.iterdir()), [])

    def test_a_server_may_take_none(self):
        async def talk(robot):
            async with connect(robot) as socket:
                return await Sender(socket).drop(self.content)
        with rig.Rig("--max-recording", "0") as robot:
            self.assertIn("takes no recordings", self.run_async(talk(robot))["error"])


if __name__ == "__main__":
    unittest.main()
