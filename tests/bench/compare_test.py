"""What scripts/bench --compare calls a change, without measuring."""

import pathlib
import random
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "bench"))

import compare  # noqa: E402


def rounds(*medians):
    """Rounds with one figure each."""
    return [{"core/lookup": {"median": value, "unit": "ns"}} for value in medians]


class Changes(unittest.TestCase):
    def only(self, before, after):
        found = list(compare.changes(before, after))
        self.assertEqual(len(found), 1)
        return found[0]

    def test_more_time_in_all_rounds_is_slower(self):
        change = self.only(rounds(100, 120, 90, 100), rounds(110, 132, 99, 111))
        self.assertEqual(change.verdict, "slower")
        self.assertAlmostEqual(change.ratio, 1.1)

    def test_less_time_is_faster(self):
        self.assertEqual(self.only(rounds(100, 100, 100, 100), rounds(80, 81, 82, 83)).verdict, "faster")

    def test_one_disturbed_round_changes_nothing(self):
        self.assertEqual(self.only(rounds(100, 100, 100, 100), rounds(100, 101, 400, 99)).verdict, "")

    def test_a_small_difference_is_no_change(self):
        self.assertEqual(self.only(rounds(100, 100, 100, 100), rounds(101, 101, 101, 101)).verdict, "")

    def test_noise_has_no_verdict_in_most_seeds(self):
        seed = 90210
        generator = random.Random(seed)
        verdicts = 0
        for _ in range(1000):
            before, after = ([generator.gauss(100, 5) for _ in range(10)] for _ in range(2))
            verdicts += bool(self.only(rounds(*before), rounds(*after)).verdict)
        self.assertLess(verdicts, 60, f"seed {seed}")

    def test_only_our_figures_of_which_less_is_better_count(self):
        for key, unit, counts in (("core/lookup/ours/2/10", "ns", True), ("core/lookup/tf2/2/10", "ns", False),
                                  ("stream/highest_rate", "Hz", False), ("floor/update/dds/one_core", "us", False)):
            self.assertEqual(compare.counts({"key": key, "unit": unit, "n": 5}), counts, key)

    def test_figures_of_one_side_only_are_left_out(self):
        self.assertEqual(list(compare.changes(rounds(1, 1, 1, 1), [{}, {}, {}, {}])), [])

    def test_the_table_begins_with_the_changes(self):
        same = self.only(rounds(100, 100, 100, 100), rounds(100, 100, 100, 100))
        slower = self.only(rounds(100, 100, 100, 100), rounds(150, 150, 150, 150))
        lines = compare.table([same, slower]).splitlines()
        self.assertTrue(lines[1].startswith("slower"))
        self.assertIn("1.500", lines[1])


if __name__ == "__main__":
    unittest.main()
