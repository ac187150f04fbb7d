"""What the plugin uses of pycc and cccorelib, the modules of CloudCompare's Python runtime, which are nowhere
else. Names and signatures are those of its documentation."""
import types

import numpy as np


class CCVector3:
    def __init__(self, x, y, z):
        self.x, self.y, self.z = x, y, z


class ccGLMatrix:
    """Made of the columns of a 4 x 4 matrix of float32."""

    def __init__(self, X, Y, Z, Tr):
        self.matrix = np.eye(4, dtype=np.float32)
        for k, column in enumerate((X, Y, Z, Tr)):
            self.matrix[:3, k] = column.x, column.y, column.z


class ccPointCloud:
    def __init__(self, name, points, shift=(0.0, 0.0, 0.0)):
        self.name, self.shift, self.pending = name, CCVector3(*shift), None
        self.coordinates = np.asarray(points + np.array(shift), np.float32)

    def getName(self):
        return self.name

    def points(self):
        view = self.coordinates.view()
        view.flags.writeable = False
        return view

    def getGlobalShift(self):
        return self.shift

    def setGlobalShift(self, x, y, z):
        self.shift = CCVector3(x, y, z)

    def setGLTransformation(self, trans):
        self.pending = trans.matrix

    def applyGLTransformation_recursive(self):
        turned = self.coordinates @ self.pending[:3, :3].T + self.pending[:3, 3]
        self.coordinates, self.pending = turned.astype(np.float32), None

    def original(self):
        """The coordinates of the file."""
        return self.coordinates - np.array([self.shift.x, self.shift.y, self.shift.z])


class ccProgressDialog:
    cancel = False  # what the user pressed

    def __init__(self, cancelButton):
        self.title, self.percent, self.is_open = "", [], False

    def setMethodTitle(self, title):
        self.title = title

    def start(self):
        self.is_open = True

    def stop(self):
        self.is_open = False

    def update(self, percent):
        assert self.is_open and 0 <= percent <= 100
        self.percent.append(percent)

    def isCancelRequested(self):
        return self.cancel


class PythonPluginInterface:
    pass


class Action:
    def __init__(self, name, target, icon=None):
        self.name, self.target, self.icon = name, target, icon


def modules(selected):
    """Both modules, of an instance with these entities selected; `pycc.log` has what was logged."""
    pycc, cccorelib = types.ModuleType("pycc"), types.ModuleType("cccorelib")
    pycc.log = []
    levels = {
        level: staticmethod(lambda message, level=level: pycc.log.append((level, message)))
        for level in ("Print", "Warning", "Error")
    }
    pycc.ccLog = type("ccLog", (), levels)
    instance = types.SimpleNamespace(
        getSelectedEntities=lambda: list(selected), redrawAll=lambda: None, updateUI=lambda: None
    )
    pycc.GetInstance = lambda: instance
    pycc.RunInThread = lambda function, *arguments: function(*arguments)
    for part in (ccGLMatrix, ccPointCloud, ccProgressDialog, PythonPluginInterface, Action):
        setattr(pycc, part.__name__, part)
    cccorelib.CCVector3 = CCVector3
    return pycc, cccorelib
