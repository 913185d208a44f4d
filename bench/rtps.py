"""Reads a capture of UDP over Ethernet or Linux's loopback (pcap), and the RTPS messages in it.

Implements only the parts of RTPS 2.2 that are needed to distinguish topics (sections 8.3.7 and 9.4.5). The topics of
endpoints are learned from their discovery messages, so the capture must begin before discovery.
"""

import dataclasses
import struct

ACKNACK, HEARTBEAT, GAP, INFO_DST, DATA, DATA_FRAG = 0x06, 0x07, 0x08, 0x0E, 0x15, 0x16
VENDORS_OWN = 0x80  # and above
SPDP_WRITERS = (0x000100C2, 0xFF0101C2)  # announce participants; the second one with keys
SEDP_WRITERS = (0x000003C2, 0x000004C2)  # announce endpoints that publish, and that subscribe
PID_TOPIC_NAME, PID_ENDPOINT_GUID, PID_SENTINEL = 0x0005, 0x005A, 0x0001
INLINE_QOS = 0x02  # a flag of DATA
RTPS_HEADER = 20
UDP_HEADERS = 28  # of IPv4 without options, and UDP

PCAP_MAGIC = {b"\xd4\xc3\xb2\xa1": ("<", 1000), b"\x4d\x3c\xb2\xa1": ("<", 1),
              b"\xa1\xb2\xc3\xd4": (">", 1000), b"\xa1\xb2\x3c\x4d": (">", 1)}


@dataclasses.dataclass
class Packet:
    """A UDP packet with an RTPS message."""

    time_ns: int
    sender: bytes           # participant
    rtps_bytes: int
    payload_bytes: int = 0  # of its DATA submessages: CDR with its header of four bytes
    vendor_bytes: int = 0   # of Fast DDS's own submessages, for statistics
    payloads: list = dataclasses.field(default_factory=list)  # of its DATA submessages, whole
    kinds: list = dataclasses.field(default_factory=list)    # of its submessages, in order
    writers: list = dataclasses.field(default_factory=list)  # (participant, entity) they are about

    @property
    def udp_bytes(self):
        """Its size with IP and UDP headers."""
        return self.rtps_bytes + UDP_HEADERS

    def is_about(self, entities):
        """Whether its data, or what it says of data, is of one of these writers."""
        return any(entity in entities for _, entity in self.writers)


def _datagrams(path):
    """Yields (time [ns], IPv4 packet) of a capture."""
    with open(path, "rb") as file:
        header = file.read(24)
        if header[:4] not in PCAP_MAGIC:
            raise ValueError(f"{path} is not a capture")
        order, nanoseconds = PCAP_MAGIC[header[:4]]
        if struct.unpack(order + "I", header[20:24])[0] != 1:
            raise ValueError(f"{path} is not of Ethernet or the loopback interface")
        while len(record := file.read(16)) == 16:
            seconds, fraction, kept, length = struct.unpack(order + "IIII", record)
            # Pads a truncated packet: the bytes that were not captured count as well.
            frame = file.read(kept).ljust(length, b"\0")
            if frame[12:14] == b"\x08\x00":
                yield seconds * 10**9 + fraction * nanoseconds, frame[14:]


def _parameters(payload):
    """The parameters of a parameter list as in discovery: {id: value}."""
    order = "<" if payload[1] & 1 else ">"
    found, at = {}, 4
    while at + 4 <= len(payload):
        pid, length = struct.unpack(order + "HH", payload[at:at + 4])
        if pid == PID_SENTINEL:
            break
        found[pid] = payload[at + 4:at + 4 + length]
        at += 4 + length
    return found


def _payload_of(body, flags, order):
    """The serialized payload of a DATA submessage."""
    at = 4 + struct.unpack(order + "H", body[2:4])[0]
    if flags & INLINE_QOS:
        while at + 4 <= len(body):
            pid, length = struct.unpack(order + "HH", body[at:at + 4])
            at += 4 + length
            if pid == PID_SENTINEL:
                break
    return body[at:]


def _submessages(message):
    """Yields (kind, flags, byte order, body)."""
    at = RTPS_HEADER
    while at + 4 <= len(message):
        kind, flags = message[at], message[at + 1]
        order = "<" if flags & 1 else ">"
        length = struct.unpack(order + "H", message[at + 2:at + 4])[0] or len(message) - at - 4
        yield kind, flags, order, message[at + 4:at + 4 + length]
        at += 4 + length


class Capture:
    """All RTPS packets of a capture, and the topic of each endpoint in it."""

    def __init__(self, path):
        self.packets = []
        self._topics = {}
        self._participants = set()
        for time_ns, packet in _datagrams(path):
            at = (packet[0] & 0x0F) * 4
            message = packet[at + 8:]
            if packet[9] != 17 or message[:4] != b"RTPS":
                continue
            self.packets.append(self._read(time_ns, message))

    def _read(self, time_ns, message):
        sender = receiver = message[8:RTPS_HEADER]
        packet = Packet(time_ns, sender, len(message))
        for kind, flags, order, body in _submessages(message):
            packet.kinds.append(kind)
            if kind >= VENDORS_OWN:
                packet.vendor_bytes += 4 + len(body)
            elif kind == INFO_DST:
                receiver = body[:12]
            elif kind in (DATA, DATA_FRAG):
                entity = struct.unpack(">I", body[8:12])[0]
                packet.writers.append((sender, entity))
                payload = _payload_of(body, flags, order)
                packet.payload_bytes += len(payload)
                packet.payloads.append(payload)
                if entity in SEDP_WRITERS and kind == DATA:
                    self._learn(payload)
            elif kind in (HEARTBEAT, GAP):
                packet.writers.append((sender, struct.unpack(">I", body[4:8])[0]))
            elif kind == ACKNACK:  # from a reader to a writer of the addressed participant
                packet.writers.append((receiver, struct.unpack(">I", body[4:8])[0]))
        return packet

    def _learn(self, payload):
        parameters = _parameters(payload) if len(payload) > 4 else {}
        if PID_TOPIC_NAME not in parameters or PID_ENDPOINT_GUID not in parameters:
            return
        order = "<" if payload[1] & 1 else ">"
        name = parameters[PID_TOPIC_NAME]
        length = struct.unpack(order + "I", name[:4])[0]
        guid = parameters[PID_ENDPOINT_GUID]
        endpoint = (guid[:12], struct.unpack(">I", guid[12:16])[0])
        self._participants.add(endpoint[0])
        self._topics[endpoint] = name[4:4 + length - 1].decode()

    def topic(self, packet):
        """The topic that a packet is about; None for discovery and similar packets."""
        for writer in packet.writers:
            if writer in self._topics:
                return self._topics[writer]
        return None

    def is_of_participant(self, packet):
        """Whether the sender is a participant whose endpoints were announced in this capture."""
        return packet.sender in self._participants

    def between(self, begin_ns, end_ns):
        """The packets from `begin_ns` to `end_ns`, which is excluded."""
        return [packet for packet in self.packets if begin_ns <= packet.time_ns < end_ns]
