#!/usr/bin/env python3
"""A recording that is dropped on the page, in a real browser. Needs what browser_test.py needs. Keeps a screenshot."""

import base64
import pathlib
import tempfile
import time
import unittest

import rig

from browser_test import PICTURES, open_browser

DROP = """
const [content, name, type] = arguments;
const bytes = typeof content === 'number' ? new Uint8Array(content)
  : Uint8Array.from(atob(content), (c) => c.charCodeAt(0));
const dataTransfer = new DataTransfer();
dataTransfer.items.add(new File([bytes], name));
const event = new DragEvent(type, {dataTransfer, bubbles: true, cancelable: true});
document.getElementById('scene').dispatchEvent(event);
return [event.defaultPrevented, getComputedStyle(document.getElementById('drop')).display];
"""


class Dropped(unittest.TestCase):
    """A recording that is dropped on the page."""

    def test_a_page_shows_a_recording_and_goes_back_to_the_robot(self):
        with tempfile.TemporaryDirectory() as folder, rig.Rig("--max-recording", "20") as robot:
            file = pathlib.Path(folder) / "drive.mcap"
            robot.move()
            robot.ask("add", "only_then", "--parent", "world", "--xyz", "1", "2", "3")
            robot.record(file, 3.5)
            robot.ask("remove", "only_then")
            browser, other = open_browser(1200, 800), open_browser(800, 600)
            try:
                self.look(robot, browser, other, file)
                severe = [line["message"] for line in browser.get_log("browser") if line["level"] == "SEVERE"]
                self.assertEqual(severe, [])
            finally:
                browser.quit()
                other.quit()

    def eventually(self, browser, script, what):
        return rig.eventually(lambda: browser.execute_script("return " + script), what)

    def banner(self, browser, text):
        self.eventually(browser, f"document.getElementById('banner').innerText.includes({text!r})", "a banner: " + text)

    def drop(self, browser, content, name, kind="drop"):
        """@param content  bytes, or a number of zeros, which the driver takes 20 s to hand over"""
        if isinstance(content, bytes):
            content = base64.b64encode(content).decode()
        return browser.execute_script(DROP, content, name, kind)

    def look(self, robot, browser, other, file):
        live = "!tfdude.model.past && tfdude.model.count === 12"
        for one in (browser, other):
            one.get(robot.url)
            self.eventually(one, "window.tfdude && tfdude.model.shown.filter(x => x).length === 12", "all frames")
        browser.execute_script("tfdude.setEnds('world', 'tool0')")
        # What is no recording changes nothing.
        self.assertEqual(self.drop(browser, b"x", "a.txt", "dragenter"), [True, "grid"])
        self.assertEqual(self.drop(browser, b"not a recording", "a.txt"), [True, "none"])
        self.banner(browser, "no MCAP file")
        self.assertTrue(browser.execute_script("return " + live))
        time.sleep(1)  # between two files
        self.drop(browser, 21 << 20, "large.mcap")
        self.banner(browser, "takes 20 MiB")
        # One is shown, at its end.
        content = file.read_bytes()
        time.sleep(1)  # between two files
        self.drop(browser, content, "drive.mcap")
        self.banner(browser, "drive.mcap is a recording, not the robot")
        self.eventually(browser, "tfdude.model.index.has('only_then')", "its frames")
        self.eventually(browser, "tfdude.inspector.answer && tfdude.inspector.answer.past", "its numbers")
        span = [int(one) for one in browser.execute_script("return tfdude.timeline.recorded.map(String)")]
        self.assertGreater(span[1] - span[0], 3.5e9)
        length = (span[1] - span[0]) * 1e-9
        low = browser.execute_script("return Number(tfdude.timeline.slider.min)")
        self.assertAlmostEqual(low, -length, delta=0.02)
        # The slider goes through all of it.
        browser.execute_script("const {slider} = tfdude.timeline; slider.value = -2; "
                               "slider.dispatchEvent(new Event('input'))")
        at = span[1] - 2 * 10**9
        self.eventually(browser, f"Math.abs(Number(tfdude.model.now - {at}n)) < 2e7", "an instant of the past")
        self.assertIn(" of ", browser.execute_script("return document.getElementById('instant').innerText"))
        # Space plays, and stops at the end.
        browser.execute_script("tfdude.timeline.togglePause()")
        self.assertTrue(browser.execute_script("return document.body.classList.contains('playing')"))
        self.eventually(browser, f"tfdude.model.now === {span[1]}n", "its end")
        self.eventually(browser, "!document.body.classList.contains('playing')", "a stop")
        self.eventually(browser, "tfdude.inspector.plot.samples.length > 5", "a plot")
        text = "document.getElementById('inspector').innerText"
        self.eventually(browser, f"/Velocity .*mean of/.test({text})", "a velocity")
        PICTURES.mkdir(parents=True, exist_ok=True)
        browser.save_screenshot(str(PICTURES / "recording.png"))
        # Others go on seeing the robot.
        self.assertTrue(other.execute_script("return " + live + " && !tfdude.model.index.has('only_then')"))
        self.assertEqual(other.execute_script("return document.getElementById('banner').hidden"), True)
        # And back.
        browser.execute_script("document.getElementById('to-robot').click()")
        self.eventually(browser, live + " && tfdude.model.shown.filter(x => x).length === 12", "the robot")
        self.eventually(browser, f"tfdude.model.now > {span[1]}n", "values of now")
        self.eventually(browser, "tfdude.inspector.answer && !tfdude.inspector.answer.past", "numbers of now")
        self.assertTrue(browser.execute_script("return document.getElementById('banner').hidden"))
        self.assertEqual(browser.execute_script("return tfdude.model.root"), "world")


if __name__ == "__main__":
    unittest.main()
