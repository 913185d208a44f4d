"""The sections of the report about calls over the network: the thesis's cases, bytes, latency, keys."""

import plots
import thesis
from figures import as_measured, microseconds, nanoseconds, number, ratio
from report_parts import MISSING, both, picture, table, unit_of, value

THESIS = """\
Microseconds. Centralized: one daemon owns all frames, and the caller is a plain client.
Decentralized: the caller is the process `robot` (the thesis's main process), or `arms` if the case
names it, and owns its frames. The ratio is centralized / decentralized: above one the decentralized
tree is faster. The thesis took {calls:,} values for each case; the last column has ours. A value of a
call on own frames is the mean of 32 calls.
"""
THESIS_NOTES = """\
- **What the thesis says.** It prints two medians, for 5.10. For 5.1, 5.5, 5.6, 5.7 and 5.8 its text has a ratio or a
  difference, and for the others a comparison with another case. Ratios that follow: 5.1 "three times as long", so 3;
  5.5 "about double the time", so 1 / 2; 5.10: 57.597 / 14.022 = 4.1. For 5.2 it says that an add takes six times its
  add in the own process: with 5.1's ratio of 3 that is 3 / 6 = 0.5. For 5.8 the difference is 12 µs;
  with the centralized median of 5.10 that is 57.6 / (57.6 + 12) = 0.83.
- **5.6** is the path that is asked for by the arms' process. The text of this case refers to figure 5.7. It explains
  the advantage of 15 µs by the smaller trees of the parts. That cause does not exist here: the time of a lookup does
  not depend on the number of frames ("Cost as work grows" below), and the two sides take the same time.
- **5.11** names no caller, so both are measured. Here the connector belongs to the owner of its child, so the owner of
  the parent pays a round trip for it.
- **The tree** is that of the thesis's figure 4.1, and the arm of its figure 1.1 is that of the pictures. Both figures
  are drawings without numbers: names and links are theirs, all poses and covariances are ours.
"""
NARROW = """\
Milliseconds. The same cases over a link of 1 Mbit/s that delays each packet by 20 ms in each direction.
The caller is the process `robot`. Its host has its own frames; at the other end are the daemon of the arms and the
central server. A round trip of such a link takes 40 ms, and 8 µs more for each byte. While nobody asks, discovery
and presence of the two daemons send {bytes} bytes and {packets} packets a second over it, both directions together.
"""
WIRE = """\
Bytes of request / reply, captured on the loopback interface; the caller owns no frames, and ids
have ten characters. Payloads are CDR with its header of four bytes. "Other" is UDP packets with
changes of the structure, which go to all participants, and acknowledgements.
"""
WIRE_NAMES = {"add": "add", "remove": "remove", "lookup_other": "look up, one other owner",
              "lookup_across": "look up, two owners", "update": "update",
              "publish": "publish (has no reply)",
              "publish_joint": "publish a joint's position"}
WIRE_TABLE = """\
### Who sends what, centralized and decentralized

UDP bytes: request + reply + other, and all packets. Centralized: one daemon owns all frames, and a
client asks. By the owner: the process that owns the frame. By another: a client, beside the owners.
`2`: the thesis's example; `5` and `16`: partitions of two frames each.
"""
SPLIT = """\
**Does the split send less?** In the thesis's example, an update of an own edge sends {update_by_owner} bytes instead of
{update_centralized}, a lookup of own frames {lookup_by_owner} instead of {lookup_centralized}, and an own add
{add_by_owner} instead of {add_centralized}: its page goes to the other participants either way. Calls on the frames of
others send the same as to a server, {update_by_other} bytes for an update. But each daemon announces itself: two send
{idle_decentralized} bytes a second while nothing happens, one sends {idle_centralized}. So the split sends less once
the robot makes more than {break_even} updates of own edges a second.
"""
ONE_SHOT = """\
### A program that asks once

`tfdude lookup` beside two daemons, from its start until nothing of it is left: UDP bytes. Bare: a
participant of Fast DDS with the same readers and writers that asks one of two others.
"""
FLOOR = """\
Round trips in microseconds, median / p99, compared with a bare Fast DDS ping-pong and with bare UDP,
both with the same payload.
"""
FIRST_ANSWER = """\
Whole runs of a process, from its start until it has ended: a lookup over two daemons, and a bare
Fast DDS client with the same readers, writers and QoS that asks two servers once each.
"""
PUSHED = """\
A path of ten edges that another process watches; its owner updates all of them at 1 kHz. Each
process has its own core. Microseconds from just before `update()` until a waiting thread has read
the new value. Measured in turns with a bare Fast DDS sample of the same size and QoS: from just
before `write()` until a waiting thread has it, and until the listener has it, which needs one
wake-up less.
"""
PUSHED_BYTES = """\
Bytes of a robot with 30 joints, which all move at once. With tf-dude, the path from base to tip is
watched, as if all joints were one chain: every edge (240 bytes, of which 168 are its covariance), or
the path composed to one transform. tf2's middleware is not part of this comparison: the size of its
message is computed ({tf2} CDR bytes: one `TFMessage` of all 30 `TransformStamped`, with names such
as `left_shoulder_pan_link`), and bare Fast DDS sends samples of that size to the same number of
listeners. Counted on the loopback interface; UDP includes acknowledgements, and for tf-dude the
watchers' renewals. Each watcher is a separate participant and receives its own copy. Presence and
discovery are left out on both sides.
"""
KEYS = """\
Medians with keys and without, in turns: a whole run of `tfdude lookup`, calls with both programs on one core, and 100
edges at 1 kHz.
"""


def thesis_section(figures, drawn, home):
    """Figures 5.1 to 5.11."""
    rows = []
    for case in thesis.CASES:
        keys = [f"thesis/{case.key}/{side}" for side in ("centralized", "decentralized")]
        ours = ratio(figures, *keys)
        theirs = [f"{case.ratio:.2g}" if case.ratio else "", case.words]
        values = [figures[key]["n"] for key in keys if key in figures]
        rows.append((f"{case.figure} {case.title}".strip(), *(both(figures, key) for key in keys),
                     number(ours), ": ".join(word for word in theirs if word) or "-",
                     number(min(values)) if values else MISSING))
    head = ("case", "centralized, median / p99", "decentralized, median / p99", "ratio",
            "the thesis's", "values")
    return [THESIS.format(calls=thesis.CALLS), table(head, rows), THESIS_NOTES, picture(drawn, "thesis", home)]


def narrow_section(figures, _drawn, _home):
    """The thesis's cases over a narrow link."""
    def milliseconds(figure, which):
        return microseconds(figure, which) / 1e3

    rows = []
    for case in thesis.CASES:
        keys = [f"narrow/{case.key}/{side}" for side in ("centralized", "decentralized")]
        if keys[0] in figures:
            rows.append((f"{case.figure} {case.title}".strip(),
                         *(both(figures, key, milliseconds) for key in keys), number(ratio(figures, *keys))))
    head = ("case", "centralized, median / p99", "decentralized, median / p99", "ratio")
    idle = {name: value(figures, f"narrow/idle/{name}_per_second", convert=as_measured)
            for name in ("bytes", "packets")}
    return [NARROW.format(**idle), table(head, rows)]


def wire_table(figures):
    """The whole of table 5.1: each operation in systems of several sizes."""
    hows = (("centralized", "centralized"), ("by_owner", "by the owner"), ("by_other", "by another"))
    rows = []
    for system in ("2", "5", "16"):
        for operation in ("add", "remove", "lookup", "update", "publish"):
            cells = []
            for how, _ in hows:
                key = f"wire/table/{system}/{how}/{operation}"
                parts = " + ".join(value(figures, f"{key}/{part}_udp", convert=as_measured)
                                   for part in ("request", "reply", "other"))
                cells.append(f"{parts}; {value(figures, f'{key}/packets', convert=as_measured)}")
            rows.append((f"{system}: {operation}", *cells))
        idle = [value(figures, f"wire/table/{system}/{where}/idle/udp_per_second", convert=as_measured)
                for where in ("centralized", "decentralized")]
        rows.append((f"{system}: discovery and presence, a second", idle[0], idle[1], idle[1]))
    return table(("operation", *(title for _, title in hows)), rows)


def split_text(figures):
    """What the split saves in the thesis's example, and from how many updates a second on it pays."""
    key = "wire/table/2"
    said = {f"{operation}_{how}": value(figures, f"{key}/{how}/{operation}/total_udp", convert=as_measured)
            for operation in ("update", "lookup", "add") for how in ("centralized", "by_owner", "by_other")}
    said |= {f"idle_{where}": value(figures, f"{key}/{where}/idle/udp_per_second", convert=as_measured)
             for where in ("centralized", "decentralized")}
    if MISSING in said.values():
        return ""
    more = [figures[f"{key}/{where}/idle/udp_per_second"]["median"] for where in ("decentralized", "centralized")]
    saved = [figures[f"{key}/{how}/update/total_udp"]["median"] for how in ("centralized", "by_owner")]
    return SPLIT.format(**said, break_even=number(round((more[0] - more[1]) / (saved[0] - saved[1]))))


def one_shot_table(figures):
    """The parts of the traffic of one question."""
    rows = [(name, *(value(figures, f"wire/one_shot/{side}/{key}", convert=as_measured) for side in ("ours", "bare")))
            for key, name in (("total_udp", "all"), ("packets", "packets"),
                              ("participants_udp", "announcements of participants"),
                              ("endpoints_udp", "announcements of readers and writers"),
                              ("acknowledgements_udp", "heartbeats and acknowledgements"),
                              ("presence_udp", "presence"), ("structure_udp", "structure"),
                              ("question_udp", "requests and replies"))]
    return table(("part", "ours", "bare"), rows)


def wire_section(figures, _drawn, _home):
    """Table 5.1."""
    def size(name):
        return value(figures, f"wire/{name}", convert=as_measured)

    rows = []
    for operation, name in WIRE_NAMES.items():
        sizes = [f"{size(f'{operation}/request_{layer}')} / {size(f'{operation}/reply_{layer}')}"
                 for layer in ("payload", "rtps", "udp")]
        theirs = "{} / {}".format(*thesis.SIZES.get(operation, ("-", "-")))
        rows.append((name, theirs, *sizes, size(f"{operation}/other_udp"),
                     size(f"{operation}/packets")))
    head = ("operation", "thesis", "payload", "RTPS", "UDP", "other", "packets")
    paths = ", ".join(f"{size(f'lookup_over_{count}_partitions/total_udp')} over {count}"
                      for count in (1, 2, 4))
    return [WIRE, table(head, rows),
            "- More than the thesis counts: a request to remove names its sender's last change, so that "
            "changes of one client keep their order, and all requests a number, below which no answer is "
            "awaited any more. A lookup names both ends of its segment. The thesis's answers have one "
            "byte; ours have the number of the request and the epoch of the structure that shows it.\n"
            "- An added frame on a page of 60 frames or fewer: "
            f"{size('full_page/add/other_udp')} bytes of changes and acknowledgements to two participants; "
            f"removed: {size('full_page/remove/other_udp')}.\n"
            f"- UDP bytes of a lookup with six partitions in the domain, by the number of partitions on "
            f"its path: {paths}. The thesis's worst case is {thesis.WORST_CASE_PER_PROCESS} payload "
            "bytes for each existing process.\n"
            "- Discovery and presence of two daemons and a client that do nothing: "
            f"{size('idle/udp_per_second')} UDP bytes a second.\n",
            WIRE_TABLE, wire_table(figures), split_text(figures), ONE_SHOT, one_shot_table(figures)]


def floor_section(figures, drawn, home):
    """tf-dude compared with bare DDS and bare UDP."""
    rows = []
    for operation, placement in plots.FLOOR_PANELS:
        ours, dds, udp = (f"floor/{operation}/{who}/{placement}" for who in ("ours", "dds", "udp"))
        rows.append((f"{operation}, {placement.replace('_', ' ')}",
                     *(both(figures, key) for key in (ours, dds, udp)),
                     number(ratio(figures, ours, dds)), number(ratio(figures, ours, udp))))
    head = ("call", "ours", "bare DDS", "bare UDP", "ours / DDS", "ours / UDP")
    return [FLOOR, table(head, rows), picture(drawn, "floor", home)]


def first_answer_section(figures, _drawn, _home):
    """One-shot commands beside a bare client."""
    rows = [(name, *(value(figures, f"first_answer/{who}", which, as_measured)
                     for which in ("median", "p90", "max")))
            for who, name in (("ours", "`tfdude lookup` [ms]"), ("dds", "bare DDS [ms]"))]
    return [FIRST_ANSWER, table(("process", "median", "p90", "max"), rows)]


def stream_section(figures, _drawn, _home):
    """One publisher, one owner."""
    rows = []
    for key in sorted(key for key in figures if key.startswith("stream/")):
        name = f"{key.removeprefix('stream/').replace('_', ' ')} [{unit_of(figures[key])}]"
        rows.append((name, *(value(figures, key, which, as_measured)
                             for which in ("median", "p90", "p99", "max"))))
    return ["One publisher to one owner, 100 edges per message; `joints`: positions of 30 joints.\n",
            table(("figure", "median", "p90", "p99", "max"), rows)]


def pushed_section(figures, _drawn, _home):
    """Watched paths: latency compared with bare DDS, bytes with tf2."""
    ours = "pushed/latency/ours"
    rows = [(name, *(value(figures, key, which) for which in ("median", "p90", "p99")),
             number(ratio(figures, ours, key)), number(ratio(figures, ours, key, "p99")))
            for name, key in (("ours", ours), ("bare DDS, waiting thread", "pushed/latency/dds"),
                              ("bare DDS by a woken thread", "pushed/latency/dds_woken"))]
    head = ("latency", "median", "p90", "p99", "ours / this, median", "ours / this, p99")
    latest = value(figures, "pushed/latest", convert=nanoseconds)
    cases = sorted({tuple(map(int, key.split("/")[3:])) for key in figures
                    if key.startswith("pushed/udp/")})
    sizes = []
    for rate, watchers in cases:
        def kilobytes(what, who, case=f"{rate}/{watchers}"):
            return value(figures, f"pushed/{what}/{who}/{case}",
                         convert=lambda figure, which: figure[which] / 1e3)
        sizes.append((f"{rate:,} Hz, {watchers} watching",
                      *(f"{kilobytes('payload', who)} / {kilobytes('udp', who)}"
                        for who in ("edges", "composed", "tf2"))))
    return [PUSHED, table(head, rows),
            f"Reading the newest value at the same time, with covariance: {latest} ns.\n",
            PUSHED_BYTES.format(tf2=value(figures, "pushed/message/tf2", convert=as_measured)),
            table(("payload / UDP, kB a second", "ours, edges", "ours, composed", "tf2's size"),
                  sizes)]


def keys_section(figures, _drawn, _home):
    """What keys cost."""
    rows = []
    for name, key in (("first lookup of a new process [ms]", "first_meeting"), ("lookup [µs]", "lookup"),
                      ("update [µs]", "update"), ("100 edges at 1 kHz: latency [µs]", "stream/1khz/latency"),
                      ("100 edges at 1 kHz: the owner's share of a core [%]", "stream/1khz/owner_cpu")):
        rows.append((name, *(value(figures, f"secured/{key}/{how}", convert=as_measured)
                             for how in ("plain", "signed", "encrypted"))))
    return [KEYS, table(("call", "plain", "signed", "encrypted"), rows)]
