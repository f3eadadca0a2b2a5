"""A module of 3D Slicer that shows what `defrec track --igtl` sends: the surface in the colours of
its expected error or status, and the state in words. Nothing is built: add this folder to Edit,
Application Settings, Modules, Additional module paths, and start Slicer again. It takes the
extension SlicerOpenIGTLink.
"""
import math
import re
import time

import qt
import slicer
import vtk
from slicer.ScriptedLoadableModule import (
    ScriptedLoadableModule,
    ScriptedLoadableModuleLogic,
    ScriptedLoadableModuleWidget,
)

# Device names and attributes: docs/program/live_link.md.
STATE, SURFACE, TARGETS = "TrackingState", "SurfaceInCamera", "TargetErrorsInCamera"
POINTS = {  # and how STATUS calls their number
    "PointsInCamera": "points",
    "TargetsInCamera": "targets",
    "PlanTargetsInCamera": "plan_targets",
}
PART = re.compile(r"Plan\d+-")  # and the name that the plan gives it
ERROR, STATUS = "expected_error_mm", "status"
STATUS_OK = 1

WAITING = "waiting for defrec track"
PORT = 18944
UPDATE_MS = 200
SILENT_S = 3.0  # without a frame
STEPS = 256  # of the colours of errors
STATUS_COLOURS = (
    ("observed", 45, 212, 191),
    ("extrapolated", 251, 191, 36),
    ("unknown", 156, 163, 175),
)
# From no error to the largest that is shown.
ERROR_COLOURS = ((45, 212, 191), (251, 191, 36), (200, 30, 30))
WORDS = {
    "tracking": "Tracking",
    "degraded": "Less sure",
    "relocalised": "Found again",
    "lost": "Lost",
    "initialising": "Starting",
}


def error_colour(share):
    """Red, green, blue from 0 to 1 of a share from 0 to 1 of the largest error."""
    at = min(max(share, 0.0), 1.0) * (len(ERROR_COLOURS) - 1)
    low = min(int(at), len(ERROR_COLOURS) - 2)
    pairs = zip(ERROR_COLOURS[low], ERROR_COLOURS[low + 1])
    return tuple((a + (at - low) * (b - a)) / 255 for a, b in pairs)


def parts_of_plan():
    """Names of the models that the parts of a plan have become."""
    models = slicer.util.getNodesByClass("vtkMRMLModelNode")
    return [model.GetName() for model in models if PART.match(model.GetName())]


class DefrecLive(ScriptedLoadableModule):
    def __init__(self, parent):
        ScriptedLoadableModule.__init__(self, parent)
        parent.title = "defrec live"
        parent.categories = ["IGT"]
        parent.dependencies = []
        parent.contributors = ["the defrec project"]
        parent.helpText = "Shows the deformed surface that `defrec track --igtl` sends."
        parent.acknowledgementText = "Apache-2.0"


class DefrecLiveWidget(ScriptedLoadableModuleWidget):
    def setup(self):
        ScriptedLoadableModuleWidget.setup(self)
        self.logic = DefrecLiveLogic()
        self.host = qt.QLineEdit()
        self.host.placeholderText = "empty: wait here for defrec track --igtl"
        self.port = qt.QSpinBox()
        self.port.setRange(1, 65535)
        self.port.value = PORT
        self.colour = qt.QComboBox()
        self.colour.addItems([ERROR, STATUS])
        self.largest = qt.QDoubleSpinBox()
        self.largest.setRange(0.1, 100)
        self.largest.value = self.logic.largest_mm
        self.button = qt.QPushButton("Connect")
        self.state = qt.QLabel("not connected")
        form = qt.QFormLayout()
        form.addRow("Host of --igtl-listen", self.host)
        form.addRow("Port", self.port)
        form.addRow("Colours", self.colour)
        form.addRow("Largest error, mm", self.largest)
        form.addRow(self.button)
        form.addRow("State", self.state)
        self.layout.addLayout(form)
        self.layout.addStretch(1)
        self.button.connect("clicked()", self.toggle)
        self.colour.connect("currentTextChanged(QString)", self.logic.colour_by)
        self.largest.connect("valueChanged(double)", self.logic.show_errors_to)
        self.timer = qt.QTimer()
        self.timer.setInterval(UPDATE_MS)
        self.timer.connect("timeout()", self.update)

    def toggle(self):
        if self.logic.connector is None:
            try:
                self.logic.connect(self.host.text.strip(), self.port.value)
            except RuntimeError as error:
                slicer.util.errorDisplay(str(error))
                return
            self.timer.start()
        else:
            self.timer.stop()
            self.logic.disconnect()
            self.state.text = "not connected"
        self.button.text = "Connect" if self.logic.connector is None else "Disconnect"

    def update(self):
        self.state.text = self.logic.update(time.monotonic())

    def cleanup(self):
        self.timer.stop()
        self.logic.disconnect()


class DefrecLiveLogic(ScriptedLoadableModuleLogic):
    def __init__(self):
        ScriptedLoadableModuleLogic.__init__(self)
        self.connector = None
        self.attribute = ERROR
        self.largest_mm = 5.0
        self.tables = {}
        self.frame, self.seen_at = None, -math.inf

    def connect(self, host, port):
        """host: where defrec listens; empty: Slicer listens."""
        if not hasattr(slicer, "vtkMRMLIGTLConnectorNode"):
            raise RuntimeError(
                "Install the extension SlicerOpenIGTLink first (View, Extensions Manager)."
            )
        self.connector = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLIGTLConnectorNode", "defrec")
        if host:
            self.connector.SetTypeClient(host, port)
        else:
            self.connector.SetTypeServer(port)
        # A state that lies in the scene already is no news.
        node = slicer.mrmlScene.GetFirstNodeByName(STATE)
        self.frame, self.seen_at = None if node is None else node.GetSubCode(), -math.inf
        self.connector.Start()

    def disconnect(self):
        if self.connector is None:
            return
        self.connector.Stop()
        slicer.mrmlScene.RemoveNode(self.connector)
        self.connector = None
        for name in (SURFACE, TARGETS, *parts_of_plan()):
            self.show(name, False)
        for name in POINTS:
            self.show_points(name, False)

    def colour_by(self, attribute):
        self.attribute = attribute

    def show_errors_to(self, largest_mm):
        self.largest_mm = largest_mm

    def update(self, now):
        """Shows what has arrived, and returns the state in words. now: s, of any steady clock."""
        node = slicer.mrmlScene.GetFirstNodeByName(STATE)
        if node is None:
            return WAITING
        if node.GetSubCode() != self.frame:
            self.frame, self.seen_at = node.GetSubCode(), now
        silent_s = now - self.seen_at
        is_current = node.GetCode() == STATUS_OK and silent_s < SILENT_S
        words = node.GetStatusString().split()
        facts = dict(pair.split("=", 1) for pair in words if "=" in pair)
        self.show(SURFACE, is_current and facts.get("vertices", "0") != "0")
        self.show(TARGETS, is_current and facts.get("targets", "0") != "0")
        for name in parts_of_plan():
            self.show(name, is_current and name in words)
        for name, number in POINTS.items():
            self.show_points(name, is_current and facts.get(number, "0") != "0")
        if silent_s == math.inf:
            return WAITING
        if silent_s >= SILENT_S:
            return f"No new frame for {silent_s:.0f} s"
        word = WORDS.get(node.GetErrorName(), node.GetErrorName())
        reasons = facts.get("reasons", "").replace("|", ", ")
        return f"{word}, frame {self.frame}" + (f": {reasons}" if reasons else "")

    def show(self, name, is_current):
        """A surface that is not current stays in gray, so that nobody takes it for the tissue."""
        model = slicer.mrmlScene.GetFirstNodeByName(name)
        if model is None:
            return
        if model.GetDisplayNode() is None:
            model.CreateDefaultDisplayNodes()
        display = model.GetDisplayNode()
        display.SetScalarVisibility(is_current)
        display.SetOpacity(1.0 if is_current else 0.25)
        display.SetColor(0.6, 0.6, 0.6)
        if not is_current:
            return
        # Targets have no status.
        attribute = ERROR if name == TARGETS else self.attribute
        display.SetActiveScalar(attribute, vtk.vtkAssignAttribute.POINT_DATA)
        display.SetAndObserveColorNodeID(self.table(attribute).GetID())
        display.SetScalarRangeFlag(slicer.vtkMRMLDisplayNode.UseManualScalarRange)
        last = len(STATUS_COLOURS) - 1 if attribute == STATUS else self.largest_mm
        display.SetScalarRange(0, last)

    def show_points(self, name, is_current):
        """Points have the colours of the scene: those that are not current are hidden."""
        points = slicer.mrmlScene.GetFirstNodeByName(name)
        if points is None:
            return
        if points.GetDisplayNode() is None:
            points.CreateDefaultDisplayNodes()
        points.GetDisplayNode().SetVisibility(is_current)

    def table(self, attribute):
        table = self.tables.get(attribute)
        if table is not None and slicer.mrmlScene.GetNodeByID(table.GetID()) is not None:
            return table
        title = "defrec: " + attribute
        table = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLColorTableNode", title)
        table.SetTypeToUser()
        if attribute == STATUS:
            table.SetNumberOfColors(len(STATUS_COLOURS))
            for i, (name, *colour) in enumerate(STATUS_COLOURS):
                table.SetColor(i, name, *(value / 255 for value in colour), 1.0)
        else:
            table.SetNumberOfColors(STEPS)
            for i in range(STEPS):
                table.SetColor(i, str(i), *error_colour(i / (STEPS - 1)), 1.0)
        self.tables[attribute] = table
        return table
