#!/usr/bin/env python3
"""The module for 3D Slicer against stand-ins for Slicer's own modules: what it connects, shows and
says. The names that it takes from messages must be those that the live link sends.

usage: test_slicer_module.py MODULE_FOLDER MESSAGES_SOURCE
"""
import pathlib
import re
import sys
import types
import unittest

MODULES, MESSAGES = pathlib.Path(sys.argv.pop(1)), pathlib.Path(sys.argv.pop(1)).read_text()


class Display:
    def __init__(self):
        self.called = {}

    def __getattr__(self, name):
        if not name.startswith("Set"):
            raise AttributeError(name)
        return lambda *values: self.called.__setitem__(name, values)


class Node:
    """One of any class, with what the module calls."""

    def __init__(self, kind, name):
        self.kind, self.name, self.display = kind, name, None
        self.colours, self.started, self.target = {}, None, None
        self.code, self.frame, self.state, self.text = 0, 0, "", ""

    def GetID(self):
        return f"{self.kind}1{self.name}"

    def GetName(self):
        return self.name

    def GetDisplayNode(self):
        return self.display

    def CreateDefaultDisplayNodes(self):
        self.display = Display()

    def GetCode(self):
        return self.code

    def GetSubCode(self):
        return self.frame

    def GetErrorName(self):
        return self.state

    def GetStatusString(self):
        return self.text

    def SetTypeServer(self, port):
        self.target = ("", port)

    def SetTypeClient(self, host, port):
        self.target = (host, port)

    def Start(self):
        self.started = True

    def Stop(self):
        self.started = False

    def SetTypeToUser(self):
        pass

    def SetNumberOfColors(self, count):
        self.count = count

    def SetColor(self, at, name, red, green, blue, alpha):
        assert 0 <= at < self.count
        self.colours[at] = (name, red, green, blue, alpha)


class Scene:
    def __init__(self):
        self.nodes = []

    def AddNewNodeByClass(self, kind, name):
        self.nodes.append(Node(kind, name))
        return self.nodes[-1]

    def RemoveNode(self, node):
        self.nodes.remove(node)

    def GetFirstNodeByName(self, name):
        return next((node for node in self.nodes if node.name == name), None)

    def GetNodeByID(self, identity):
        return next((node for node in self.nodes if node.GetID() == identity), None)


class Widget:
    """Qt's, whichever: takes every call, and keeps signals' receivers."""

    def __init__(self, text=""):
        self.text, self.value, self.receivers, self.is_running = text, None, {}, False

    def connect(self, signal, receiver):
        self.receivers[signal] = receiver

    def start(self):
        self.is_running = True

    def stop(self):
        self.is_running = False

    def __getattr__(self, name):
        return lambda *values: None


def install_stand_ins():
    base = type("Base", (), {"__init__": lambda self, parent=None: None})
    base_widget = type(
        "BaseWidget", (base,), {"setup": lambda self: setattr(self, "layout", Widget())}
    )
    slicer = types.ModuleType("slicer")
    slicer.mrmlScene = Scene()
    slicer.vtkMRMLIGTLConnectorNode = object
    slicer.vtkMRMLDisplayNode = types.SimpleNamespace(UseManualScalarRange=4)
    slicer.shown = []
    slicer.util = types.SimpleNamespace(
        errorDisplay=slicer.shown.append,
        getNodesByClass=lambda kind: [node for node in slicer.mrmlScene.nodes if node.kind == kind],
    )
    loadable = types.ModuleType("slicer.ScriptedLoadableModule")
    loadable.ScriptedLoadableModule = loadable.ScriptedLoadableModuleLogic = base
    loadable.ScriptedLoadableModuleWidget = base_widget
    qt, vtk = types.ModuleType("qt"), types.ModuleType("vtk")
    for name in ("LineEdit", "SpinBox", "ComboBox", "DoubleSpinBox", "PushButton", "Label"):
        setattr(qt, "Q" + name, Widget)
    qt.QFormLayout = qt.QTimer = Widget
    vtk.vtkAssignAttribute = types.SimpleNamespace(POINT_DATA=1)
    for module in (slicer, loadable, qt, vtk):
        sys.modules[module.__name__] = module
    return slicer


slicer = install_stand_ins()
sys.dont_write_bytecode = True
sys.path.insert(0, str(MODULES))
import DefrecLive as module  # noqa: E402


class Logic(unittest.TestCase):
    def setUp(self):
        slicer.mrmlScene = Scene()
        self.logic = module.DefrecLiveLogic()

    def receive(
        self, frame=7, code=1, state="tracking", text="reasons= vertices=4 points=3 targets=2"
    ):
        for kind, name in (
            ("vtkMRMLIGTLStatusNode", module.STATE),
            ("vtkMRMLModelNode", module.SURFACE),
            ("vtkMRMLModelNode", module.TARGETS),
            *(("vtkMRMLMarkupsFiducialNode", name) for name in module.POINTS),
        ):
            if slicer.mrmlScene.GetFirstNodeByName(name) is None:
                slicer.mrmlScene.AddNewNodeByClass(kind, name)
        status = slicer.mrmlScene.GetFirstNodeByName(module.STATE)
        status.frame, status.code, status.state, status.text = frame, code, state, text

    def display(self, name):
        return slicer.mrmlScene.GetFirstNodeByName(name).display.called

    def test_names_are_those_of_the_live_link(self):
        names = (module.STATE, module.SURFACE, module.TARGETS, module.ERROR, module.STATUS)
        for name in (*names, *module.POINTS):
            self.assertIn(f'"{name}"', MESSAGES)
        for number in module.POINTS.values():
            self.assertIn(f'" {number}="', MESSAGES)
        tracked, extrapolated = re.search(
            r"kTracked\{([\d, ]+)\}, kExtrapolated\{([\d, ]+)\}", MESSAGES
        ).groups()
        colours = [", ".join(map(str, colour)) for _, *colour in module.STATUS_COLOURS]
        self.assertEqual([tracked, extrapolated], colours[:2])

    def test_connects_as_server_and_as_client(self):
        for host in ("", "theatre-pc"):
            self.logic.connect(host, 18944)
            connector = self.logic.connector
            self.assertEqual(
                (connector.kind, connector.target), ("vtkMRMLIGTLConnectorNode", (host, 18944))
            )
            self.assertTrue(connector.started)
            self.logic.disconnect()
            self.assertFalse(connector.started)
            self.assertEqual(slicer.mrmlScene.nodes, [])
            self.logic.disconnect()

    def test_says_which_extension_is_missing(self):
        del slicer.vtkMRMLIGTLConnectorNode
        try:
            with self.assertRaisesRegex(RuntimeError, "SlicerOpenIGTLink"):
                self.logic.connect("", 18944)
        finally:
            slicer.vtkMRMLIGTLConnectorNode = object

    def test_shows_the_surface_by_its_error_and_by_status(self):
        self.assertEqual(self.logic.update(0.0), "waiting for defrec track")
        self.receive()
        self.assertEqual(self.logic.update(1.0), "Tracking, frame 7")
        shown = self.display(module.SURFACE)
        self.assertEqual(shown["SetScalarVisibility"], (True,))
        self.assertEqual(shown["SetActiveScalar"], (module.ERROR, 1))
        self.assertEqual(shown["SetScalarRange"], (0, 5.0))
        self.assertEqual(shown["SetScalarRangeFlag"], (4,))
        table = slicer.mrmlScene.GetNodeByID(shown["SetAndObserveColorNodeID"][0])
        self.assertEqual(len(table.colours), module.STEPS)
        self.assertGreater(table.colours[0][2], table.colours[0][1])  # green at first
        self.assertGreater(table.colours[255][1], 2 * table.colours[255][2])  # and red at last
        self.logic.show_errors_to(2.0)
        self.logic.colour_by(module.STATUS)
        self.logic.update(1.2)
        self.assertEqual(self.display(module.SURFACE)["SetActiveScalar"], (module.STATUS, 1))
        self.assertEqual(self.display(module.SURFACE)["SetScalarRange"], (0, 2))
        self.assertEqual(self.display(module.TARGETS)["SetActiveScalar"], (module.ERROR, 1))
        self.assertEqual(self.display(module.TARGETS)["SetScalarRange"], (0, 2.0))
        self.assertEqual(
            [node.name for node in slicer.mrmlScene.nodes if "Color" in node.kind],
            ["defrec: expected_error_mm", "defrec: status"],
        )

    def test_what_is_not_current_is_gray(self):
        self.receive()
        self.logic.update(0.0)
        self.receive(8, 4, "lost", "reasons=dark|few-matches vertices=0 targets=0")
        self.assertEqual(self.logic.update(0.1), "Lost, frame 8: dark, few-matches")
        for name in (module.SURFACE, module.TARGETS):
            self.assertEqual(self.display(name)["SetScalarVisibility"], (False,))
            self.assertEqual(self.display(name)["SetOpacity"], (0.25,))
        self.receive(9, text="reasons= vertices=4 targets=0")
        self.logic.update(0.2)
        self.assertEqual(self.display(module.SURFACE)["SetScalarVisibility"], (True,))
        self.assertEqual(self.display(module.TARGETS)["SetScalarVisibility"], (False,))
        self.assertEqual(self.logic.update(4.2), "No new frame for 4 s")
        self.assertEqual(self.display(module.SURFACE)["SetScalarVisibility"], (False,))
        self.receive(10, state="degraded")
        self.assertEqual(self.logic.update(4.3), "Less sure, frame 10")
        self.assertEqual(self.display(module.SURFACE)["SetOpacity"], (1.0,))

    def test_what_lies_in_the_scene_before_it_connects_is_not_current(self):
        self.receive()
        self.logic.connect("", 18944)
        self.assertEqual(self.logic.update(1.0), "waiting for defrec track")
        self.assertEqual(self.display(module.SURFACE)["SetScalarVisibility"], (False,))
        self.receive(8)
        self.assertEqual(self.logic.update(1.2), "Tracking, frame 8")
        self.assertEqual(self.display(module.SURFACE)["SetScalarVisibility"], (True,))
        self.logic.disconnect()
        self.logic.connect("", 18944)
        self.assertEqual(self.logic.update(1.4), "waiting for defrec track")
        self.assertEqual(self.display(module.SURFACE)["SetScalarVisibility"], (False,))
        self.receive(9)
        self.assertEqual(self.logic.update(1.6), "Tracking, frame 9")
        self.assertEqual(self.display(module.SURFACE)["SetScalarVisibility"], (True,))

    def test_parts_of_a_plan_are_shown_likewise(self):
        self.assertIn('"Plan" + std::to_string(part.place) + "-"', MESSAGES)
        for name in ("Plan0-liver", "Plan1-tumour", "Planning"):
            slicer.mrmlScene.AddNewNodeByClass("vtkMRMLModelNode", name)
        seen = "reasons= vertices=4 points=3 targets=2 "
        self.receive(text=seen + "parts=2 plan_targets=1 Plan0-liver Plan1-tumour")
        self.logic.update(0.0)
        self.assertEqual(self.display("Plan1-tumour")["SetActiveScalar"], (module.ERROR, 1))
        self.assertIsNone(slicer.mrmlScene.GetFirstNodeByName("Planning").display)
        # The tissue is followed, and what is known of the plan changes.
        for frame, (text, shown) in enumerate(
            (
                ("parts=1 plan_targets=1 Plan1-tumour", (False, True)),
                ("parts=2 plan_targets=1 Plan0-liver Plan1-tumour", (True, True)),
                ("parts=0 plan_targets=0", (False, False)),
            ),
            8,
        ):
            self.receive(frame, state="degraded", text=seen + text)
            self.logic.update(0.1 * frame)
            for name, is_current in zip(("Plan0-liver", "Plan1-tumour"), shown):
                self.assertEqual(self.display(name)["SetScalarVisibility"], (is_current,))
        self.receive(12, 4, "lost", "reasons= vertices=0 points=0 targets=0")
        self.logic.update(1.2)
        self.assertEqual(self.display("Plan1-tumour")["SetScalarVisibility"], (False,))

    def test_points_that_are_not_current_are_hidden(self):
        def shown():
            return [self.display(name)["SetVisibility"][0] for name in module.POINTS]

        all_seen = "reasons= vertices=4 points=3 targets=2 parts=0 plan_targets=1"
        self.logic.connect("", 18944)
        self.receive(text=all_seen)
        self.logic.update(0.0)
        self.assertEqual(shown(), [True, True, True])
        # The last of each is lost, though the tissue is followed.
        self.receive(8, text="reasons= vertices=4 points=0 targets=0 parts=0 plan_targets=0")
        self.logic.update(0.1)
        self.assertEqual(shown(), [False, False, False])
        self.receive(9, text="reasons= vertices=4 points=3 targets=0")
        self.logic.update(0.2)
        self.assertEqual(shown(), [True, False, False])
        self.receive(10, text=all_seen)
        self.logic.update(0.3)
        self.assertEqual(shown(), [True, True, True])
        self.logic.update(4.3)  # silent
        self.assertEqual(shown(), [False, False, False])
        self.receive(11, text=all_seen)
        self.logic.update(4.4)
        self.receive(12, 4, "lost", "reasons= vertices=0 points=0 targets=0")
        self.logic.update(4.5)
        self.assertEqual(shown(), [False, False, False])
        self.receive(13, text=all_seen)
        self.logic.update(4.6)
        self.logic.disconnect()
        self.assertEqual(shown(), [False, False, False])

    def test_the_panel_connects_and_ends(self):
        widget = module.DefrecLiveWidget()
        widget.setup()
        widget.port.value = 18944
        widget.button.receivers["clicked()"]()
        self.assertTrue(widget.timer.is_running)
        self.assertEqual(widget.button.text, "Disconnect")
        self.receive()
        widget.timer.receivers["timeout()"]()
        self.assertEqual(widget.state.text, "Tracking, frame 7")
        widget.button.receivers["clicked()"]()
        self.assertFalse(widget.timer.is_running)
        self.assertIsNone(widget.logic.connector)
        self.assertEqual(widget.button.text, "Connect")
        widget.cleanup()


if __name__ == "__main__":
    unittest.main()
