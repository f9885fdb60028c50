"""ParaView opens geometry videos (.mp4), and writes the surface that is shown as one.

Load this file with Tools > Manage Plugins > Load New. ParaView's own Python must find gvpipe (docs/integrations.md).

- Reader: frames are time steps. Attributes and fields are point and cell data, parts the cell array ``part`` with the names
  ``part_names`` in the field data. A file with a volume gives the whole unstructured grid.
- Writer: the outer surface of a data set, over all time steps of its source, with its point and cell data.

Source of the interface: Kitware, ParaView 5.11, paraview.util.vtkAlgorithm.
"""

import os
import shutil
import sys

from paraview import print_error
from paraview.util.vtkAlgorithm import VTKPythonAlgorithmBase, smdomain, smproperty, smproxy
from vtkmodules.vtkCommonDataModel import vtkDataObject
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline

MISSING = (
    "this Python ({version}) does not find gvpipe: pip install --target FOLDER gvpipe with a Python of that version, "
    "then start ParaView with PYTHONPATH=FOLDER ({error})"
)


def import_gvpipe():
    """Return gvpipe, whose helper processes get a Python to run in; None, and a message, where it is missing."""
    try:
        import gvpipe
    except ImportError as error:
        print_error(MISSING.format(version=sys.version.split()[0], error=error))
        return None
    if not os.access(sys.executable or "", os.X_OK) or "python" not in os.path.basename(sys.executable):
        # inside of ParaView it names a program that does not exist, or ParaView
        sys.executable = shutil.which(f"python{sys.version_info.major}.{sys.version_info.minor}") or shutil.which("python3")
    return gvpipe


@smproxy.reader(
    name="GeometryVideoReader", label="Geometry Video", extensions="mp4", file_description="Geometry video (gvpipe)"
)
class GeometryVideoReader(VTKPythonAlgorithmBase):
    """Frames of a geometry video as time steps; each is decoded when it is shown."""

    def __init__(self):
        super().__init__(nInputPorts=0, nOutputPorts=1, outputType="vtkDataSet")
        self._path, self._video = None, None

    @smproperty.stringvector(name="FileName")
    @smdomain.filelist()
    def SetFileName(self, path):
        if path != self._path:
            self._path, self._video = path, None
            self.Modified()

    @smproperty.doublevector(name="TimestepValues", information_only="1", si_class="vtkSITimeStepsProperty")
    def GetTimestepValues(self):
        return [] if self._open() is None else self._video.times.tolist()

    def RequestDataObject(self, request, inputs, outputs):
        if self._open() is None:
            return 0
        made = self._video.frame(0).NewInstance()
        outputs.GetInformationObject(0).Set(vtkDataObject.DATA_OBJECT(), made)
        return 1

    def RequestInformation(self, request, inputs, outputs):
        if self._open() is None:
            return 0
        times, held = self._video.times.tolist(), outputs.GetInformationObject(0)
        held.Set(Pipeline.TIME_STEPS(), times, len(times))
        held.Set(Pipeline.TIME_RANGE(), [times[0], times[-1]], 2)
        return 1

    def RequestData(self, request, inputs, outputs):
        import gvpipe

        held = outputs.GetInformationObject(0)
        asked = held.Get(Pipeline.UPDATE_TIME_STEP()) if held.Has(Pipeline.UPDATE_TIME_STEP()) else 0.0
        frame = self._video.frame_at(asked)
        try:
            found = self._video.frame(frame)
        except gvpipe.GvpipeError as error:
            print_error(str(error))
            return 0
        output = vtkDataObject.GetData(held)
        if not output.IsA(found.GetClassName()):
            print_error(f"{self._path}: frame {frame} has a volume, or none, unlike frame 0; open its shots as files")
            return 0
        output.ShallowCopy(found)
        output.GetInformation().Set(vtkDataObject.DATA_TIME_STEP(), float(self._video.times[frame]))
        return 1

    def _open(self):
        gvpipe = import_gvpipe() if self._video is None and self._path else None
        if gvpipe is not None:
            from gvpipe.playback.vtk_video import VtkVideo

            try:
                self._video = VtkVideo(self._path)
            except gvpipe.GvpipeError as error:
                print_error(str(error))
        return self._video


@smproxy.writer(extensions="mp4", file_description="Geometry video (gvpipe)", support_reload=False)
@smproperty.input(name="Input", port_index=0)
@smdomain.datatype(dataTypes=["vtkDataSet", "vtkCompositeDataSet"], composite_data_supported=True)
class GeometryVideoWriter(VTKPythonAlgorithmBase):
    """The surface of what is shown, over the time steps of its source, within an error."""

    def __init__(self):
        super().__init__(nInputPorts=1, nOutputPorts=0, inputType="vtkDataObject")
        self._path, self._bound = None, 0.0

    @smproperty.stringvector(name="FileName", panel_visibility="never")
    @smdomain.filelist()
    def SetFileName(self, path):
        if path != self._path:
            self._path = path
            self.Modified()

    @smproperty.doublevector(name="MaxError", label="Max Error", default_values="0")
    def SetMaxError(self, bound):
        if bound != self._bound:
            self._bound = bound
            self.Modified()

    def RequestData(self, request, inputs, outputs):
        return 1

    def Write(self):
        """Write the file; ParaView calls this."""
        gvpipe = import_gvpipe()
        if gvpipe is None:
            return
        source = self.GetInputAlgorithm(0, 0)
        try:
            gvpipe.encode(gvpipe.from_vtk(source, name="ParaView's data"), self._path, max_error=self._bound or None)
        except (gvpipe.GvpipeError, ValueError) as error:
            print_error(f"{self._path} is not written: {error}")
