"""The configuration of PLUS against what defrec sends.

usage: test_plus.py CONFIGURATION MESSAGES GUIDE

MESSAGES: sdk/live_link/messages.cpp. GUIDE: docs/program/live_link.md.
"""
import pathlib
import re
import sys
import unittest
import xml.etree.ElementTree

CONFIGURATION, MESSAGES, GUIDE = (pathlib.Path(path) for path in sys.argv[1:4])
FRAMES_A_SECOND = 30


class Configuration(unittest.TestCase):
    def setUp(self):
        self.root = xml.etree.ElementTree.parse(CONFIGURATION).getroot()
        self.device = self.root.find("DataCollection/Device")
        self.server = self.root.find("PlusOpenIGTLinkServer")

    def test_the_tool_is_the_transform_that_is_sent(self):
        tools = [tool.get("Id") for tool in self.device.findall("DataSources/DataSource")]
        names = [f"{tool}To{self.device.get('ToolReferenceFrame')}" for tool in tools]
        source = MESSAGES.read_text()
        for name in names:
            self.assertIn(f'append(*message, "{name}", frame, out)', source)
        passed_on = self.server.findall("DefaultClientInfo/TransformNames/Transform")
        self.assertEqual([transform.get("Name") for transform in passed_on], names)

    def test_channels_are_those_that_there_are(self):
        tools = [tool.get("Id") for tool in self.device.findall("DataSources/DataSource")]
        channels = self.device.findall("OutputChannels/OutputChannel")
        self.assertEqual(
            [source.get("Id") for channel in channels for source in channel.findall("DataSource")],
            tools,
        )
        self.assertIn(
            self.server.get("OutputChannelId"), [channel.get("Id") for channel in channels]
        )

    def test_ports_are_those_of_the_guide(self):
        port = self.device.get("ServerPort")
        self.assertIn(f"--igtl-listen {port}", GUIDE.read_text())
        self.assertNotEqual(self.server.get("ListeningPort"), port)
        self.assertIn(self.server.get("ListeningPort"), GUIDE.read_text())

    def test_every_message_of_a_frame_is_read(self):
        kinds = re.findall(r'append\(\*message, "(\w+)", frame, out\)', MESSAGES.read_text())
        self.assertGreater(len(kinds), 3)
        # One at each acquisition, those of other types as well.
        self.assertGreaterEqual(
            int(self.device.get("AcquisitionRate")), FRAMES_A_SECOND * (len(set(kinds)) + 1)
        )

    def test_an_old_pose_does_not_pass_for_a_new_one(self):
        self.assertEqual(self.device.get("UseLastTransformsOnReceiveTimeout"), "FALSE")
        self.assertEqual(self.server.get("SendValidTransformsOnly"), "TRUE")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
