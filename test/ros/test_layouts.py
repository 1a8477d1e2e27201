"""What the files for RViz and Foxglove show is what the launch file has the node publish. No ROS in here."""

import json
import re
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[2]
RVIZ = yaml.safe_load((ROOT / "rviz" / "rigid_body.rviz").read_text())["Visualization Manager"]
FOXGLOVE = json.loads((ROOT / "foxglove" / "rigid_body.json").read_text())
LAUNCH = (ROOT / "launch" / "rigid_body.launch.xml").read_text()
OUTPUTS = {"pose", "twist", *re.search(r"outputs:=\[(.*?)\]", LAUNCH)[1].split(", ")}
PUBLISHED = (ROOT / "docs" / "reference" / "interface.md").read_text()


def test_rviz_shows_what_is_published():
    shown = {display["Topic"]["Value"] for display in RVIZ["Displays"] if "Topic" in display}
    assert shown == OUTPUTS - {"twist", "tf"}
    assert RVIZ["Global Options"]["Fixed Frame"] == "world"


def test_every_panel_of_the_layout_has_its_configuration():
    def leaves(node):
        return [node] if isinstance(node, str) else leaves(node["first"]) + leaves(node["second"])

    assert sorted(leaves(FOXGLOVE["layout"])) == sorted(FOXGLOVE["configById"])


def test_foxglove_names_topics_and_services_of_the_node():
    text = json.dumps(FOXGLOVE)
    panels = FOXGLOVE["configById"].values()
    plotted = {path["value"].split(".")[0] for panel in panels for path in panel.get("paths", [])}
    assert {topic.strip("/") for topic in plotted} <= OUTPUTS
    for service in re.findall(r"/rigid_body_node/(\w+)", text):
        assert f"`~/{service}`" in PUBLISHED
    for topic in FOXGLOVE["configById"]["3D!body"]["topics"]:
        assert topic.strip("/") in OUTPUTS
