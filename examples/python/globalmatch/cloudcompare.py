"""A plugin of CloudCompare's Python runtime: registers one of two selected clouds with the other one."""
import cccorelib
import numpy as np
import pycc

import globalmatch


def selected_clouds():
    """Both selected clouds. Raises RuntimeError where there are not two."""
    entities = pycc.GetInstance().getSelectedEntities()
    clouds = [entity for entity in entities if isinstance(entity, pycc.ccPointCloud)]
    if len(clouds) != 2:
        raise RuntimeError(f"globalmatch: select two clouds; {len(clouds)} are selected")
    return clouds


def global_shift(cloud):
    """What CloudCompare added to the coordinates of the file, so that they are small."""
    shift = cloud.getGlobalShift()
    return shift.x, shift.y, shift.z


def register(source, target, progress=None):
    """The registration of two clouds, in the coordinates that CloudCompare shows."""
    # A scanner stood at the origin of its file; the library recognises where it did not.
    maps = [
        globalmatch.map_stems(cloud.points(), scanner=global_shift(cloud), progress=progress)
        for cloud in (source, target)
    ]
    return globalmatch.register_maps(*maps, progress=progress)


def transform(cloud, matrix):
    """Transforms the points of the cloud, for good."""
    columns = [cccorelib.CCVector3(*map(float, matrix[:3, column])) for column in range(4)]
    cloud.setGLTransformation(pycc.ccGLMatrix(*columns))
    cloud.applyGLTransformation_recursive()


def describe(registration, source, target):
    """A line about the result, for people."""
    line = f"globalmatch: {source.getName()} on {target.getName()}: {registration.outcome}"
    if registration.target_from_source is None:
        return f"{line}: {registration.reason}"
    pairs = len(registration.hypotheses[0].correspondences)
    uncertainty = registration.uncertainty
    error = 100 * np.sqrt(np.trace(uncertainty.at(uncertainty.center)[:2, :2]))
    return (
        f"{line}: {pairs} stems paired, probability {registration.probability:.3f}, standard error by the "
        f"stems alone {error:.1f} cm in plan; its transformation history has the matrix"
    )


def register_and_report(source, target):
    """Registers the source with the target, transforms it where that succeeds, and says what came of it."""
    dialog = pycc.ccProgressDialog(True)
    dialog.setMethodTitle("Registration by stems")
    dialog.start()

    def progress(fraction, _stage):
        dialog.update(100 * fraction)
        return not dialog.isCancelRequested()

    try:
        registration = pycc.RunInThread(register, source, target, progress)
    finally:
        dialog.stop()
    for _code, text in registration.warnings:
        pycc.ccLog.Warning(f"globalmatch: {text}")
    line = describe(registration, source, target)  # what fails here leaves the cloud as it was
    if registration.target_from_source is None:
        log = pycc.ccLog.Warning if registration.outcome == "cancelled" else pycc.ccLog.Error
        log(line)
        return registration
    transform(source, registration.target_from_source)
    source.setGlobalShift(*global_shift(target))
    pycc.ccLog.Print(line)
    pycc.GetInstance().redrawAll()
    pycc.GetInstance().updateUI()
    return registration


class GlobalMatch(pycc.PythonPluginInterface):
    """What CloudCompare finds by the entry point group cloudcompare.plugins."""

    def __init__(self):
        pycc.PythonPluginInterface.__init__(self)

    def getActions(self):
        return [
            pycc.Action(name="Register the first selected scan with the second", target=self.register_first),
            pycc.Action(name="Register the second selected scan with the first", target=self.register_second),
        ]

    @staticmethod
    def register_first():
        register_and_report(*selected_clouds())

    @staticmethod
    def register_second():
        register_and_report(*reversed(selected_clouds()))
