#!/usr/bin/env python3
"""The page in a real browser. Needs Debian's chromium, chromium-driver and python3-selenium. Keeps a screenshot."""

import math
import os
import pathlib
import re
import shutil
import signal
import time
import unittest

import rig

try:
    from selenium import webdriver
    from selenium.common.exceptions import StaleElementReferenceException
    from selenium.webdriver.chrome.service import Service
except ImportError:
    rig.skip("python3-selenium is missing")

DRIVER = shutil.which("chromedriver")
if not DRIVER or not shutil.which("chromium"):
    rig.skip("chromium or chromedriver is missing")

PICTURES = pathlib.Path(os.environ.get("TFDUDE_ARTEFACTS", rig.ROOT / "build/web-screenshots"))
POSE = "const {model} = tfdude, i = 7 * model.index.get(arguments[0]); return [...model.pose.subarray(i, i + 7)]"
# The interval and the numbers of the velocity that the page shows.
VELOCITY = """
const {inspector} = tfdude, {answer} = inspector, shown = answer && inspector.velocity(answer);
if (!shown || !document.getElementById('inspector').innerText.includes('Velocity')) return null;
const ago = (one) => BigInt(answer.stamp_ns) - BigInt(one.answer.stamp_ns);
const before = [...inspector.plot.samples].reverse().find((one) => ago(one) >= 100000000n);
return [before.answer.stamp_ns, answer.stamp_ns, shown.title];
"""


def open_browser(width=1440, height=900):
    options = webdriver.ChromeOptions()
    for argument in ("--headless=new", "--no-sandbox", "--enable-unsafe-swiftshader", "--disable-dev-shm-usage",
                     "--hide-scrollbars", f"--window-size={width},{height}"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    browser = webdriver.Chrome(service=Service(DRIVER), options=options)
    browser.set_script_timeout(60)
    return browser


class Browser(unittest.TestCase):
    def number(self, answer):
        """An answer's pose as 7 numbers, quaternion first."""
        return answer["rotation"] + answer["translation"]

    def assert_same_pose(self, a, b, tolerance):
        """As 7 numbers each; a quaternion and its negative are the same rotation."""
        sign = 1 if sum(p * q for p, q in zip(a[:4], b[:4])) > 0 else -1
        self.assert_close([sign * q for q in a[:4]] + a[4:], b, tolerance)

    def assert_close(self, a, b, tolerance):
        for one, other in zip(a, b):
            self.assertAlmostEqual(one, other, delta=tolerance)

    def answer(self, browser, condition=""):
        script = "const a = tfdude.inspector.answer; return a && !a.error" + condition + " ? a : null"
        return rig.eventually(lambda: browser.execute_script(script), "an answer for A and B")

    def test_a_page_shows_what_the_command_line_says(self):
        with rig.Rig() as robot:
            browser = open_browser()
            try:
                self.look(robot, browser)
            finally:
                PICTURES.mkdir(parents=True, exist_ok=True)
                browser.save_screenshot(str(PICTURES / "arm.png"))
                browser.quit()

    def look(self, robot, browser):
        browser.get(robot.url)
        shown = "return window.tfdude && tfdude.model.shown.filter(x => x).length"
        rig.eventually(lambda: browser.execute_script(shown) == 12, "all frames")
        for frame in ("tool0", "lidar"):
            said = self.number(robot.ask("lookup", "world", frame))
            self.assert_same_pose(browser.execute_script(POSE, frame), said, 1e-4)
        self.choose_two(robot, browser)
        self.drag(robot, browser)
        # Later: the server then reads the memory of the owners, and the last digits of its answers may be others.
        self.explain(robot, browser)
        self.refit(robot, browser)
        robot.arm.send_signal(signal.SIGKILL)
        rig.eventually(lambda: browser.execute_script(
            "const {model} = tfdude; return !model.isReachable(model.index.get('tool0'))"), "an owner that died")
        grey = browser.execute_script("const {scene, model} = tfdude; return ['tool0', 'lidar'].map(id => "
                                      "scene.colourOf(model.index.get(id)) === scene.grey)")
        self.assertEqual(grey, [True, False])
        severe = [line["message"] for line in browser.get_log("browser") if line["level"] == "SEVERE"]
        self.assertEqual(severe, [])

    def choose_two(self, robot, browser):
        find = "return [...document.querySelectorAll('.row')].find(row => row.querySelector('.name').textContent === "

        def clicked():
            # The list may be drawn again between the search and the click.
            try:
                browser.execute_script(find + "'tool0')").click()
                return True
            except StaleElementReferenceException:
                return False

        rig.eventually(clicked, "a row of the list")
        self.assertEqual(browser.execute_script("return tfdude.inspector.a.value"), "world")
        self.answer(browser)
        joints = robot.ask("lookup", "world", "tool0")["unsampled_joints"]
        self.assertEqual(len(joints), 6)
        text = "return document.getElementById('inspector').innerText"
        note = f"6 joints have had no sample: {', '.join(joints)}."
        rig.eventually(lambda: note in browser.execute_script(text), "the joints that are assumed")
        robot.ask("joint", *[f"{joint}=0.3" for joint in joints], "--stddev", "0.01")
        answer = self.answer(browser, " && a.covariance")
        rig.eventually(lambda: "no sample" not in browser.execute_script(text), "positions that are measured")
        said = robot.ask("lookup", "world", "tool0")
        self.assert_same_pose(self.number(answer), self.number(said), 1e-12)
        # Deviations are in the axes of the numbers beside them: those of the origin of B are what `point` prints.
        origin = robot.ask("point", "world", "tool0", "0", "0", "0")["points"][0]["covariance"]
        sigmas = browser.execute_script("return tfdude.inspector.sigmas(tfdude.inspector.answer)")
        self.assert_close(sigmas[:3], [origin[i][i] ** 0.5 for i in range(3)], 1e-9)
        self.assert_close(sigmas[3:], [said["covariance"][i][i] ** 0.5 for i in range(3, 6)], 1e-9)
        key = "covariance" if said.get("covariance") else "covariance_of_specified"
        for row, other in zip(answer[key], said[key]):
            self.assert_close(row, other, 1e-12)
        # The picture of B has the covariance of the owners, not only nearly, once it has the samples.
        picture = ("const {model} = tfdude; model.solveSigmas(); const i = 36 * model.index.get('tool0'); "
                   "return [...model.cov.subarray(i, i + 36)]")
        rows = [entry for row in said["covariance"] for entry in row]

        def same():
            shown = browser.execute_script(picture)
            return all(abs(one - other) <= 1e-12 * max(rows) for one, other in zip(shown, rows))

        rig.eventually(same, "the covariance of the owners in the picture")
        self.assertIn("#root=world&a=world&b=tool0", browser.current_url)
        # Seen from another frame, the ellipsoid is that of a lookup from there.
        browser.execute_script("tfdude.seeFrom('lidar'); tfdude.model.solveSigmas()")
        said = robot.ask("lookup", "lidar", "wrist_1_link")
        self.assert_same_pose(browser.execute_script(POSE, "wrist_1_link"), self.number(said), 1e-4)
        diagonal = browser.execute_script("const {model} = tfdude, i = model.index.get('wrist_1_link'); "
                                          "return [0, 7, 14, 21, 28, 35].map(k => model.cov[36 * i + k])")
        rows = said.get("covariance") or said["covariance_of_specified"]
        for i, variance in enumerate(diagonal):
            self.assertAlmostEqual(variance, rows[i][i], delta=1e-3 * rows[i][i] + 1e-12)
        browser.execute_script("tfdude.seeFrom('world')")

    def explain(self, robot, browser):
        browser.execute_script("document.getElementById('ask-why').click()")
        text = "return document.getElementById('why').innerText"
        why = robot.ask("why", "world", "tool0")
        rig.eventually(lambda: "the least certain" in browser.execute_script(text), "an explanation")
        shown = browser.execute_script(text)
        for name in [one["name"] for one in why["edges"][:3]] + [why["best"]["to"]]:
            self.assertIn(name, shown)
        (x, y, z), distance = browser.execute_script(
            "const {inspector} = tfdude, {answer} = inspector; return [answer.translation, inspector.distance(answer)]")
        number, unit = re.match(r"Distance (\S+) (m|mm) ± ", distance).groups()
        metres = float(number) * {"m": 1, "mm": 1e-3}[unit]
        self.assertAlmostEqual(metres, math.hypot(x, y, z), delta=0.005 * metres)
        self.assertEqual(browser.execute_script("return tfdude.inspector.b.title"), "tool0")

    def refit(self, robot, browser):
        """What comes later is shown, unless the user has turned the view."""
        outside = "return tfdude.scene.isOutside()"
        browser.execute_script("tfdude.scene.fit()")
        self.assertFalse(browser.execute_script(outside))
        robot.ask("add", "beacon", "--parent", "world", "--xyz", "30", "0", "0")
        rig.eventually(lambda: browser.execute_script("return tfdude.model.index.has('beacon')"), "a new frame")
        rig.eventually(lambda: not browser.execute_script(outside), "a view with the new frame")
        browser.execute_script("tfdude.scene.turned = true")
        robot.ask("update", "beacon", "--xyz", "300", "0", "0")
        wanted = "return document.getElementById('fit').classList.contains('wanted')"
        rig.eventually(lambda: browser.execute_script(wanted), "a button that says that something lies outside")
        robot.ask("remove", "beacon")

    def velocity(self, robot, browser):
        """That of the page is that of the owners, over the same interval."""
        begin, end, title = rig.eventually(lambda: browser.execute_script(VELOCITY), "a velocity")
        middle, over = (int(begin) + int(end)) // 2, (int(end) - int(begin)) * 1e-9
        said = robot.ask("velocity", "world", "tool0", "--at", f"{middle // 10**9}.{middle % 10**9:09}",
                         "--over", f"{over:.9f}")
        shown = [float(one) for one in re.findall(r"-?\d+\.\d+", title)]
        self.assert_close(shown, said["linear"] + said["angular"], 2e-3)
        self.assertGreater(math.hypot(*shown[:3]), 0.01)

    def joints_move(self, browser):
        position = "return tfdude.model.joints[0].position"
        begin = time.monotonic()
        for _ in range(10):
            before = browser.execute_script(position)
            rig.eventually(lambda before=before: browser.execute_script(position) != before, "a joint that moves")
        # Five times a second; a busy machine is slower.
        self.assertLess(time.monotonic() - begin, 8)

    def drag(self, robot, browser):
        robot.move()
        rig.eventually(lambda: browser.execute_script("return Number(tfdude.timeline.slider.min) < -3"),
                       "some seconds of motion")
        browser.execute_script("const {slider} = tfdude.timeline; slider.value = -1.5; "
                               "slider.dispatchEvent(new Event('input'))")
        self.joints_move(browser)
        at = int(browser.execute_script("return String(tfdude.timeline.at)"))
        answer = self.answer(browser, f" && a.past && a.stamp_ns === '{at}'")
        said = robot.ask("lookup", "world", "tool0", "--at", f"{at // 10**9}.{at % 10**9:09}")
        # One of them reads the owner's memory, which rounds in another order.
        numbers = sum([answer["translation"]] + answer["covariance"], [])
        for number, expected in zip(numbers, sum([said["translation"]] + said["covariance"], [])):
            self.assertAlmostEqual(number, expected, delta=1e-12)
        # The picture is interpolated between values at 30 Hz.
        self.assert_same_pose(browser.execute_script(POSE, "tool0"), self.number(said), 5e-3)
        browser.execute_script("tfdude.timeline.live()")
        self.answer(browser, " && !a.past")
        self.velocity(robot, browser)


if __name__ == "__main__":
    unittest.main()
