"""The traffic of one question by a program that starts, asks and ends: `tfdude lookup` beside two daemons.

Keys: wire/one_shot/SIDE/KIND_udp [bytes], and wire/one_shot/SIDE/packets. SIDE is ours, or bare: a bare Fast DDS
participant with the same readers and writers, and the same settings, that asks one of two others. KIND is total, or a
part of it:
participants: announcements of participants; endpoints: those of their readers and writers; acknowledgements: DDS's
heartbeats, acknowledgements and gaps; presence, structure, and question: requests and replies.
"""

import time

import figures
import processes
import rtps
import wire

SETTLED_S = 2.0  # after the start of the servers
WINDOW_S = 1.0   # of one question; DDS confirms that the client's endpoints are gone after half a second
KINDS = ("participants", "endpoints", "acknowledgements", "presence", "structure", "question")
TOPICS = {"tfdude/presence": "presence", "tfdude/directory": "structure", "tfdude/request": "question",
          "tfdude/reply": "question"}


def kind_of(capture, packet):
    """One of KINDS."""
    if not (rtps.DATA in packet.kinds or rtps.DATA_FRAG in packet.kinds):
        return "acknowledgements"
    if packet.is_about(rtps.SPDP_WRITERS):
        return "participants"
    if packet.is_about(rtps.SEDP_WRITERS):
        return "endpoints"
    return TOPICS[capture.topic(packet)]


def count(capture, begin_ns, end_ns):
    """Counts what was sent from the start of a client on, which ended at `end_ns`: {name: number}. Without the
    announcements that the servers send afterwards, as always."""
    counts = {"packets": 0, "total_udp": 0, **{f"{kind}_udp": 0 for kind in KINDS}}
    for packet in capture.between(begin_ns, begin_ns + int(WINDOW_S * 1e9)):
        kind = kind_of(capture, packet)
        if kind == "participants" and packet.time_ns > end_ns:
            continue
        counts["packets"] += 1
        counts["total_udp"] += packet.udp_bytes
        counts[f"{kind}_udp"] += packet.udp_bytes
    return counts


def measure_side(side, work, rounds, servers, question):
    """Yields the figures of one side. `servers` returns a context of running servers for a domain, `question` the
    command of the client."""
    file = work / f"one_shot_{side}.pcap"
    domain, _lease = processes.lease_domain()
    spans = []
    with wire.capturing(file, domain), servers(domain):
        time.sleep(SETTLED_S)
        for _ in range(rounds):
            begin = time.time_ns()
            processes.output_of(question(domain), processes.PATIENCE_S)
            spans.append((begin, time.time_ns()))
            time.sleep(WINDOW_S)
    capture = rtps.Capture(file)
    counted = [count(capture, *span) for span in spans]
    for name in counted[0]:
        unit = "packets" if name == "packets" else "bytes"
        yield figures.summary(f"wire/one_shot/{side}/{name}", unit, [one[name] for one in counted])


def bare_servers(bin_dir, domain):
    """A context of two bare servers."""
    command = [bin_dir / "bare_participant", domain, processes.PROFILE, "server"]
    return processes.running([command, command])


def run(quick, bin_dir, work):
    """Yields the figures of both sides."""
    rounds = 5 if quick else 15
    configs = [processes.ROOT / "examples" / "thesis" / f"{name}.yaml" for name in wire.THESIS_CONFIGS]
    yield from measure_side(
        "ours", work, rounds, lambda domain: processes.daemons(bin_dir, configs, domain, work),
        lambda domain: [bin_dir / "tfdude", "--domain", str(domain), "--profile", processes.PROFILE, "lookup", "world",
                        "hand_left"])
    yield from measure_side(
        "bare", work, rounds, lambda domain: bare_servers(bin_dir, domain),
        lambda domain: [bin_dir / "bare_participant", str(domain), processes.PROFILE, "asker"])
