"""The report's summary: what is faster, what is slower, and when to prefer tf2. Sentences without figures are left
out."""

from figures import as_measured, microseconds, number, ratio

TITLE = "## In one minute\n\nEvery value of tf-dude has its covariance; those of tf2 have none.\n"


class Teller:
    """Forms sentences from figures."""

    def __init__(self, figures):
        self.figures = figures

    def time(self, key):
        """A median with its unit, or None."""
        return f"{number(microseconds(self.figures[key]))} µs" if key in self.figures else None

    def of(self, over, under, which="median"):
        """A ratio as text, or None."""
        found = ratio(self.figures, over, under, which)
        return None if found is None else number(found)

    def percent(self, key):
        """A share of a core, or None."""
        return f"{number(as_measured(self.figures[key]))} %" if key in self.figures else None

    def ratios(self, ours, theirs, cases):
        """Ratios for several cases as text, or None if one is missing."""
        found = [self.of(f"core/{ours}/{case}", f"core/{theirs}/{case}") for case in cases]
        return None if None in found else ", ".join(found)


def _sentence(form, *values):
    return None if None in values else "- " + form.format(*values)


def faster(tell):
    """What is faster than what it is compared with."""
    depths = ("2/100", "8/100", "30/100")
    newest = ("2/10", "8/100", "30/100")
    return [
        _sentence("A lookup of own edges takes {} of tf2's time for 2, 8 and 30 edges; of the pose alone {}. For 30 "
                  "edges that is {}.", tell.ratios("lookup/ours_by_handle", "lookup/tf2", newest),
                  tell.ratios("lookup/ours_pose", "lookup/tf2", newest),
                  tell.time("core/lookup/ours_by_handle/30/100")),
        _sentence("In the past, between two samples, it takes {} of tf2's time at 1 kHz, and {} at 100 Hz.",
                  tell.ratios("lookup_at/ours_by_handle", "lookup_at/tf2", depths),
                  tell.ratios("lookup_at_100hz/ours_by_handle", "lookup_at_100hz/tf2", depths)),
        _sentence("To set an own edge takes {} of tf2's time ({}), and a sample {}.",
                  tell.of("core/set/ours_by_handle/30/100", "core/set/tf2/30/100"),
                  tell.time("core/set/ours_by_handle/30/100"),
                  tell.of("core/set_history/ours_by_handle/2/100", "core/set_history/tf2/2/100")),
        _sentence("Beside a writer of 100 edges at 1 kHz, 99 of 100 lookups take at most {}; tf2's take {}.",
                  _p99(tell, "contention/ours/covariance/beside_writer"),
                  _p99(tell, "contention/tf2/pose/beside_writer")),
        _sentence("Compared with one central server, calls on own frames are {} to {} times as fast, and those on "
                  "frames of others as fast ({} of its time for a lookup, {} for an update).",
                  tell.of("thesis/add_own/robot/centralized", "thesis/add_own/robot/decentralized"),
                  tell.of("thesis/update_own/robot/centralized", "thesis/update_own/robot/decentralized"),
                  tell.of("thesis/path_other/arms/decentralized", "thesis/path_other/arms/centralized"),
                  tell.of("thesis/update_other/robot/decentralized", "thesis/update_other/robot/centralized")),
    ]


def slower(tell):
    """What is slower than what it is compared with, and what messages cost."""
    return [
        _sentence("A call to another process takes {} times a bare round trip of Fast DDS ({}), on one core {} times.",
                  tell.of("floor/lookup/ours/two_cores", "floor/lookup/dds/two_cores"),
                  tell.time("floor/lookup/ours/two_cores"),
                  tell.of("floor/lookup/ours/one_core", "floor/lookup/dds/one_core")),
        _sentence("A lookup over 16 partitions takes {}, {} times as long as from one server, because each owner is a "
                  "process of its own and this machine has two cores. Bare Fast DDS to as many processes takes {}.",
                  tell.time("scale/partitions/16/decentralized"),
                  tell.of("scale/partitions/16/decentralized", "scale/partitions/16/centralized"),
                  tell.time("scale/partitions/16/dds_floor")),
        _sentence("One `tfdude lookup`, from its start to its end, takes {} times a bare program that asks as many "
                  "servers.", tell.of("first_answer/ours", "first_answer/dds")),
        _sentence("A value that is pushed to a watcher arrives after {}, {} times as late as a bare DDS sample.",
                  tell.time("pushed/latency/ours"), tell.of("pushed/latency/ours", "pushed/latency/dds")),
        _sentence("An owner that receives 100 edges at 1 kHz uses {} of a core.",
                  tell.percent("stream/1khz/owner_cpu")),
        _sentence("A frame of another process costs a round trip ({}) unless its path is watched. tf2 has a copy of "
                  "all transforms in each process, and reads it in {}; a watched path takes {}.",
                  tell.time("floor/lookup/ours/two_cores"), tell.time("core/lookup/tf2/8/100"),
                  tell.time("pushed/latest")),
    ]


PREFER_TF2 = """\
**Prefer tf2** if no part of the robot says how sure it is, all programs are ROS nodes, and each of them needs most
transforms: then a copy in each process is what you want, and the tools of ROS need no bridge. **Prefer tf-dude** if
you need covariances, if transforms should stay with the subsystem that measures them, if frames come and go, or if
programs without ROS take part ([coming from tf2](../docs/coming-from-tf2.md)).
"""


def _p99(tell, key):
    return f"{number(microseconds(tell.figures[key], 'p99'))} µs" if key in tell.figures else None


def text(figures):
    """The section of the report."""
    tell = Teller(figures)
    parts = [TITLE]
    for heading, sentences in (("Faster:", faster(tell)), ("Slower, and what messages cost:", slower(tell))):
        said = [sentence for sentence in sentences if sentence]
        if said:
            parts.append(f"**{heading}**\n\n" + "\n".join(said) + "\n")
    return "\n".join([*parts, PREFER_TF2])
