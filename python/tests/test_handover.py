"""A frame goes to another owner; and the example of docs/handover.md."""

import re
from pathlib import Path

import pytest
import tfdude

DOCS = Path(__file__).resolve().parents[2] / "docs"


def test_the_example_prints_what_the_page_says(capsys):
    page = (DOCS / "handover.md").read_text()
    example = re.search(r"```python\n(.*?)```", page, re.DOTALL).group(1)
    exec(compile(example, "handover.md", "exec"), {})
    printed = capsys.readouterr().out.splitlines()
    assert [f"`{line}`" for line in printed] == re.findall(r"It prints (`[^`]*`)", page)


def test_a_frame_moves_to_another_owner_and_parent(network):
    frames = [
        tfdude.FrameSpec("base"),
        tfdude.FrameSpec("gripper", "base", tfdude.Transform((1, 0, 0))),
        tfdude.FrameSpec("tip", "gripper", tfdude.Transform((1, 0, 0))),
    ]
    with tfdude.Node("arm1", frames, network=network), tfdude.Node("arm2", network=network) as arm2:
        with tfdude.Client(network=network) as client:
            owner = {frame.id: frame.partition for frame in client.frames()}
            assert owner == {"base": "arm1", "gripper": "arm1", "tip": "arm1"}
            client.hand_over("gripper", "arm2")
            owner = {frame.id: frame.partition for frame in client.frames()}
            assert owner == {"base": "arm1", "gripper": "arm2", "tip": "arm2"}
            client.add("flange", "base", tfdude.Transform((5, 0, 0)))
            client.hand_over("gripper", "arm1", "flange", tfdude.Transform((3, 0, 0)))
            assert arm2.lookup("base", "tip").translation[0] == 9
            with pytest.raises(tfdude.TransformException) as caught:
                client.hand_over("gripper", "nobody")
            assert caught.value.code == "unknown_partition"
            with pytest.raises(ValueError, match="parent"):
                client.hand_over("gripper", "arm2", X_PC=tfdude.Transform((3, 0, 0)))
