"""That the pages have the figures of the last run, and how tables, history and summary are made."""

import json
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "bench"))

import history  # noqa: E402
import processes  # noqa: E402
import summary  # noqa: E402
import tables  # noqa: E402

MACHINE = {"date": "2026-01-02 03:04 UTC", "commit": "abc", "cpu": "CPU", "cores": 2}
LOOKUP = ("core/lookup/ours_by_handle/30/100", "core/lookup/tf2/30/100")


def figure(median, unit="ns"):
    return {"unit": unit, "n": 5, "median": median, "p99": median, "medians": [median] * 5}


class Pages(unittest.TestCase):
    def test_each_page_has_the_figures_of_the_last_run(self):
        results = json.loads(tables.RESULTS.read_text(encoding="utf-8"))
        for page in tables.PAGES:
            text = (processes.ROOT / page).read_text(encoding="utf-8")
            self.assertEqual(len(tables.PLACE.findall(text)), 1, page)
            self.assertEqual(text, tables.filled(text, results), f"{page}: run bench/tables.py")

    def test_the_last_entry_of_the_history_is_the_last_run(self):
        results = json.loads(tables.RESULTS.read_text(encoding="utf-8"))
        known = history.load(tables.RESULTS.with_name("history.json"))
        self.assertEqual(known[-1]["commit"], results["machine"]["commit"])
        self.assertEqual(known[-1]["date"], results["machine"]["date"])

    def test_a_changed_figure_changes_the_page(self):
        page = "before\n<!-- figures: short -->\nold\n<!-- end of figures -->\nafter\n"
        results = {"machine": MACHINE, "figures": {LOOKUP[0]: figure(900), LOOKUP[1]: figure(1800)}}
        text = tables.filled(page, results)
        self.assertIn("| 0.900 µs | tf2, without covariance: 1.80 µs | 0.500 |", text)
        self.assertNotIn("old", text)
        self.assertTrue(text.startswith("before\n") and text.endswith("after\n"))
        self.assertEqual(text, tables.filled(text, results))

    def test_rows_without_figures_are_left_out(self):
        self.assertEqual(len(tables.table({LOOKUP[0]: figure(900)}, "short").splitlines()), 2)


class History(unittest.TestCase):
    def entry(self, commit, value):
        return {"date": f"2026-01-0{value} 00:00 UTC", "commit": commit, "cpu": "", "values": {"A: b": value}}

    def test_a_new_entry_replaces_that_of_its_commit(self):
        known = [self.entry("a", 1), self.entry("b", 2)]
        self.assertEqual([one["values"]["A: b"] for one in history.with_entry(known, self.entry("a", 3))], [2, 3])

    def test_earlier_values_leave_out_the_last_entry_and_unknown_targets(self):
        known = [self.entry("a", 1), self.entry("b", 2), self.entry("c", 3)]
        self.assertEqual(history.before(known, "A: b"), [("2026-01-01", 1), ("2026-01-02", 2)])
        self.assertEqual(history.before(known, "A: c"), [])

    def test_an_entry_has_the_value_of_each_target_that_has_figures(self):
        figures = {LOOKUP[0]: figure(900), LOOKUP[1]: figure(1800)}
        made = history.entry({"machine": MACHINE, "settings": {}, "figures": figures})
        self.assertEqual(list(made["values"].values()), [0.5])


class Summary(unittest.TestCase):
    def test_sentences_without_figures_are_left_out(self):
        self.assertNotIn("- ", summary.text({}))
        said = summary.text({"stream/1khz/owner_cpu": figure(3.25, "%")})
        self.assertIn("- An owner that receives 100 edges at 1 kHz uses 3.25 % of a core.", said)


if __name__ == "__main__":
    unittest.main()
