#!/usr/bin/env python3
"""Checks an MCAP file against its specification, independently of the library: mcap_check.py FILE.

Prints a JSON object with the messages of each topic; --messages also prints them in hex. --torn accepts a file whose
writer was interrupted. Exit status 1: a rule of https://mcap.dev/spec is broken.
"""

import argparse
import json
import struct
import subprocess
import sys
import zlib

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = range(1, 9)
STATISTICS, METADATA, METADATA_INDEX, SUMMARY_OFFSET, DATA_END = range(0x0B, 0x10)


class Bad(Exception):
    pass


def demand(holds, what):
    if not holds:
        raise Bad(what)


class Body:
    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, count):
        demand(self.at + count <= len(self.data), "a field reaches beyond its record")
        self.at += count
        return self.data[self.at - count:self.at]

    def number(self, layout):
        return struct.unpack("<" + layout, self.take(struct.calcsize("<" + layout)))[0]

    def blob(self):
        return self.take(self.number("I"))

    def text(self):
        return self.blob().decode("utf-8")

    def pairs(self, read_key, read_value):
        inner, found = Body(self.blob()), []
        while inner.at < len(inner.data):
            key = read_key(inner)
            found.append((key, read_value(inner)))
        return found

    def done(self):
        demand(self.at == len(self.data), "a record is longer than its fields")


def u16(body):
    return body.number("H")


def u64(body):
    return body.number("Q")


def unpacked(data):
    done = subprocess.run(["zstd", "-dcq"], input=data, stdout=subprocess.PIPE, check=False)
    demand(done.returncode == 0, "zstd")
    return done.stdout


def records(data, begin, end):
    at = begin
    while at < end:
        demand(at + 9 <= end, f"a record's head at {at} is cut")
        op, length = data[at], struct.unpack_from("<Q", data, at + 1)[0]
        demand(at + 9 + length <= end, f"record {op} at {at} is cut")
        yield at, op, Body(data[at + 9:at + 9 + length])
        at += 9 + length


class File:
    def __init__(self, data):
        self.data = data
        self.schemas, self.channels, self.metadata = {}, {}, []
        self.messages = []  # (channel, sequence, log, publish, data)
        self.chunks = {}    # by their offset: what the indices must say
        self.sequences = {}
        self.torn = None

    def schema(self, body):
        number, name, encoding, text = u16(body), body.text(), body.text(), body.blob()
        body.done()
        demand(number != 0, "a schema's id is zero")
        demand(self.schemas.setdefault(number, (name, encoding, text)) == (name, encoding, text), "two schemas, one id")

    def channel(self, body):
        number, schema, topic, encoding = u16(body), u16(body), body.text(), body.text()
        metadata = dict(body.pairs(Body.text, Body.text))
        body.done()
        demand(schema == 0 or schema in self.schemas, f"channel {topic} has no schema")
        value = (schema, topic, encoding, metadata)
        demand(self.channels.setdefault(number, value) == value, "two channels, one id")

    def message(self, body):
        channel, sequence, log, publish = u16(body), body.number("I"), u64(body), u64(body)
        demand(channel in self.channels, "a message before its channel")
        demand(sequence == self.sequences.get(channel, 0), "a sequence number is left out")
        self.sequences[channel] = sequence + 1
        self.messages.append((channel, sequence, log, publish, body.data[body.at:]))
        return channel, log

    def chunk(self, at, end, body):
        start, last, raw_size, crc, compression = u64(body), u64(body), u64(body), body.number("I"), body.text()
        packed = body.take(u64(body))
        body.done()
        demand(compression in ("", "zstd"), f"compression {compression}")
        raw = unpacked(packed) if compression else packed
        demand(len(raw) == raw_size, "a chunk's size")
        demand(crc != 0 and zlib.crc32(raw) == crc, "a chunk's CRC")
        index, times = {}, []
        for offset, op, inner in records(raw, 0, len(raw)):
            demand(op == MESSAGE, f"record {op} in a chunk")
            channel, log = self.message(inner)
            index.setdefault(channel, []).append((log, offset))
            times.append(log)
        demand(times and min(times) == start and max(times) == last, "a chunk's times")
        self.chunks[at] = {"end": end, "start": start, "last": last, "index": index, "found": {}, "indices_end": end,
                           "compression": compression, "packed": len(packed), "raw": raw_size}

    def message_index(self, at, end, body):
        demand(self.chunks, "an index before all chunks")
        chunk = self.chunks[max(self.chunks)]
        demand(chunk["indices_end"] == at, "an index is not after its chunk")
        channel = u16(body)
        demand(body.pairs(u64, u64) == chunk["index"].get(channel), "a message index differs from its chunk")
        chunk["found"][channel] = at
        chunk["indices_end"] = end

    def read_data(self):
        demand(self.data[:8] == MAGIC, "the magic")
        for at, op, body in records(self.data, 8, len(self.data)):
            end = at + 9 + len(body.data)
            demand((op == HEADER) == (at == 8), "the header's place")
            if op == HEADER:
                self.profile, self.library = body.text(), body.text()
            elif op == SCHEMA:
                self.schema(body)
            elif op == CHANNEL:
                self.channel(body)
            elif op == METADATA:
                self.metadata.append((body.text(), dict(body.pairs(Body.text, Body.text)), at, end - at))
            elif op == CHUNK:
                self.chunk(at, end, body)
            elif op == MESSAGE_INDEX:
                self.message_index(at, end, body)
            elif op == DATA_END:
                demand(body.number("I") == zlib.crc32(self.data[:at]), "the data's CRC")
                return end
            else:
                raise Bad(f"record {op} among the data")
        raise Bad("no end of the data")

    def read_summary(self, begin):
        demand(self.data[-8:] == MAGIC, "the magic at the end")
        footer = len(self.data) - 8 - 29
        demand(self.data[footer] == FOOTER, "the footer")
        summary, offsets, crc = struct.unpack_from("<QQI", self.data, footer + 9)
        demand(summary == begin, "the summary's place")
        demand(crc == zlib.crc32(self.data[summary:footer + 9 + 16]), "the summary's CRC")
        groups, indexed = {}, set()
        for at, op, body in records(self.data, summary, offsets):
            end = at + 9 + len(body.data)
            group = groups.setdefault(op, [at, at])
            demand(group[1] == at, "the summary is not grouped")
            group[1] = end
            if op == SCHEMA:
                self.schema(body)
            elif op == CHANNEL:
                self.channel(body)
            elif op == STATISTICS:
                self.statistics(body)
            elif op == CHUNK_INDEX:
                indexed.add(self.chunk_index(body))
            elif op == METADATA_INDEX:
                place = (u64(body), u64(body), body.text())
                demand(place in [(m[2], m[3], m[0]) for m in self.metadata], "a metadata index")
            else:
                raise Bad(f"record {op} in the summary")
        demand(indexed == set(self.chunks), "a chunk without an index")
        found = {}
        for _, op, body in records(self.data, offsets, footer):
            demand(op == SUMMARY_OFFSET, "a summary offset")
            kind, start, length = body.number("B"), u64(body), u64(body)
            found[kind] = [start, start + length]
        demand(found == groups, "the summary offsets")

    def statistics(self, body):
        counts = {}
        for message in self.messages:
            counts[message[0]] = counts.get(message[0], 0) + 1
        demand(u64(body) == len(self.messages), "the number of messages")
        demand(u16(body) == len(self.schemas), "the number of schemas")
        demand([body.number("I") for _ in range(4)] == [len(self.channels), 0, len(self.metadata), len(self.chunks)],
               "the numbers of channels, metadata and chunks")
        times = [message[2] for message in self.messages] or [0]
        demand([u64(body), u64(body)] == [min(times), max(times)], "the times of all messages")
        demand(dict(body.pairs(u16, u64)) == counts, "the messages of each channel")

    def chunk_index(self, body):
        start, last, at, length = u64(body), u64(body), u64(body), u64(body)
        demand(at in self.chunks, "an index of no chunk")
        chunk = self.chunks[at]
        demand((start, last, length) == (chunk["start"], chunk["last"], chunk["end"] - at), "a chunk index")
        demand(dict(body.pairs(u16, u64)) == chunk["found"], "the message indices of a chunk")
        demand(set(chunk["found"]) == set(chunk["index"]), "a channel without an index")
        demand(u64(body) == chunk["indices_end"] - chunk["end"], "the length of the message indices")
        demand((body.text(), u64(body), u64(body)) == (chunk["compression"], chunk["packed"], chunk["raw"]),
               "the sizes of a chunk")
        body.done()
        return at


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file")
    parser.add_argument("--torn", action="store_true", help="the writer may have been interrupted")
    parser.add_argument("--messages", action="store_true", help="print all messages")
    arguments = parser.parse_args()
    with open(arguments.file, "rb") as stream:
        file = File(stream.read())
    try:
        file.read_summary(file.read_data())
    except Bad as bad:
        file.torn = str(bad)
        if not arguments.torn:
            print(f"mcap_check: {arguments.file}: {bad}", file=sys.stderr)
            return 1
    topics = {}
    for channel, _, log, publish, data in file.messages:
        schema, topic, encoding, metadata = file.channels[channel]
        entry = topics.setdefault(topic, {"schema": file.schemas[schema][0], "schema_encoding": file.schemas[schema][1],
                                          "encoding": encoding, "metadata": metadata, "count": 0, "messages": []})
        entry["count"] += 1
        entry["last_ns"] = log
        if arguments.messages:
            entry["messages"].append({"log_ns": log, "publish_ns": publish, "data": data.hex()})
    print(json.dumps({"profile": file.profile, "library": file.library, "torn": file.torn, "topics": topics,
                      "metadata": {m[0]: m[1] for m in file.metadata}, "chunks": len(file.chunks)}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
