#!/usr/bin/env python3
"""Draws the picture of the README: picture.py FILE.png. The page of tfdude web, with the arm of the examples."""

import sys
import time

import browser_test
import rig


def main():
    with rig.Rig() as robot:
        robot.move()
        browser = browser_test.open_browser(1440, 1000)
        try:
            browser.get(robot.url)
            moves = "return window.tfdude && tfdude.model.span !== null"
            rig.eventually(lambda: browser.execute_script(moves), "motion")
            time.sleep(4)
            browser.execute_script("""
                tfdude.setTheme(false);
                tfdude.setEnds('world', 'tool0');
                tfdude.setShape(30);
                tfdude.scene.fit();
                tfdude.tree.moveTo(tfdude.model.index.get('tool0'));""")
            time.sleep(25)
            browser.execute_script("tfdude.scene.fit()")
            time.sleep(1)
            browser.save_screenshot(sys.argv[1])
        finally:
            browser.quit()


if __name__ == "__main__":
    main()
