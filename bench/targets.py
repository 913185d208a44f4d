"""The targets as data: how each value is computed from the figures, and its bound.

A ratio of medians is the median of the ratios of each repetition, if both sides have the same number of repetitions
(figures.ratio).
"""

import dataclasses
import typing

import thesis
from figures import as_measured, microseconds, number, ratio

MOST, LEAST = "at most", "at least"


@dataclasses.dataclass(frozen=True)
class Target:
    """A bound for the value that `compute` returns for the figures; that is None if they are missing."""

    group: str
    name: str
    compute: typing.Callable
    bound: float
    direction: str = MOST
    unit: str = ""  # empty: a ratio

    @property
    def full_name(self):
        """The name of which there is only one."""
        return f"{self.group}: {self.name}"

    def verdict(self, figures):
        """(value, reached), or (None, None) if the figures are missing."""
        value = self.compute(figures)
        if value is None:
            return None, None
        return value, value <= self.bound if self.direction == MOST else value >= self.bound


def ratio_of(over, under, which="median"):
    """A function that computes the ratio of two figures."""
    return lambda figures: ratio(figures, over, under, which)


def value_of(key, which="median", convert=as_measured):
    """A function that computes a value of one figure."""
    return lambda figures: convert(figures[key], which) if key in figures else None


def _thesis():
    bounds = {"own": ("Own process", 100.0, LEAST, "centralized / decentralized"),
              "other": ("Other process", 0.95, LEAST, "centralized / decentralized"),
              "across": ("Across partitions", 1.3, MOST, "decentralized / centralized")}
    for case in thesis.CASES:
        group, bound, direction, what = bounds[case.kind]
        sides = [f"thesis/{case.key}/{how}" for how in what.split(" / ")]
        name = f"{case.title} ({case.figure})" if case.figure else case.title
        yield Target(group, f"{name}: {what}", ratio_of(*sides), bound, direction)


def _partitions():
    for count in (2, 4, 8, 16):
        key = f"scale/partitions/{count}"
        yield Target("Across partitions", f"lookup over {count} partitions: ours / bare DDS to as many",
                     ratio_of(f"{key}/decentralized", f"{key}/dds_floor"), 1.3)


def _growth_on_path(figures):
    one, four = (figures.get(f"wire/lookup_over_{n}_partitions/total_udp") for n in (1, 4))
    return four["median"] / (4 * one["median"]) if one and four and one["median"] else None


def _wire():
    for operation, part, index in (("add", "request", 0), ("update", "request", 0),
                                   ("lookup_other", "reply", 1)):
        size = thesis.SIZES[operation][index]
        key = f"wire/{operation}/{part}_payload"
        yield Target("On the wire", f"{operation}, {part}: CDR bytes / the thesis's {size}",
                     lambda figures, key=key, size=size:
                     figures[key]["median"] / size if key in figures else None, 0.75)
    yield Target("On the wire", "lookup over 4 of 6 partitions: bytes / 4 x those over 1",
                 _growth_on_path, 1.05)
    yield Target("On the wire", "a frame is added to 59, two participants: structure and acknowledgements",
                 value_of("wire/full_page/add/other_udp"), 1500, unit="bytes")
    yield Target("On the wire", "one `tfdude lookup` beside two daemons, all UDP",
                 value_of("wire/one_shot/ours/total_udp"), 20000, unit="bytes")


def _floor():
    for operation in ("update", "lookup"):
        for placement in ("one_core", "two_cores"):
            ours, dds = (f"floor/{operation}/{who}/{placement}" for who in ("ours", "dds"))
            where = placement.replace("_", " ")
            for which, bound in (("median", 1.08), ("p99", 1.2)):
                yield Target("Floor", f"{operation}, {where}, {which}: ours / bare DDS",
                             ratio_of(ours, dds, which), bound)


def _first_answer():
    yield Target("First answer", "`tfdude lookup` over two daemons, from start to end: ours / bare DDS",
                 ratio_of("first_answer/ours", "first_answer/dds"), 1.2)


def _stream():
    yield Target("Stream", "100 edges at 1 kHz: samples lost",
                 value_of("stream/1khz/lost", "max"), 0, unit="samples")
    yield Target("Stream", "100 edges at 1 kHz: owner's share of a core",
                 value_of("stream/1khz/owner_cpu"), 5, unit="%")
    yield Target("Stream", "30 joints at 1 kHz: samples lost",
                 value_of("stream/joints/1khz/lost", "max"), 0, unit="samples")
    yield Target("Stream", "30 joints at 1 kHz: owner's share of a core, with a lookup per sample",
                 value_of("stream/joints/1khz/owner_cpu"), 3, unit="%")


def _core():
    for shape, bound in (("2/10", 0.6), ("8/100", 0.5), ("30/100", 0.45), ("30/1000", 0.45)):
        depth, frames = shape.split("/")
        tree = f"depth {depth} of {frames} frames"
        tf2 = f"core/lookup/tf2/{shape}"
        yield Target("Core", f"lookup with covariance, {tree}: by handle / tf2",
                     ratio_of(f"core/lookup/ours_by_handle/{shape}", tf2), bound)
        if depth == "30":
            yield Target("Core", f"lookup of the pose only, {tree}: by handle / tf2",
                         ratio_of(f"core/lookup/ours_pose/{shape}", tf2), 0.2)
    for key, what, bound in (("lookup_correlated/shared", "that share a source", 3),
                             ("lookup_correlated/unknown", "of unknown correlation", 3),
                             ("lookup_fourth/independent", "to fourth order", 10)):
        yield Target("Core", f"lookup over 30 own edges {what}",
                     value_of(f"core/{key}/30/100", "median", microseconds), bound, unit="µs")
    for key, who, bound in (("1_owner", "another owner", 1.25), ("16_owners", "16 other owners", 1.3)):
        yield Target("Core", f"lookup over 30 edges with covariance, read in the memory of {who} / own",
                     ratio_of(f"core/lookup_read/{key}/30/100", "core/lookup/ours_by_handle/30/100"), bound)
    for shape in ("2/10", "30/100", "30/1000", "1000/10000"):
        frames = shape.split("/")[1]
        yield Target("Core", f"set an edge of {frames} frames: by handle / tf2",
                     ratio_of(f"core/set/ours_by_handle/{shape}", f"core/set/tf2/{shape}"), 0.09)
    for who, what in (("ours_forest", "in the forest"), ("ours", "through a node")):
        yield Target("Core", f"add and remove a leaf in 100,000 frames, {what}",
                     value_of(f"core/add_remove/{who}/1000/100000", "median", microseconds), 0.2,
                     unit="µs")


def _history():
    yield Target("History", "add a sample to an edge with a full history: by handle / tf2",
                 ratio_of("core/set_history/ours_by_handle/2/100", "core/set_history/tf2/2/100"), 0.12)
    for operation, what in (("lookup_at", "1 kHz"), ("lookup_at_100hz", "100 Hz")):
        for depth in (2, 8, 30):
            ours, tf2 = (f"core/{operation}/{who}/{depth}/100" for who in ("ours_by_handle", "tf2"))
            yield Target("History", f"lookup between samples of {what}, depth {depth}: "
                         "by handle, with covariance / tf2", ratio_of(ours, tf2), 0.5)


def _pushed():
    for which, bound in (("median", 1.25), ("p99", 1.5)):
        yield Target("Pushed", f"from before update() to a watcher's thread, {which}: ours / bare DDS",
                     ratio_of("pushed/latency/ours", "pushed/latency/dds", which), bound)
    yield Target("Pushed", "newest value of a path of 10 edges, with covariance",
                 value_of("pushed/latest", "median", microseconds), 1, unit="µs")


def _memory():
    for who, what, bound in (("owner", "at its owner", 600), ("replica", "in a replica", 150)):
        yield Target("Memory", f"a frame of 100,000 without history, {what}: heap",
                     value_of(f"memory/{who}"), bound, unit="bytes")


def _contention():
    for reader, what in (("covariance", "with covariance"), ("pose", "of the pose only")):
        key = f"contention/ours/{reader}"
        yield Target("Contention", f"p99 of a lookup {what}: beside the writer / alone",
                     ratio_of(f"{key}/beside_writer", f"{key}/alone", "p99"), 1.5)
    yield Target("Contention", "torn reads", value_of("contention/ours/torn", "max"), 0,
                 unit="reads")
    yield Target("Contention", "writer's batch of 100 edges",
                 value_of("contention/ours/batch", "median", microseconds), 3, unit="µs")


def _many():
    yield Target("Many daemons", "32 with 100,000 frames: until a newcomer has all frames",
                 value_of("many/32/newcomer"), 1, unit="s")
    yield Target("Many daemons", "32 with 100,000 frames, started at once: until a newcomer has all frames",
                 value_of("many/32/all_known"), 5, unit="s")


ALL = (
    *_thesis(), *_partitions(), *_wire(), *_floor(), *_first_answer(), *_stream(), *_core(), *_history(), *_memory(),
    *_contention(), *_pushed(), *_many(),
)
# Why a target is not reached, by the start of "GROUP: NAME"; printed only if it is not reached.
WHY = {
    "On the wire: add, request":
        "Since version 1.0 of the protocol, a request also has the number below which its sender awaits "
        "no answer, the partition that it is for, and the time of the last change that its sender knows.",
    "On the wire: update, request":
        "Since version 1.0 of the protocol, a request also has the number below which its sender awaits "
        "no answer, and the partition that it is for.",
    "On the wire: lookup_other, reply":
        "A reply also has the epoch of the owner's structure and the time of its last change.",
    "On the wire: a frame is added to 59":
        "The frame's page has ten frames. With pages of eight it was 1,024 bytes, but 32 daemons with 100,000 frames "
        "took a second more to start together.",
    "On the wire: one `tfdude lookup`":
        "A bare client of Fast DDS with the same readers and writers, beside two bare servers, needs three "
        "quarters of it: DDS's announcements of readers and writers alone are half. On a busy machine the "
        "question takes longer, so more announcements of participants fall into it.",
    "Across partitions: lookup over":
        "An owner does more for a request than a bare echo, as on the floor: 2 to 4 µs for each of two or four owners. "
        "With 8 and 16 owners on two cores it is 8 and 16 µs, probably because each owner is woken with the caches "
        "that the others have filled, and has more code and data to fetch than the echo.",
    "Floor: ":
        "Planning, the codec, the filters and accounting take two to three microseconds of a round trip in both "
        "processes together, if the processor still has their code at hand when a thread wakes up. Where it has to "
        "fetch it again, they take 10 to 20, and also make Fast DDS's own code slower "
        "([performance](../docs/performance.md#the-ratios-depend-on-the-machine)).",
    "Stream: ":
        "The owner's thread wakes up for each message, so the share depends on the machine, as on the floor: 100 edges "
        "took 3 % of one and 7 % of another ([performance](../docs/performance.md#the-ratios-depend-on-the-machine)).",
    "Core: lookup with covariance":
        "Seven tenths of a lookup are the chain of multiplications, a quarter is following the path. How tf2 and a "
        "chain of multiplications compare depends on the processor: for 30 edges the ratio was 0.37 on one, and 0.70 "
        "on another, where the commit of the first report (13ff0c78) had 0.91 "
        "([performance](../docs/performance.md#the-ratios-depend-on-the-machine)).",
    "Core: lookup of the pose only":
        "Half of it is the chain of multiplications, and half following the path, which takes 5 ns for each edge. The "
        "commit of the first report takes as long on the same machine.",
    "Core: lookup over 30 own edges":
        "Like lookups with covariance, it depends on the processor: 2.3 µs on one, 3.2 µs on another.",
    "Core: set an edge":
        "The locked instruction of the writers' lock takes 5 ns, and waits for the stores before it. A "
        "record that is copied under such a lock, without any check, takes 8 ns: 0.04 of tf2.",
    "History: add a sample":
        "Of 30 ns, the lock takes 6, the version for readers 6, the comparison of the covariance with "
        "that of the sample before 3, and dropping the oldest sample 2. A record and a sample that are "
        "copied under a lock into a ring, without any check, take 10 ns: 0.05 of tf2.",
    "History: lookup between samples":
        "Each edge is interpolated on its geodesic, while tf2 interpolates translations linearly. If it "
        "turns by more than 4 mrad between two samples, its covariance is computed for the instant; tf2 "
        "has none.",
    "First answer: ":
        "A command asks one owner for its frames before it knows whom to ask for their values, so it discovers the "
        "second owner's reader after the first answer. The bare client knows both from its start.",
    "Memory: a frame of 100,000 without history, at its owner":
        "The version that readers see has the pose and the covariance, 384 bytes, whether they are given "
        "or not; the pages, the names and the hierarchy take the rest.",
    "Memory: a frame of 100,000 without history, in a replica":
        "A version takes 56 bytes, a name with its cell in the table 85, a vertex of Boost.Graph with its "
        "edge 56, and the list of each page's ids 15.",
    "Pushed: from before update()":
        "update() does not wait for the network: it wakes a thread that finds the changes and sends them. That "
        "wake-up alone takes a bare sample to 1.22 of its time (`pushed/latency/dds_woken`). The rest is finding the "
        "changes of ten edges, and applying them to the watcher's forest before its thread is woken.",
    "Many daemons: 32 with 100,000 frames, started":
        "Two processors start all 32. Each daemon reads its configuration (0.08 s), takes in the structure of 31 "
        "others (0.1 s) and sends its own to them; 32 daemons of one frame each take 1.5 s.",
    "Core: add and remove a leaf in 100,000 frames, through a node":
        "The forest takes 0.12 µs of it. A node also plans the request, keeps the pages for other participants, and "
        "wakes the thread that publishes them. Its profile is flat: strings that are copied, hashed and compared take "
        "a seventh, memory a tenth, locks and clocks 5 % each. Built and run in turn on one machine, it takes 1.2 to "
        "1.5 times what it took in the first report (13ff0c78). What came since: tombstones of removed frames, a "
        "record of changes, joints, and rules that are apart from their effects, so that they can be simulated: to "
        "hand over what is to be done takes 5 %.",
    "Contention: writer's batch":
        "The reader has the versions of 30 of the edges in the cache of its processor, and the writer has to take "
        "these cache lines, seven for each, from it. How long one line takes (`contention/line`) depends on where the "
        "host runs the two processors: where it was 100 to 200 ns, the batch took 5 to 7 µs, and 15 µs where it was "
        "300 ns; without a reader it took 2.8 µs. It became no faster when all versions were written before readers "
        "could reach them, nor when their lines were fetched earlier. `contention/bare/batch` is a batch of bare "
        "records of one line each.",
}

GROUPS = tuple(dict.fromkeys(target.group for target in ALL))
TARGETS = tuple(sorted(ALL, key=lambda target: GROUPS.index(target.group)))


def why(target):
    """The known reason for missing a target, or an empty text."""
    return next((reason for start, reason in WHY.items() if target.full_name.startswith(start)), "")


def rows(figures):
    """Yields (target, value or "missing", bound, verdict) of each target; all but the target as text."""
    for target in TARGETS:
        value, reached = target.verdict(figures)
        unit = f" {target.unit}" if target.unit else ""
        verdict = {True: "yes", False: "NO", None: "missing"}[reached]
        found = number(value)
        if value is not None:
            if found == number(target.bound):  # more digits show on which side of the bound it is
                found = f"{value:.5g}"
            found += unit
        yield target, found, f"{target.direction} {target.bound:g}{unit}", verdict


def table(figures):
    """All targets as plain text, for --check."""
    lines, group = [], None
    for target, value, bound, verdict in rows(figures):
        if target.group != group:
            group = target.group
            lines.append(f"\n{group}")
        lines.append(f"  {verdict:8}{value:>14}   {bound:18}{target.name}")
    counted = [line.split()[0] for line in lines if line.startswith("  ")]
    lines.append(f"\n{counted.count('yes')} reached, {counted.count('NO')} not reached, "
                 f"{counted.count('missing')} without figures")
    return "\n".join(lines)
